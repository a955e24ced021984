# SPDX-License-Identifier: Apache-2.0
"""Reference model of the supervision of a coder, in exact integers.

Speeds are in 2**-12 pulse/tick, the misfit in 2**-8 pulse. Divisions round down, and so does the
magnitude of a speed below 0.
"""

from dataclasses import dataclass, field

# Clocks after the tick for: the drive's command, the model's travel, the judgement.
TOLD, WAY, AGED, JUDGED = 17, 18, 19, 21
DAC = 32767
PHASES = frozenset("ab")
# By the numbers of ``rtl.motion.supervision.Check``.
CHECKS = ("none", "model", "silent", "phase a", "phase b", "against", "share", "rate")


def pace(speed: int) -> int:
    """Magnitude of a speed."""
    return speed if speed >= 0 else -speed - 1


@dataclass
class Stretch:
    """What was told and what came since it began."""

    told: int = 0        # travel commanded, 2**-12 pulse
    came: int = 0        # pulses, in the commanded direction
    ticks: int = 0       # from its 16th pulse on, at most 512

    @property
    def pulses(self) -> int:
        return self.told >> 12

    @property
    def over(self) -> bool:
        longest = max(self.pulses, pace(self.came))
        return longest >= 8192 or (self.ticks >= 512 and longest >= 128)

    @property
    def fails(self) -> bool:
        return self.over and (self.came < self.pulses // 8 or self.came // 8 > self.pulses)


@dataclass
class Supervision:
    """Call ``clock`` for every clock; ``check`` is then the finding."""

    allowance: int = 200
    fastest: int = 2458
    check: str = "none"
    total: int = 0       # speed times 128
    lacks: int = 0       # speed commanded less that, when it was commanded; one less below 0
    latest: int = 0      # the speed commanded, as used last; one less below 0
    direction: int = 0   # of the speed in 1 ms, for the friction that is made up for
    misfit: int = 0
    memory: int = 0
    down: bool = False
    stretch: Stretch = field(default_factory=Stretch)
    lasting: bool = False  # for the time of a stretch, not always the same one
    odd: bool = False    # the stretch had an odd number of spans
    fresh: frozenset = PHASES  # phases with an edge since that has changed,
    stale: frozenset = PHASES  # and between the two changes before
    span: int = 64       # commanded pulses within which both phases have edges
    levels: tuple = (0, 0)
    coming: int = 0      # pulses of the tick under way
    came: int = 0
    told: int = 0
    told_down: bool = False
    valid: bool = False
    since: int = 99      # clocks since the tick
    ticks: int = 0
    rate: int = 0

    @property
    def speed(self) -> int:
        return self.total // 128

    def clock(self, *, tick=False, gain=0, er=0, standing=False, resting=False, fp=0, a=0, b=0,
              coarse=False, on=True, clear=False) -> None:
        """Go on by one clock."""
        edges = {name for name, level, before in zip("ab", (a, b), self.levels, strict=True)
                 if level != before}
        idle = not on or self.check != "none"
        self.span = 512 if coarse else 64
        found = self._rated(tick, fp) or self._judged()
        if clear:
            self.check = "none"
        elif found and on and self.check == "none":
            self.check = found
        self._reckon(edges)
        self.levels = a, b

        self.since += 1
        if tick:
            self.since = 1
            self.came, self.coming = self.coming, fp
            size = min(abs(er), DAC)
            size = 0 if standing and size < (64 if resting else 16) else size
            self.told = (gain * size // 256) * (-1 if er < 0 else 1)
            self.told_down = er < 0
        else:
            self.coming = max(-511, min(511, self.coming + fp))
        self.valid = not idle and (self.valid or tick)

    def _rated(self, tick, fp):
        self.ticks += tick
        if not self.valid:
            self.rate = 0
        elif tick and self.ticks % 32 == 0:
            self.rate = abs(fp)
        elif fp and self.rate == self.fastest:
            return "rate"
        else:
            self.rate += abs(fp)
        return None

    def _judged(self):
        if self.since != JUDGED or not self.valid:
            return None
        stretch = self.stretch
        self.misfit += -(self.misfit // 512) + self.speed // 16 - self.came * 256
        self.memory += -(self.memory // 512) + pace(self.speed) // 16
        bad = pace(self.misfit) - self.memory // 2 > self.allowance * 256
        fails = stretch.fails
        self.lasting = self.lasting or stretch.ticks >= 512
        if stretch.over:
            self.stretch = Stretch()
            self.odd = False
        silent = PHASES - self.fresh - self.stale
        within = stretch.pulses % self.span >= self.span // 4
        if not (bad or fails or (self.lasting and within and silent)):
            return None
        if silent:
            both = not self.fresh if within else silent == PHASES
            return "silent" if both else f"phase {min(silent)}"
        if stretch.came < -16 and stretch.pulses >= 16:
            return "against"
        return "share" if fails else "model"

    def _reckon(self, edges):
        fresh = self.fresh
        self.fresh |= edges
        if self.since == TOLD:
            told = self.told if self.valid else self.came << 12
            self.total -= self.speed
            self.latest = told - (self.valid and self.told_down)
            self.lacks = self.latest - self.speed
            self.total += told
        if not self.valid:
            self.misfit = self.memory = 0
            self.stretch = Stretch()
            self.fresh = self.stale = PHASES
            self.odd = self.lasting = False
        if self.since == WAY:
            self._go()
        if self.since == AGED:
            soon = self.speed + self.lacks // 4
            self.direction = (soon > 0) - (soon < -1)
        if self.since == AGED and self.valid:
            if self.stretch.pulses >= 16:
                self.stretch.ticks = min(512, self.stretch.ticks + 1)
            if self.stretch.pulses // self.span % 2 != self.odd:
                self.odd = not self.odd
                self.fresh, self.stale = frozenset(edges), fresh

    def _go(self):
        """Add to the stretch, or begin a new one."""
        speed = self.speed
        if pace(speed) == 0 or (speed < 0) != self.down:
            self.down = speed < 0
            self.stretch = Stretch()
            self.fresh = self.stale = PHASES
            self.odd = self.lasting = False
        elif self.valid:
            self.stretch.told += pace(speed)
            self.stretch.came += -self.came if self.down else self.came
