# SPDX-License-Identifier: Apache-2.0
"""Reference model of the way by which a drive is behind, in exact integers."""

from dataclasses import dataclass


@dataclass
class DriveLag:
    """Call ``go`` for every tick; ``lag`` is in whole pulses."""

    way: int = 0    # 2**-12 pulse

    def go(self, told: int, share: int) -> None:
        """Go on by a tick with a speed commanded, in 2**-12 pulse/tick."""
        self.way += told - (self.way * share >> 16)

    @property
    def lag(self) -> int:
        return (self.way >> 12) + (self.way < 0)
