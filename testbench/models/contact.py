# SPDX-License-Identifier: Apache-2.0
"""Reference model of the contact guard: a look, clock by clock, and its samples."""

from dataclasses import dataclass, field


@dataclass
class ContactGuard:
    """Call ``outputs`` for the levels of a clock, then ``edge`` with its inputs."""

    settle: int
    looking: bool = False
    samples: list = field(default_factory=list)  # of this look, true for shorted
    known: bool = False                          # as many clear ones in a row as were needed
    still: int = 0                               # clocks of this look without motion, so far
    slow: int | None = None                      # clocks since the last fast one, at the last edge
    lag: int = 0                                 # and how long that counts

    def outputs(self, *, off, safe, quiet, fast, reverse, away, shorted):
        """Return ``(look, wait, contact, trip)``."""
        look = self.looking and off and not safe and not quiet
        known = self.known
        contact = (self.looking and off and not quiet and shorted and not reverse
                   and (known or not away))
        lags = fast or (self.slow is not None and self.slow < self.lag)
        return (int(bool(look)), int(bool(off and not away and not known)), int(bool(contact)),
                int(bool(contact and lags)))

    def edge(self, *, off, safe, quiet, wanted, moving, settled, fast, lag_time, sample,
             sample_shorted, clear_needed):
        """Go to the next clock."""
        look = self.looking and off and not safe and not quiet
        if look and sample:
            self.samples.append(bool(sample_shorted))
            recent = self.samples[-max(1, clear_needed):]
            if len(recent) == max(1, clear_needed) and not any(recent):
                self.known = True
        if not look:
            self.samples, self.known = [], False

        active = off and not safe and not quiet
        if active and (wanted or moving):
            self.looking, self.still = True, 0
        elif self.looking:
            self.still += 1
            self.looking = bool(active and not settled and self.still < self.settle)

        if fast:
            self.slow, self.lag = 0, lag_time
        elif self.slow is not None:
            self.slow += 1
