# SPDX-License-Identifier: Apache-2.0
"""Reference model of arming: by the history of the button, and the clock of the last press."""

from dataclasses import dataclass, field


@dataclass
class Arming:
    """Call ``begin`` with the inputs of a clock, look, then ``end``. Times are in clocks."""

    bounce: int
    closing: int
    strapped: bool = False
    closed_at: int | None = None   # clock in which the contactor was first closed
    clock: int = 0
    level: bool = True             # of the button, debounced: held until it was released
    presses: int = 0
    past: list = field(default_factory=list)
    inputs: tuple = (0, 0, 0)

    def begin(self, arm, safe, disarm):
        self.inputs = arm, safe, disarm

    @property
    def contactor(self):
        return self.closed_at is not None and not self.inputs[1]

    @property
    def armed(self):
        return self.closed_at is not None and self.clock - self.closed_at >= self.closing

    def end(self):
        arm, safe, disarm = self.inputs
        pressed = self.strapped or self.rose
        if safe or disarm:
            self.closed_at = None
        elif self.closed_at is None and pressed:
            self.closed_at = self.clock + 1
            self.presses += 1
        self.rose = False
        self.past = (self.past + [bool(arm)])[-self.bounce:]
        if len(self.past) == self.bounce and set(self.past) == {not self.level}:
            self.level = not self.level
            self.rose = self.level
        self.clock += 1

    rose: bool = False             # a press has lasted long enough in the clock before
