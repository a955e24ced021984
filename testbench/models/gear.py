# SPDX-License-Identifier: Apache-2.0
"""Reference model of the electronic gear: the steps that a count of pulses makes."""

from dataclasses import dataclass, field

from testbench.models.step_dir import StepDir


def steps_of(pulses: int, n: int, m: int) -> int:
    """Steps of a sum of pulses: n/m of it, to the nearest, half a step upwards."""
    return (pulses * n + m // 2) // m


@dataclass
class Gear:
    """Pulses taken and the shape of the steps that they make."""

    n: int = 1
    m: int = 1
    pulses: int = 0     # taken since the beginning
    step_dir: StepDir = field(default_factory=StepDir)
    pulse: int = 0      # FP of the clock to come: -1, 0 or +1

    @property
    def steps(self) -> int:
        """Steps that the pulses taken make."""
        return steps_of(self.pulses, self.n, self.m)

    def tick(self, held: int, *, width: int, space: int, setup: int, safe: bool = False,
             clear: tuple[int, int] | None = None) -> None:
        """Go on by one clock, in which the counter outside holds ``held`` pulses (signed).

        ``clear`` is None, or n and m of a gear that begins.
        """
        way = (held > 0) - (held < 0) if not (self.pulse or clear) else 0
        made = steps_of(self.pulses + way, self.n, self.m) - self.steps
        self.step_dir.tick(made, width=width, space=space, setup=setup, safe=safe)
        taken = self.step_dir.taken if made else bool(way) and not safe
        self.pulse = way if taken else 0
        self.pulses += self.pulse
        if clear:
            (self.n, self.m), self.pulses = clear, 0
