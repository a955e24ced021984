# SPDX-License-Identifier: Apache-2.0
"""Reference model of one axis: the models of its blocks, and its supervision.

A call of ``tick`` is one clock: it takes the inputs of the clock and leaves the registers as they
are in the next.
"""

from dataclasses import dataclass, field

from testbench.models.dac import Dac
from testbench.models.encoder import Encoder
from testbench.models.error_counter import ErrorCounter
from testbench.models.step_dir import StepDir
from testbench.models.supervision import Supervision

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
    step_dir: StepDir = field(default_factory=StepDir)
    overshoot: Overshoot = field(default_factory=Overshoot)
    supervision: Supervision = field(default_factory=Supervision)
    pulse: int = 0  # of the encoder, not yet with the reversal
    quiet: int | None = None  # clocks since the last Pi
    following_stopped: bool = False
    following_moving: bool = False
    seen: int = 0  # Er, one clock old
    told: int = 0  # ... with the feed-forward of that clock

    @property
    def resting(self) -> bool:
        return self.quiet is None or self.quiet >= self.rest_clocks

    def feedback(self, *, mode_step: bool, mode_reverse: bool) -> int:
        """FP of the clock to come: -1, 0 or +1."""
        if mode_step:
            return (-1 if self.step_dir.dir else 1) * self.step_dir.taken
        return -self.pulse if mode_reverse else self.pulse

    def tick(self, *, pi=0, forward=0, a=0, b=0, safe=False, adopt=False, mark=None,
             follow_stopped=1 << 17, follow_moving=1 << 17, mode_step=False,
             mode_reverse=False, times=(2, 2, 2), tick=False, gain=0, window=1) -> None:
        """Go on by one clock; ``mark`` is None, or whether the travel at the mark was down."""
        fp = self.feedback(mode_step=mode_step, mode_reverse=mode_reverse)
        adopt = adopt and safe
        self.supervision.clock(
            tick=tick, gain=gain, er=self.told,
            standing=abs(self.seen) <= window, fp=fp,
            a=self.encoder.levels[0], b=self.encoder.levels[1], on=not (safe or mode_step),
            clear=adopt)

        far = abs(self.seen) > (follow_stopped if self.resting else follow_moving)
        self.following_stopped = far and self.resting
        self.following_moving = far and not self.resting
        self.quiet = 0 if pi else None if self.quiet is None else self.quiet + 1

        velocity = max(-FULL_SCALE, min(FULL_SCALE, self.told))
        self.dac.tick(velocity, safe or mode_step)
        width, space, setup = times
        self.step_dir.tick(self.counter.error, width=width, space=space, setup=setup,
                           safe=safe or not mode_step)
        self.pulse, _ = self.encoder.tick(a, b, adopt or mode_step)

        self.seen = self.counter.error
        self.told = self.seen + forward
        self.counter.tick(pi, fp, adopt)
        if mark is not None:
            self.overshoot.set(self.counter.commanded, mark)
        self.overshoot.see(self.counter.moved)
