# SPDX-License-Identifier: Apache-2.0
"""Reference model of the removal detector: from whole windows to Ex and Es/Ex."""

from dataclasses import dataclass, field

UNITY = 4096            # the ratio 1
MOST = 2**20 - 1        # samples of a window
FARTHEST = 2**48 - 1    # way with discharge, 2**-32 pulses
MEAN, DROP, RATIO = 37, 38, 75  # clocks from the end of a window to these results


@dataclass(frozen=True)
class Settings:
    """Distances in path pulses, times in clocks, levels in 2**-16 of full scale, ratios 1/4096."""

    unit: int = 20
    window: int = 0
    no_load: int = 40000
    reference: int = 8000
    least: int = 400
    ratio_min: int = 1024
    ratio_max: int = 16384
    shares: bool = False    # Ex by discharges
    share: int = 600        # Es of that, 2**-16
    rate: int = 4_000_000   # F, 2**-32 pulse/clock


def mean_of(samples: list) -> int:
    """Mean of the converter's codes, as a level."""
    return 16 * sum(samples) // len(samples)


def drop_of(mean: int, no_load: int, least: int) -> int:
    """Ex of a mean."""
    return max(no_load - mean, least)


def share_of(way: int, pulses: int, least: int) -> int:
    """Ex by discharges: way with discharge (2**-32 pulses) over way, 2**-16."""
    return max(min((way >> 16) // max(pulses, 1), 0xFFFF), least)


def ratio_of(drop: int, reference: int, lowest: int, highest: int) -> int:
    """Es over Ex, within the bounds; the upper one has priority."""
    if not drop:
        return highest
    return min(max(reference * UNITY // drop, lowest), highest)


@dataclass
class RemovalDetector:
    """Outputs in this clock, after calls of ``clock`` for those before."""

    mean: int = 0
    drop: int = 0
    ratio: int = UNITY
    known: bool = False
    windows: int = 0
    samples: list = field(default_factory=list)     # of the window under way
    pulses: int = 0
    clocks: int = 0
    way: int = 0                                    # with discharge, 2**-32 pulses
    shares: bool = False                            # in the last clock
    closed: list | None = None                      # samples of the one being computed
    closed_way: tuple[int, int] | None = None       # its way and pulses, if Ex is by discharges
    since: int = 0                                  # clocks since its end
    no_load: int = 0                                # as read for it
    reference: int = 0

    def clock(self, *, sample, pulse, on, discard, hold, settings, burning=False):
        """Take the inputs of one clock, ``sample`` None for none."""
        changed, self.shares = settings.shares != self.shares, settings.shares
        runs = on and not (discard or hold)
        discard = discard or changed
        ended = self._ends(settings) and self.closed is None and on and not (discard or hold)
        if self.closed is not None:
            self._reckon(settings)
        if not on:
            self.closed, self.known, self.ratio = None, False, UNITY
        if not on or discard or ended:
            if ended:
                self.closed, self.since = self.samples, 0
                self.closed_way = (self.way, self.pulses) if settings.shares else None
            self.samples, self.pulses, self.clocks, self.way = [], 0, 0, 0
        if runs and not discard:
            if settings.shares:
                self.way = min(self.way + (settings.rate if burning else 0), FARTHEST)
            elif sample is not None and len(self.samples) < MOST:
                self.samples.append(sample)
            self.pulses += pulse
            self.clocks += 1

    def _ends(self, settings):
        return (bool(self.samples) or settings.shares) and (0 < settings.unit <= self.pulses
                                       or 0 < settings.window <= self.clocks
                                       or len(self.samples) == MOST)

    def _reckon(self, settings):
        self.since += 1
        if self.since == MEAN:
            if self.closed_way is None:
                self.mean = mean_of(self.closed)
            self.known = True
            self.no_load = settings.no_load
        elif self.since == DROP:
            if self.closed_way is None:
                self.drop = drop_of(self.mean, self.no_load, settings.least)
                self.reference = settings.reference
            else:
                self.drop = share_of(*self.closed_way, settings.least)
                self.reference = settings.share
        elif self.since == RATIO:
            self.ratio = ratio_of(self.drop, self.reference, settings.ratio_min,
                                  settings.ratio_max)
            self.windows = (self.windows + 1) % 256
            self.closed = None
