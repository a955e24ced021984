# SPDX-License-Identifier: Apache-2.0
"""Reference model of the converter's front end: every level from the number of the clock."""

from dataclasses import dataclass, field

VOLTAGE, FLUID = 0, 1


def half_of(clock_hz: int) -> int:
    """Clocks of half a serial bit: the least with at most 16 MHz."""
    half = 1
    while clock_hz > 16_000_000 * 2 * half:
        half += 1
    return half


@dataclass
class Sampler:
    """Levels of the pins, and what comes out."""

    clock_hz: int
    every: int = 16
    latency: int = 4
    now: int = 0                                # number of the clock
    taken: list = field(default_factory=list)   # adc_data of all clocks
    voltage: int = 0
    fluid: int = 0
    voltage_valid: bool = False
    fluid_valid: bool = False
    fault: bool = False
    answers: dict = field(default_factory=lambda: {VOLTAGE: [True], FLUID: [True]})

    def __post_init__(self):
        self.half = half_of(self.clock_hz)

    def asked(self, frame: int) -> int:
        """Channel of a frame's command."""
        return FLUID if frame % self.every == self.every - 1 else VOLTAGE

    @property
    def pins(self) -> dict:
        """Levels to the converter in this clock."""
        frame, place = divmod(self.now // self.half, 34)
        bit, second = divmod(place - 2, 2)
        word = f"{0x0806 | self.asked(frame) << 7:016b}"
        return dict(select=int(place > 0), clock=int(place < 2 or second),
                    command=int(word[bit]) if place > 1 else 0)

    def clock(self, data: int) -> None:
        """Take ``adc_data`` of this clock; the outputs are then those of the next."""
        self.taken.append(data)
        self.voltage_valid = self.fluid_valid = False
        frame, place = divmod(self.now - self.latency - 33 * self.half, 34 * self.half)
        if frame > 0 and place == 0:
            bits = self.taken[self.now - 30 * self.half:self.now + 1:2 * self.half]
            self._judge(self.asked(frame - 1), int("".join(map(str, bits)), 2))
        self.now += 1

    def _judge(self, channel, word):
        right = word >> 12 == channel
        self.answers[channel].append(right)
        if right and not self.fault:
            if channel == FLUID:
                self.fluid, self.fluid_valid = word & 0xFFF, True
            else:
                self.voltage, self.voltage_valid = word & 0xFFF, True
        if not any(self.answers[channel][-4:]):
            self.fault = True
        elif all(given[-1] for given in self.answers.values()):
            self.fault = False
