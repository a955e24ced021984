# SPDX-License-Identifier: Apache-2.0
"""Reference model of the switching of the condition by depth, on positions that never wrap."""

from dataclasses import dataclass, field


@dataclass
class ConditionSwitch:
    """The furthest position is found in the record of all positions.

    Call ``outputs`` for the levels of a clock, then ``edge`` with the inputs of the same clock.
    """

    record: list[int] = field(default_factory=lambda: [0])  # since the restart, up to last clock
    armed: bool = False
    pending: bool = False
    switched: bool = False
    at: int = 0
    count: int = 0

    def outputs(self, *, between):
        """Return ``(take, armed, pending, switched, at, count)``."""
        return (self.pending and bool(between), self.armed, self.pending, self.switched, self.at,
                self.count % 256)

    def edge(self, *, position, depth, arm, disarm, commit, restart, between):
        """Go to the next clock."""
        reached = min(self.record) <= depth
        waits = self.pending or arm or disarm or commit
        self.switched = bool(self.armed and reached and not waits)
        if self.switched:
            self.at = self.record[-1]
            self.count += 1
        if self.switched or commit:
            self.pending = True
        elif between:
            self.pending = False
        self.armed = bool(arm or (self.armed and not (self.switched or disarm or commit)))
        if restart:
            self.record.clear()
        self.record.append(position)
