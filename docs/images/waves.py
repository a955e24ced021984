# SPDX-License-Identifier: Apache-2.0
"""Draws the gallery from the waveforms of a run.

``make run OPTIONS=--waves``, then
``python docs/images/waves.py build/runs/sink_shallow_deep/waves.fst``.
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pylibfst
from matplotlib import pyplot as plt

HERE = Path(__file__).parent
INK, ACCENT, SOFT = "#1f2933", "#1d5a96", "#7b8794"
SHORT = 22              # number of the retraction that is drawn
CLOCK_NS = 500
STATES = {0: "front", 1: "stopping", 2: "retracting", 3: "at the limit", 4: "high", 5: "low",
          6: "halted"}


def read(path):
    """Changes of every signal: name to two arrays, times in clocks and values."""
    lib, ffi = pylibfst.lib, pylibfst.ffi
    reader = lib.fstReaderOpen(str(path).encode())
    _, signals = pylibfst.get_scopes_signals2(reader)
    names = {signal.handle: name.split(".")[1] for name, signal in signals.by_name.items()}
    widths = {signal.handle: signal.length for signal in signals.by_name.values()}
    found = {handle: ([], []) for handle in names}

    def changed(_, time, handle, value):
        bits = ffi.string(value).decode()
        if set(bits) <= {"0", "1"}:
            number = int(bits, 2)
            if widths[handle] > 8 and bits[0] == "1":
                number -= 1 << len(bits)
            found[handle][0].append(time // CLOCK_NS)
            found[handle][1].append(number)

    lib.fstReaderSetFacProcessMaskAll(reader)
    pylibfst.fstReaderIterBlocks(reader, changed)
    lib.fstReaderClose(reader)
    return {names[handle]: (np.array(times), np.array(values))
            for handle, (times, values) in found.items()}


def begins(waves):
    """Clocks in which Ss rises at the front: where retractions begin."""
    times, values = waves["state"]
    before = np.r_[0, values[:-1]]
    return times[(before == 0) & ((values == 1) | (values == 2))]


def window(wave, begin, end):
    """A signal between two clocks, as steps."""
    times, values = wave
    first = max(np.searchsorted(times, begin, "right") - 1, 0)
    last = np.searchsorted(times, end, "right")
    return (np.r_[begin, times[first + 1:last], end],
            np.r_[values[first:last], values[last - 1]])


def draw(waves, rows, begin, end, origin, unit, name):
    """One picture: a row for each signal, by time from ``origin`` in ``unit`` (clocks, label)."""
    figure, axes = plt.subplots(len(rows), 1, sharex=True, layout="constrained",
                                figsize=(10, 0.6 + 0.62 * len(rows)))
    for axis, (signal, kind) in zip(axes, rows, strict=True):
        times, values = window(waves[signal], begin, end)
        if kind == "from start":
            values = values - values[0]
        axis.step((times - origin) / unit[0], values, where="post", color=ACCENT, linewidth=1.4)
        axis.set_ylabel(signal, rotation=0, ha="right", va="center", color=INK, fontsize=9.5)
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
    waves = read(Path(sys.argv[1]))
    start = begins(waves)[SHORT - 1]
    draw(waves, [("gap_mv", ""), ("Ss", "bit"), ("state", "state"), ("Ps", "from start"),
                 ("Pp", "from start"), ("Pi", "from start"), ("Er", ""), ("DAC", "")],
         start - 1500, start + 500, start, (1, "clocks from the short"), "waves-short")
    draw(waves, [("Ss", "bit"), ("state", "state"), ("Ps", "from start"), ("Pp", "from start"),
                 ("Pi", "from start"), ("Er", "")],
         start - 20, start + 80, start, (1, "clocks from the short"), "waves-reaction")
    draw(waves, [("Ss", "bit"), ("state", "state"), ("machining", "bit"), ("Pp", "from start"),
                 ("Pi", "from start"), ("FP", "from start"), ("Er", ""), ("speed", ""),
                 ("gap_width_nm", "")],
         start - 100_000, start + 850_000, start, (2000, "ms from the short"), "waves-retraction")


if __name__ == "__main__":
    main()
