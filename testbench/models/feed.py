# SPDX-License-Identifier: Apache-2.0
"""Reference model of the path-pulse generator, clock by clock in exact integers."""

from dataclasses import dataclass

PULSE = 1 << 32
SPACING = 4


@dataclass
class Feed:
    """The registers of the generator as they are after so many calls of ``tick``.

    ``command`` and ``bound`` are true integers: whoever compares them with the gateware wraps them.
    """

    command: int = 0
    ps: int = 0
    room: bool = False
    total: int = 0          # phase; a pulse is due from PULSE on
    since: int = SPACING    # clocks since the last pulse was decided

    def tick(self, *, rate=0, go=True, reverse=False, bound=0, pull=False, load=None):
        """Go on by one clock with its inputs."""
        due = self.total >= PULSE
        fire = ((due and go) or pull) and self.room and self.since >= SPACING
        self.since += 1
        self.ps = int(fire)
        self.room = (self.command - bound if reverse else bound - self.command) > 0
        if not go:
            self.total = 0
        elif not due or fire:
            self.total = self.total % PULSE + rate
        if fire:
            self.since = 1
            self.command += -1 if reverse else 1
        if load is not None:
            self.command, self.total, self.ps = load, 0, 0
