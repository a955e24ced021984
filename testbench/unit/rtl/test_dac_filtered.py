# SPDX-License-Identifier: Apache-2.0
"""Both modulators of ``rtl.motion.dac`` as emitted Verilog, behind the amplifier's low pass.

At a constant magnitude: the mean, which is the linearity, and the ripple behind a first-order low
pass. Its time constant is that of the simulated machines, 0.5 ms, at 50 MHz.
"""

import ctypes

import numpy as np
import pytest

from rtl.motion.dac import Dac
from testbench.native.build import HERE
from testbench.native.component import component_library
from testbench.some import some

FULL, WINDOW = 1 << 15, 1 << 15
FILTER = 25_000         # clocks
SETTLED = 10 * FILTER   # what is left of the start is below a ten-thousandth
PERIOD = 1024           # of the pulse width
MAGNITUDES = (1, 2, 31, 32, 33, 1000, 3277, 5461, 8192, 12_345, 16_383, 16_384, 16_385, 21_845,
              24_576, 29_491, 32_000, 32_766, 32_767)


def pulses(modulator, magnitudes, clocks):
    """Pulses by clock and magnitude, 0 or 1."""
    library = component_library(Dac(modulator), HERE / "dac.cpp")
    rows = np.empty((len(magnitudes), clocks), dtype=np.uint8)
    for row, magnitude in zip(rows, magnitudes, strict=True):
        library.dac_run(ctypes.c_uint64(clocks), ctypes.c_uint32(magnitude),
                        row.ctypes.data_as(ctypes.c_void_p))
    return rows.T


def filtered(rows):
    """Behind the low pass, at the end of every clock of the last window."""
    kept = np.exp(-1 / FILTER)      # of the level, from clock to clock
    before, window = rows[:-WINDOW], rows[-WINDOW:]
    level = (1 - kept) * (kept ** np.arange(len(before))[::-1] @ before)
    clocks = np.arange(WINDOW)[:, np.newaxis]
    within = (1 - kept) * np.cumsum(window * kept ** -clocks, axis=0)
    return kept ** clocks * (kept * level + within)


@pytest.mark.parametrize("modulator", some(["sigma_delta", "pwm"]))
def test_mean_and_ripple_behind_the_low_pass(modulator, rng):
    magnitudes = np.array(sorted({*MAGNITUDES, *(rng.randrange(1, FULL) for _ in range(20))}))
    rows = pulses(modulator, magnitudes, SETTLED + WINDOW)
    counts = rows[-WINDOW:].sum(axis=0, dtype=int)
    levels = filtered(rows)
    ripple, mean = np.ptp(levels, axis=0), levels.mean(axis=0)
    density = magnitudes / FULL
    print(f"{modulator}: greatest ripple {1e4 * ripple.max():.2f} and error of the mean "
          f"{1e4 * abs(mean - density).max():.2f}, in 1/10000 of full scale")
    if modulator == "pwm":
        assert np.array_equal(counts, magnitudes)
        # The triangle of a period; the carried remainder makes it longer by one pulse.
        assert np.all(ripple <= (density * (1 - density) * PERIOD + 2) / FILTER)
        assert ripple.max() > 0.009     # 1 % at half: what one accepts with this modulator
    else:
        assert np.all(abs(counts - magnitudes) <= 3)
        # What was sent differs from what was asked for by -1 to 2 pulses in all.
        assert np.all(ripple <= 6 / FILTER)
    assert np.all(abs(mean - density) <= 3 / FULL)
