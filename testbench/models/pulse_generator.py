# SPDX-License-Identifier: Apache-2.0
"""Reference model of the discharge pulse generator and of the limits before it."""

from dataclasses import dataclass


@dataclass
class PulseGenerator:
    """Pulses by their times: which kind runs, for how long, and the pause still due.

    Call ``outputs`` for the levels of a clock, then ``edge`` with the inputs of the same clock.
    ``running`` is ``""``, ``"main"`` or ``"sense"``; ``last`` is the kind of the last pulse.
    """

    running: str = ""
    last: str = "main"
    clocks: int = 0  # still to come of the pulse, or of the pause
    level: int = 0
    fresh: bool = True
    burn: int = 0    # clocks from the ignition on; 0 if none is waited for

    def outputs(self, *, enable, live=0):
        """Return ``(on, sense, level_out, between)``."""
        on, sense = (int(bool(enable) and self.running == kind) for kind in ("main", "sense"))
        begins = enable and not self.fresh and self.clocks <= 1 and not live
        return on, sense, self.level if on else 0, int(not self.running and not begins)

    def edge(self, *, enable, sensing, on_time, off_time, off_extra, sense_on, sense_off, level,
             cut, abnormal, live=0, wait_time=0, ignited=0):
        """Go to the next clock."""
        if self.running == "main" and self.burn and ignited:
            self.clocks, self.burn = self.burn, 0
        self.clocks -= 1
        poor = self.running == "main" and abnormal
        reduced = self.running == "main" and (sensing or (cut and abnormal))
        over = self.running and (self.clocks <= 0 or reduced)
        if self.fresh or not enable or over:
            self.fresh, self.running, self.burn = False, "", 0
            rest = off_time if self.last == "main" else sense_off
            self.clocks = max(1, rest + (off_extra if poor and enable else 0))
        elif not self.running and self.clocks <= 0 and not live:
            self.running = self.last = "sense" if sensing else "main"
            self.burn = max(1, on_time) if wait_time and not sensing else 0
            self.clocks = max(1, sense_on if sensing else wait_time or on_time)
            self.level = level


def limit(*, level, on_time, off_time, level_max, on_max, off_min, wait_time=0):
    """Return level, on-time, wait and off-time, limited."""
    burn = min(on_time, on_max)
    return min(level, level_max), burn, min(wait_time, on_max - burn), max(off_time, off_min)
