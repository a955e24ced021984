# SPDX-License-Identifier: Apache-2.0
"""Reference model of the watchdog: by the times of the keys."""

from dataclasses import dataclass


@dataclass
class Watchdog:
    """Call ``expired`` for a clock, then ``write`` with the key written in it, if any."""

    period: int
    now: int = 0
    called: int | None = None  # time of the last complete call
    begun: int | None = None   # time of a first key that waits for its second

    @property
    def expired(self):
        return self.called is None or self.now - self.called >= self.period

    def write(self, key):
        """Take the key of this clock, or None, and go to the next."""
        asleep = self.expired
        if asleep and self.begun is not None and self.now - self.begun >= self.period:
            self.begun = None
        if key == 0x5A and self.begun is not None:
            self.called, self.begun = self.now, None
        elif key is not None:
            self.begun = self.now if key == 0xA5 else None
        self.now += 1
        if self.expired and not asleep:
            self.begun = None
