# SPDX-License-Identifier: Apache-2.0
"""Reference model of one axis: the models of its blocks, and its supervision.

A call of ``tick`` is one clock: it takes the inputs of the clock and leaves the registers as they
are in the next.
"""

from dataclasses import dataclass, field

from testbench.models.backlash import Backlash
from testbench.models.coder_gear import CoderGear
from testbench.models.dac import Dac
from testbench.models.drive_lag import DriveLag
from testbench.models.encoder import Encoder
from testbench.models.error_counter import ErrorCounter
from testbench.models.gear import Gear
from testbench.models.supervision import TOLD, Supervision

FULL_SCALE = 32767


@dataclass
class Overshoot:
    """Greatest distance beyond the mark, from positions alone."""

    mark: int = 0
    down: bool = False
    furthest: int = 0

    def set(self, command: int, down: bool) -> None:
        self.mark, self.down, self.furthest = command, down, 0

    def see(self, position: int) -> None:
        beyond = self.mark - position if self.down else position - self.mark
        self.furthest = max(self.furthest, beyond)


@dataclass
class Axis:
    """The registers of an axis; ``rest_clocks`` as in the gateware."""

    rest_clocks: int = 10
    counter: ErrorCounter = field(default_factory=ErrorCounter)
    encoder: Encoder = field(default_factory=Encoder)
    dac: Dac = field(default_factory=Dac)
    gear: Gear = field(default_factory=Gear)
    coder: CoderGear = field(default_factory=CoderGear)
    ratio: tuple[int, int] = (1, 1)     # n and m, as the registers have them
    backlash: Backlash = field(default_factory=Backlash)
    overshoot: Overshoot = field(default_factory=Overshoot)
    supervision: Supervision = field(default_factory=Supervision)
    drive_lag: DriveLag = field(default_factory=DriveLag)
    pulse: int = 0  # of the encoder, not yet with the reversal
    quiet: int | None = None  # clocks since the last Pi
    following_stopped: bool = False
    following_moving: bool = False
    seen: int = 0  # Er, one clock old
    led: int = 0   # feed-forward, one clock old, less the lag of the drive
    told: int = 0  # both together, one clock old
    beside: int = 0  # offset and friction
    less: int = 0  # they and the lag, one clock older
    lead: int = 0  # the feed-forward with those
    sent: int = 0  # to the DAC
    lag: int = 0   # of the drive, one clock old
    share: int = 0  # read at the last tick

    @property
    def resting(self) -> bool:
        return self.quiet is None or self.quiet >= self.rest_clocks

    @property
    def coarse(self) -> bool:
        """Whether a coder is coarser than a pulse."""
        return self.ratio[0] < self.ratio[1]

    def moved(self, *, mode_step: bool, mode_reverse: bool) -> int:
        """Pulse of the drive in the clock to come: -1, 0 or +1."""
        if mode_step or self.coarse:
            return self.gear.pulse if mode_step else self.coder.pulse
        return -self.pulse if mode_reverse else self.pulse

    def feedback(self, *, mode_step: bool, mode_reverse: bool) -> int:
        """FP of the clock to come: -1, 0 or +1."""
        return self.backlash.pulse(self.moved(mode_step=mode_step, mode_reverse=mode_reverse))

    def in_position(self, window: int, size: int = 0, pitch: int = 0) -> bool:
        """Whether the axis is in position, with a backlash of ``size`` and this ``pitch``."""
        goal = self.backlash.goal(size, pitch)
        return abs(self.seen) <= window and self.backlash.taken_up == goal

    def tick(self, *, pi=0, forward=0, ahead=False, a=0, b=0, safe=False, adopt=False, mark=None,
             follow_stopped=1 << 17, follow_moving=1 << 17, mode_step=False,
             mode_reverse=False, times=(2, 2, 2), tick=False, gain=0, window=1, backlash=0,
             pitch=0, gear=None, swap=False, offset=0, friction=0, resting=False,
             share=512) -> None:
        """Go on by one clock.

        ``mark`` is None, or whether the travel at the mark was down. ``gear`` is None, or n and m
        of a gear that begins, and the backlash with it; they are ``ratio`` then.
        """
        moved = self.moved(mode_step=mode_step, mode_reverse=mode_reverse)
        fp = self.feedback(mode_step=mode_step, mode_reverse=mode_reverse)
        adopt = adopt and safe
        lag = self.lag if ahead else 0
        self.lag = self.drive_lag.lag
        beside = offset + friction * self.supervision.direction
        self.supervision.clock(
            tick=tick, gain=gain, er=self.told,
            standing=self.in_position(window, backlash, pitch), resting=resting, fp=moved,
            a=self.encoder.levels[0], b=self.encoder.levels[1],
            coarse=self.coarse and not mode_step, on=not (safe or mode_step),
            clear=adopt)
        self.share = share if tick else self.share
        if self.supervision.since == TOLD + 1:      # it was TOLD in this clock
            self.drive_lag.go(self.supervision.latest, self.share)

        far = abs(self.seen) > (follow_stopped if self.resting else follow_moving)
        self.following_stopped = far and self.resting
        self.following_moving = far and not self.resting
        self.quiet = 0 if pi else None if self.quiet is None else self.quiet + 1

        velocity = max(-FULL_SCALE, min(FULL_SCALE, self.sent))
        self.dac.tick(-velocity if swap else velocity, safe or mode_step)
        width, space, setup = times
        self.gear.tick(self.counter.error, width=width, space=space, setup=setup,
                       safe=safe or not mode_step,
                       clear=gear or (None if mode_step else (self.gear.n, self.gear.m)))
        counts = self.coarse and not mode_step and not gear
        self.coder.tick(-self.pulse if mode_reverse else self.pulse,
                        clear=None if counts else self.ratio, forget=adopt or mode_step)
        self.backlash.tick(size=backlash, pitch=pitch, tick=tick, pi=pi, moved=moved,
                           safe=safe, clear=gear is not None)
        self.pulse, _ = self.encoder.tick(a, b, adopt or mode_step)

        self.seen = self.counter.error
        self.told, self.led = self.seen + self.led, forward - lag
        self.sent, self.lead = self.seen + self.lead, forward + self.less
        self.less, self.beside = self.beside - lag, beside
        self.counter.tick(pi, fp, adopt)
        if mark is not None:
            self.overshoot.set(self.counter.commanded, mark)
        self.overshoot.see(self.counter.moved)
