# SPDX-License-Identifier: Apache-2.0
"""The loop of detector, feed calculator and path pulses, with a gap whose Ex follows the stock.

Feed mode ``REMOVAL`` is to keep the removal rate constant. When the stock becomes r times as thick,
the feed becomes 1/r within two unit distances. Constant feed lets the removal rate rise r times.
"""

import pytest
from amaranth import *

from rtl.gap.feed_mode import FeedCalculator, FeedMode
from rtl.gap.removal import RemovalDetector
from rtl.motion.feed import PathPulseGenerator
from testbench.some import some

NO_LOAD = 3200          # codes of the converter
STOCK_DROP = 400        # drop of this voltage by the nominal stock
SAMPLE = 17             # clocks between samples
UNIT = 40               # path pulses
RATE = 1 << 26          # a pulse in 64 clocks
STEP_AT = 130           # pulses: in the fourth unit distance


class Loop(Elaboratable):
    """Everything between the sample of the gap voltage and the path pulse."""

    def __init__(self):
        self.removal = RemovalDetector()
        self.calculator = FeedCalculator()
        self.path = PathPulseGenerator()

    def elaborate(self, platform):
        m = Module()
        m.submodules.removal, m.submodules.calculator, m.submodules.path = (
            self.removal, self.calculator, self.path)
        m.d.comb += [
            self.calculator.ratio.eq(self.removal.ratio),
            self.calculator.mean.eq(self.removal.mean),
            self.calculator.known.eq(self.removal.known),
            self.path.rate.eq(self.calculator.feed),
            self.removal.pulse.eq(self.path.ps),
        ]
        return m


def feeds_along(simulate, mode, r, *, unit=UNIT, pulsed=False):
    """Feed over the nominal feed at each path pulse; from STEP_AT on the stock is r times."""
    dut = Loop()
    found = []

    async def run(ctx):
        for signal, value in (
                (dut.removal.on, 1), (dut.removal.unit, unit), (dut.removal.no_load, 16 * NO_LOAD),
                (dut.removal.reference, 16 * STOCK_DROP), (dut.removal.least, 16),
                (dut.removal.ratio_min, 256), (dut.removal.ratio_max, 65535),
                (dut.calculator.mode, mode), (dut.calculator.rate, RATE),
                (dut.calculator.highest, 1 << 29),
                (dut.path.bound, STEP_AT + 5 * unit), (dut.path.go, 1)):
            ctx.set(signal, value)
        clock = 0
        while len(found) < STEP_AT + 5 * unit:
            stock = 1 if len(found) < STEP_AT else r
            code = NO_LOAD - STOCK_DROP * stock
            if pulsed:  # on for five samples of six, and the same mean
                code = 0 if clock // SAMPLE % 6 == 0 else code * 6 / 5
            ctx.set(dut.removal.sample, round(code))
            ctx.set(dut.removal.sample_valid, clock % SAMPLE == 0)
            await ctx.tick()
            clock += 1
            if ctx.get(dut.path.ps):
                found.append(ctx.get(dut.calculator.feed) / RATE)

    simulate(dut, run, deadline=1e-2)
    return found


@pytest.mark.parametrize("unit", some([20, 40]))
@pytest.mark.parametrize("r", some([0.25, 0.5, 1, 2, 4], 0.25, 4))
def test_a_step_of_the_stock_is_followed_within_two_unit_distances(simulate, r, unit):
    feeds = feeds_along(simulate, FeedMode.REMOVAL, r, unit=unit)
    assert feeds[:STEP_AT] == pytest.approx([1] * STEP_AT, rel=1 / 4096)
    after = feeds[STEP_AT + 2 * unit:]
    assert after == pytest.approx([1 / r] * len(after), rel=1 / 1000)
    # In between it lies between the two.
    between = feeds[STEP_AT:STEP_AT + 2 * unit]
    assert min(1, 1 / r) * 0.999 <= min(between) <= max(between) <= max(1, 1 / r) * 1.001


@pytest.mark.parametrize("r", some([0.5, 2]))
def test_constant_feed_keeps_the_step(simulate, r):
    feeds = feeds_along(simulate, FeedMode.CONSTANT, r)
    assert set(feeds) == {1}, "so stock times feed has changed r times"


@pytest.mark.parametrize("r", some([1.5, 3]))
def test_of_a_pulsed_voltage_the_mean_counts(simulate, r):
    feeds = feeds_along(simulate, FeedMode.REMOVAL, r, pulsed=True)
    after = feeds[STEP_AT + 2 * UNIT:]
    # A window has UNIT * 64 * r / SAMPLE samples; a period that is not whole can be off by one.
    mean = NO_LOAD - STOCK_DROP * r
    error = mean / (UNIT * 64 * r / SAMPLE) / (STOCK_DROP * r)
    assert error < 0.15
    assert after == pytest.approx([1 / r] * len(after), rel=error / (1 - error))
