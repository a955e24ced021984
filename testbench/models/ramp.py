# SPDX-License-Identifier: Apache-2.0
"""Reference model of the accelerator/decelerator, clock by clock in exact integers."""

from dataclasses import dataclass
from functools import cache

PULSE = 1 << 32
STEP_CLOCKS = 4  # a step of the ramp, by a quarter of the acceleration
FRACTION = 20    # bits of the braking distance below the pulse


@cache
def braking(start_rate: int, acceleration: int, level: int) -> int:
    """2**-20 pulses from so many steps above ``start_rate`` down to it, each step rounded down."""
    if level == 0:
        return 0
    covered = (4 * start_rate + level * acceleration) * STEP_CLOCKS // 4
    return (braking(start_rate, acceleration, level - 1) + (covered >> 32 - FRACTION))


@dataclass
class Ramp:
    """The registers of the ramp as they are after so many calls of ``tick``.

    What is decided in a clock, from what was stored and asked for then, acts in the next one; the
    speed changes at the end of each fourth clock.
    """

    start_rate: int
    acceleration: int
    clock: int = 0
    level: int = 0       # steps of the ramp above the start/stop speed
    credit: int = 0      # towards the next pulse, which leaves at PULSE
    stored: int = 0
    pp: int = 0
    slower: bool = False
    faster: bool = False
    steady: bool = False

    @property
    def rate(self) -> int:
        return self.quarters // 4

    @property
    def quarters(self) -> int:
        """The speed in quarters, in which a step is exact."""
        return 4 * self.start_rate + self.level * self.acceleration

    @property
    def distance(self) -> int:
        return braking(self.start_rate, self.acceleration, self.level) >> FRACTION

    @property
    def moving(self) -> bool:
        return self.level > 0

    def pull(self, ps: int) -> bool:
        """A pulse is asked for in the clock to come, which has ``ps``."""
        return self.slower and self.moving and not self.stored and not ps

    def rest(self, ps: int) -> bool:
        return not (self.moving or self.stored or ps or self.pp)

    def tick(self, ps=0, *, target=0, brake=False, room=True, drop=False):
        """Go on by one clock with its inputs."""
        lead = 4 * target - self.quarters
        near = 0 <= lead < self.acceleration
        slower = self.moving and (brake or lead < 0)
        faster = not brake and lead >= self.acceleration and self.stored > 0
        steady = lead < self.acceleration and not slower

        leave = self.credit >= PULSE and self.stored > 0
        stuck = self.slower and not self.stored and not ps and not room
        if self.credit < PULSE or leave:
            self.credit = (self.credit % PULSE
                           + (target if near and not self.slower else self.rate))
        if self.clock % STEP_CLOCKS == 0:
            if self.slower and self.moving:
                self.level -= 1
            elif self.faster and not self.slower:
                self.level += 1
        self.clock += 1
        self.stored += ps - leave
        self.pp = int(leave)
        self.slower, self.faster, self.steady = slower, faster, steady
        if stuck or drop:
            self.level = 0
        if drop:
            self.stored = self.pp = 0
            self.slower = self.faster = False
