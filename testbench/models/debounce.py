# SPDX-License-Identifier: Apache-2.0
"""Reference model of the debouncer: looks back at the last samples."""

from dataclasses import dataclass, field


@dataclass
class Debounce:
    """``steady`` after each call of ``clock`` is the level of the next clock."""

    rise: int
    fall: int
    steady: bool = False
    past: list = field(default_factory=list)

    def clock(self, raw):
        self.past = (self.past + [bool(raw)])[-max(self.rise, self.fall):]
        times = self.fall if self.steady else self.rise
        recent = self.past[-times:]
        if len(recent) == times and all(level != self.steady for level in recent):
            self.steady = not self.steady
