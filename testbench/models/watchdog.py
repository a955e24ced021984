# SPDX-License-Identifier: Apache-2.0
"""Reference model of the watchdog: by the times of the keys."""

from dataclasses import dataclass


@dataclass
class Watchdog:
    """Ask for a clock's outputs, then ``write`` with the key written in it, if any."""

    period: int
    now: int = 0
    called: int | None = None    # time of the last complete call that was not too soon
    begun: int | None = None     # time of a first key that waits for its second
    answered: int | None = None  # time of the last third key that was asked for
    expired_for: int | None = None  # clocks in a row, None before the first that was quiet

    @property
    def late(self):
        return self.called is None or self.now - self.called >= self.period

    @property
    def open(self):
        return self.late or self.now - self.called >= self.period // 4

    @property
    def asked(self):
        return self.answered is None or self.now - self.answered >= self.period // 2

    @property
    def expired(self):
        return self.late or self.answered is None or self.now - self.answered >= self.period

    @property
    def silent(self):
        return self.expired_for is not None and self.expired_for >= self.period

    def write(self, key):
        """Take the key of this clock, or None, and go to the next."""
        late = self.late
        if not self.expired:
            self.expired_for = 0
        elif self.expired_for is not None:
            self.expired_for += 1
        if late and self.begun is not None and self.now - self.begun >= self.period:
            self.begun = None
        if key == 0xC3:
            if self.asked:
                self.answered = self.now
        elif key == 0x5A and self.begun is not None:
            self.called, self.begun = self.now if self.open else None, None
        elif key is not None:
            self.begun = self.now if key == 0xA5 else None
        self.now += 1
        if self.late and not late:
            self.begun = None
