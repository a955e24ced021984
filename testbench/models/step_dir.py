# SPDX-License-Identifier: Apache-2.0
"""Reference model of the step/direction output, as a list of phases with their lengths."""

from dataclasses import dataclass


@dataclass
class StepDir:
    """The phase in which the output is, and how many more clocks it lasts."""

    step: int = 0
    dir: int = 0
    taken: int = 0
    left: int = 0  # clocks, after this one, for which nothing may change

    def tick(self, queue: int, *, width: int, space: int, setup: int, safe: bool = False) -> None:
        """Go on by one clock, in which ``queue`` steps (signed) are waiting."""
        began = self.taken = 0
        if safe:
            self.step, began = 0, space
        elif self.left:
            self.left -= 1
            return
        elif self.step:
            self.step, began = 0, space
        elif queue:
            down = int(queue < 0)
            if self.dir == down:
                self.step = self.taken = 1
                began = width
            else:
                self.dir, began = down, setup
        self.left = max(began, 1) - 1
