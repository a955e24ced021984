# SPDX-License-Identifier: Apache-2.0
"""Reference models of the DAC: both modulators, and sign and magnitude around them."""

from dataclasses import dataclass, field

BITS = 15


@dataclass
class PulseWidth:
    """Periods of ``2**bits`` clocks; what does not fill a clock is carried to the next period."""

    bits: int = 10
    clock: int = 0
    duty: int = 0
    remainder: int = 0

    def tick(self, magnitude: int) -> int:
        if self.clock == 0:
            self.duty, self.remainder = divmod(magnitude + self.remainder, 1 << (BITS - self.bits))
        high = int(self.clock < self.duty)
        self.clock = (self.clock + 1) % (1 << self.bits)
        return high


@dataclass
class SigmaDelta:
    """Error feedback with the filter ``(1 - z**-1)**2``, in units of one pulse / ``2**bits``.

    ``due`` is the first difference of the quantisation error, with the coming input in it, and
    ``noise`` the error itself, less half a pulse. The whole pulses of ``noise`` stick at -``bound``
    and ``bound`` - 1.
    """

    bits: int = BITS
    bound: int = 4
    due: int = 0
    noise: int = field(default=None)

    def __post_init__(self):
        if self.noise is None:
            self.noise = -(1 << self.bits) // 2

    def tick(self, magnitude: int) -> int:
        pulse = 1 << self.bits
        high = int(self.noise + self.due >= 0)
        whole, part = divmod(self.noise + self.due - high * pulse, pulse)
        self.noise = min(max(whole, -self.bound), self.bound - 1) * pulse + part
        self.due += magnitude - high * pulse
        return high


@dataclass
class Dac:
    """A modulator behind a sign."""

    kind: type = SigmaDelta
    options: dict = field(default_factory=dict)
    pulse: int = 0
    negative: int = 0

    def __post_init__(self):
        self.modulator = self.kind(**self.options)

    def tick(self, value: int, safe: bool = False) -> None:
        """Go on by one clock with the velocity ``value``, -32767 to 32767."""
        self.pulse = 0
        if safe:
            self.negative = 0
            self.modulator = self.kind(**self.options)
        elif value and (value < 0) != self.negative:
            self.negative = int(value < 0)
            self.modulator = self.kind(**self.options)
        elif value:
            self.pulse = self.modulator.tick(abs(value))
