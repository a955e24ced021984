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

    The speed changes at the end of each fourth clock, by the inputs and stored pulses of the clock
    before; the target is read in that clock only. A fall to the start/stop speed counts as a
    fourth clock.
    """

    start_rate: int
    acceleration: int
    clock: int = 0       # within a step, 0 to 3; the step ends in clock 0
    base: int = 0        # start_rate as it was in the last clock at rest
    level: int = 0       # steps of the ramp above the start/stop speed
    credit: int = 0      # towards the next pulse, which leaves at PULSE
    stored: int = 0
    pp: int = 0
    steady: bool = False
    # a clock ago
    braked: bool = False
    waiting: bool = False
    # when the target was last looked at
    aim: int = 0
    below: bool = False
    apart: bool = False
    known: bool = False  # aim was read, and no step down or fall has happened since

    @property
    def rate(self) -> int:
        return self.quarters // 4

    @property
    def quarters(self) -> int:
        """The speed in quarters, in which a step is exact."""
        return 4 * self.base + self.level * self.acceleration

    @property
    def distance(self) -> int:
        return braking(self.base, self.acceleration, self.level) >> FRACTION

    @property
    def moving(self) -> bool:
        return self.level > 0

    @property
    def slower(self) -> bool:
        return self.moving and (self.braked or self.below)

    @property
    def near(self) -> bool:
        return self.known and not self.below and not self.apart

    @property
    def speed(self) -> int:
        """Rate at which stored pulses leave."""
        return self.aim if self.near and not self.slower else self.rate

    def pull(self, ps: int) -> bool:
        """A pulse is asked for in the clock to come, which has ``ps``."""
        return self.slower and not self.stored and not ps

    def rest(self, ps: int) -> bool:
        return not (self.moving or self.stored or ps or self.pp)

    def tick(self, ps=0, *, target=0, brake=False, room=True, ready=True, drop=False):
        """Go on by one clock with its inputs."""
        slower = self.slower
        steady = (self.known and not self.apart
                  and not (self.moving and (brake or self.below)))
        leave = self.credit >= PULSE and self.stored > 0 and ready
        falls = drop or (slower and not self.stored and not ps and not room)
        if self.credit < PULSE or leave:
            self.credit = self.credit % PULSE + self.speed
        lead = 4 * target - self.quarters
        if not self.moving:
            self.base = self.start_rate
        if self.clock == 0:
            if slower:
                self.level -= 1
                self.known = False
            elif self.apart and self.waiting and not self.braked:
                self.level += 1
        elif self.clock == STEP_CLOCKS - 1:
            self.aim = target
            self.below = lead < 0
            self.apart = lead >= self.acceleration
            self.known = True
        self.clock = (self.clock + 1) % STEP_CLOCKS
        self.braked, self.waiting, self.steady = brake, self.stored > 0, steady
        self.stored += ps - leave
        self.pp = int(leave)
        if falls:
            self.base, self.level, self.clock = self.start_rate, 0, 1
            self.known = False
        if drop:
            self.stored = self.pp = 0
