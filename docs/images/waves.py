# SPDX-License-Identifier: Apache-2.0
"""Draws the gallery from the waveforms of a run.

``make run OPTIONS=--waves``, then
``python docs/images/waves.py build/runs/sink_shallow_deep/waves.fst``.
"""

import sys
from bisect import bisect_right
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pywellen
from matplotlib import pyplot as plt

from testbench.native.signals import NAMES, SCOPE, SIGNALS

HERE = Path(__file__).parent
INK, ACCENT, SOFT = "#1f2933", "#1d5a96", "#7b8794"
SHORT = 22              # number of the retraction that is drawn
CLOCK_NS = 500
STATES = NAMES["state"]
OF_PATH = {f"{signal.scope}.{signal.name}": signal for signal in SIGNALS}


class Waves:
    """Signals of a file, by their names below ``SCOPE``."""

    def __init__(self, path):
        self._file = pywellen.Waveform(path)

    def _rows(self, name, first, last):
        """Clocks and values of some changes."""
        signal, of = self._file[f"{SCOPE}.{name}"].signal, OF_PATH[name]
        rows = np.array([signal[index] for index in range(first, last)], dtype=np.int64)
        clocks, values = rows[:, 0] // CLOCK_NS, rows[:, 1]
        if of.of.signed:
            values = values - ((values >> of.bits - 1) << of.bits)
        return clocks, values

    def begins(self):
        """Clocks in which the state leaves the front: where retractions begin."""
        times, values = self._rows("motion.state", 0,
                                   len(self._file[f"{SCOPE}.motion.state"].signal))
        before = np.r_[0, values[:-1]]
        return times[(before == 0) & ((values == 1) | (values == 2))]

    def window(self, name, begin, end):
        """A signal between two clocks, as steps."""
        signal = self._file[f"{SCOPE}.{name}"].signal
        first, last = (bisect_right(range(len(signal)), clock * CLOCK_NS,
                                    key=lambda index: signal[index][0])
                       for clock in (begin, end))
        times, values = self._rows(name, max(first - 1, 0), last)
        return np.r_[begin, times[1:], end], np.r_[values, values[-1]]


def draw(waves, rows, begin, end, origin, unit, name):
    """One picture: a row for each signal, by time from ``origin`` in ``unit`` (clocks, label)."""
    figure, axes = plt.subplots(len(rows), 1, sharex=True, layout="constrained",
                                figsize=(10, 0.6 + 0.62 * len(rows)))
    for axis, (signal, kind) in zip(axes, rows, strict=True):
        times, values = waves.window(signal, begin, end)
        if kind == "from start":
            values = values - values[0]
        axis.step((times - origin) / unit[0], values, where="post", color=ACCENT, linewidth=1.4)
        axis.set_ylabel(signal.rpartition(".")[2], rotation=0, ha="right", va="center", color=INK,
                        fontsize=9.5)
        axis.tick_params(labelsize=7.5, colors=SOFT)
        axis.axvline(0, color="#c0392b", linewidth=0.8)
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
        if kind == "bit":
            axis.set_ylim(-0.3, 1.3)
            axis.set_yticks([0, 1])
        elif kind == "state":
            axis.set_ylim(-0.5, 6.8)
            axis.set_yticks([])
            for at, value, lasts in zip(times[:-1], values[:-1], np.diff(times), strict=True):
                if lasts < (end - begin) / 40:
                    continue  # no room for its name
                axis.annotate(STATES[int(value)], ((at - origin) / unit[0], value + 0.5),
                              fontsize=8, color=INK, annotation_clip=True)
        else:
            axis.locator_params(axis="y", nbins=3)
        axis.margins(x=0)
    axes[-1].set_xlabel(unit[1], fontsize=9, color=INK)
    figure.savefig(HERE / f"{name}.png", dpi=110)
    plt.close(figure)


def main():
    """Draw them."""
    mpl.rcParams |= {"font.family": "DejaVu Sans"}
    waves = Waves(sys.argv[1])
    start = waves.begins()[SHORT - 1]
    z = "motion.z"
    path = [("motion.Ps", "from start"), ("motion.Pp", "from start"), (f"{z}.Pi", "from start")]
    short = [("gap.Ss", "bit"), ("motion.state", "state")]
    draw(waves, [("machine.gap_mv", ""), *short, *path, (f"{z}.Er", ""), (f"{z}.dac", "bit"),
                 (f"{z}.dac_negative", "bit")],
         start - 1500, start + 500, start, (1, "clocks from the short"), "waves-short")
    draw(waves, [*short, *path, (f"{z}.Er", "")],
         start - 20, start + 80, start, (1, "clocks from the short"), "waves-reaction")
    draw(waves, [*short, ("power.machining", "bit"), *path[1:], (f"{z}.FP", "from start"),
                 (f"{z}.Er", ""), ("machine.speed_z", ""), ("machine.gap_width_nm", "")],
         start - 100_000, start + 850_000, start, (2000, "ms from the short"), "waves-retraction")


if __name__ == "__main__":
    main()
