# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.power``: pulses and their limits, against the exact models."""

from itertools import groupby, pairwise

import pytest
from amaranth import ClockDomain, Module

from rtl.power.limiter import Limiter
from rtl.power.pulse_generator import PulseGenerator
from testbench.models import pulse_generator as model
from testbench.refusal import refuses
from testbench.simulators.benches import settle

TIMES = dict(on_time=7, off_time=5, off_extra=0, sense_on=3, sense_off=4, wait_time=0)
QUIET = dict(enable=1, sensing=0, level=9, live=0, cut=1, abnormal=0, ignited=0) | TIMES


class Bench:
    """The generator and its model side by side; records the gates."""

    def __init__(self, dut):
        self.dut = dut
        self.model = model.PulseGenerator()
        self.gates = []  # "", "main" or "sense" for each clock

    async def clock(self, ctx, **inputs):
        dut = self.dut
        for name, value in inputs.items():
            ctx.set(getattr(dut, name), value)
        await settle(ctx)
        got = tuple(ctx.get(getattr(dut, name))
                    for name in ("on", "sense", "level_out", "between"))
        assert got == self.model.outputs(enable=inputs["enable"], live=inputs["live"])
        self.gates.append("main" if got[0] else "sense" if got[1] else "")
        self.model.edge(**{name: value for name, value in inputs.items() if name != "enable"},
                        enable=inputs["enable"])
        await ctx.tick()

    @property
    def runs(self):
        """Kinds and lengths of pulses and pauses."""
        return [(kind, len(list(run))) for kind, run in groupby(self.gates)]


def test_follows_the_model(simulate, rng):
    dut = PulseGenerator()
    bench = Bench(dut)

    def times():
        return {name: rng.choice((0, 1, 2, rng.randrange(12))) for name in TIMES}

    async def run(ctx):
        inputs = QUIET | times()
        for _ in range(6000):
            if rng.random() < 0.02:
                inputs |= times()
            inputs |= dict(level=rng.randrange(64), abnormal=rng.random() < 0.2,
                           ignited=rng.random() < 0.2)
            for name, chance in (("enable", 0.03), ("sensing", 0.03), ("cut", 0.05),
                                 ("live", 0.1)):
                if rng.random() < chance:
                    inputs[name] ^= 1
            await bench.clock(ctx, **inputs)

    simulate(dut, run)


def test_times_are_exact(simulate):
    bench = Bench(PulseGenerator())

    async def run(ctx):
        for _ in range(40):
            await bench.clock(ctx, **QUIET)
        for _ in range(40):
            await bench.clock(ctx, **QUIET | dict(sensing=1))

    simulate(bench.dut, run)
    # Out of reset an off-time passes, and one clock to begin it. The 4th pulse was running when
    # sensing rose, and ends in that clock.
    assert bench.runs[:7] == [("", 6), ("main", 7), ("", 5), ("main", 7), ("", 5), ("main", 7),
                              ("", 5)]
    assert bench.runs[7:10] == [("sense", 3), ("", 4), ("sense", 3)]


@pytest.mark.parametrize("sensing", [0, 1])
def test_longest_times(simulate, sensing):
    dut = PulseGenerator()
    longest = dict(on_time=(1 << 20) - 1, off_time=1, sense_on=(1 << 16) - 1, sense_off=1)

    async def run(ctx):
        for name, value in (QUIET | longest | dict(sensing=sensing)).items():
            ctx.set(getattr(dut, name), value)
        gate = dut.sense if sensing else dut.on
        await ctx.tick().until(gate)
        await ctx.tick().repeat(65_533)  # the first clock of the pulse has passed already
        assert ctx.get(gate), "clock 65 535 of the pulse"
        await ctx.tick()
        assert ctx.get(gate) == (not sensing)

    simulate(dut, run)


@pytest.mark.parametrize(("ignition", "length"), [
    (6, 7), (7, 8), (15, 16), (16, 17), (None, 11), (17, 11)])
def test_the_on_time_counts_from_the_ignition(simulate, ignition, length):
    """The gate rises in clock 6, so that the wait of 11 clocks ends with clock 16."""
    bench = Bench(PulseGenerator())

    async def run(ctx):
        for clock in range(40):
            ignited = ignition is not None and clock >= ignition    # it stays
            await bench.clock(ctx, **QUIET | dict(wait_time=11, ignited=ignited))
        assert bench.runs[1] == ("main", length)

    simulate(bench.dut, run)


def test_times_of_the_next_condition_do_not_mix_in(simulate):
    bench = Bench(PulseGenerator())

    async def run(ctx):
        for clock in range(40):
            times = dict(wait_time=9) if clock < 8 else dict(wait_time=0, on_time=15)
            await bench.clock(ctx, **QUIET | times | dict(ignited=clock == 10))
        assert bench.runs[1:4] == [("main", 4 + 7), ("", 5), ("main", 15)]

    simulate(bench.dut, run)


def test_abnormal_pulse_is_cut_in_the_next_clock(simulate):
    bench = Bench(PulseGenerator())

    async def run(ctx):
        for clock in range(60):
            await bench.clock(ctx, **QUIET | dict(abnormal=clock == 8, cut=clock < 30))
        assert bench.runs[1] == ("main", 3), "gates were high in clocks 6, 7 and 8"

    simulate(bench.dut, run)


@pytest.mark.parametrize("cut", [0, 1])
def test_rest_after_an_abnormal_pulse_is_longer(simulate, cut):
    bench = Bench(PulseGenerator())

    async def run(ctx):
        for clock in range(60):
            await bench.clock(ctx, **QUIET | dict(
                cut=cut, off_extra=9, abnormal=clock in ((8,), (8, 12))[not cut]))
        assert bench.runs[1:5] == [("main", 3 if cut else 7), ("", 14), ("main", 7), ("", 5)]

    simulate(bench.dut, run)


def test_a_gap_that_is_live_gets_no_pulse(simulate):
    bench = Bench(PulseGenerator())

    async def run(ctx):
        for clock in range(60):
            await bench.clock(ctx, **QUIET | dict(live=clock in range(6, 25)))
        # It says nothing to the pulse under way, and the off-time counts meanwhile.
        assert bench.runs[:6] == [("", 6), ("main", 7), ("", 13), ("main", 7), ("", 5), ("main", 7)]

    simulate(bench.dut, run)


def test_enable_acts_in_the_same_clock_and_keeps_the_off_time(simulate):
    bench = Bench(PulseGenerator())

    async def run(ctx):
        for clock in range(40):
            await bench.clock(ctx, **QUIET | dict(enable=clock != 8))
        assert bench.runs[:4] == [("", 6), ("main", 2), ("", 6), ("main", 7)]

    simulate(bench.dut, run)


def test_gates_keep_their_distance(simulate, rng):
    """For any inputs: never both gates, and always the off-time of the last pulse's kind."""
    bench = Bench(PulseGenerator())

    async def run(ctx):
        for _ in range(5000):
            await bench.clock(ctx, **QUIET | dict(
                enable=rng.random() < 0.97, sensing=rng.random() < 0.3,
                abnormal=rng.random() < 0.1))
            assert not (ctx.get(bench.dut.on) and ctx.get(bench.dut.sense))

    simulate(bench.dut, run)
    runs = bench.runs[:-1]  # the end of the test cut the last one
    for (kind, length), (rest, pause) in pairwise(runs):
        if kind:
            assert not rest
            assert pause >= (TIMES["off_time"] if kind == "main" else TIMES["sense_off"])
            assert length <= (TIMES["on_time"] if kind == "main" else TIMES["sense_on"])
    assert {kind for kind, _ in runs} == {"", "main", "sense"}


LIMITS = dict(level_max=20, on_max=5000, off_min=50)


def test_limits_follow_the_model(simulate, rng):
    top = Module()
    top.domains.sync = ClockDomain()  # the limiter itself has no clock
    top.submodules.dut = dut = Limiter(**LIMITS)

    def near(limit, bits):
        edges = 0, limit - 1, limit, limit + 1, (1 << bits) - 1
        return rng.choice((*edges, rng.randrange(1 << bits)))

    async def bench(ctx):
        for _ in range(1000):
            asked = dict(level=near(20, 6), on_time=near(5000, 20), off_time=near(50, 20))
            asked["wait_time"] = near(max(5000 - asked["on_time"], 0), 20) % (1 << 20)
            for name, value in asked.items():
                ctx.set(getattr(dut, name), value)
            await settle(ctx)
            got = tuple(ctx.get(getattr(dut, f"allowed_{name}"))
                        for name in ("level", "on", "wait", "off"))
            assert got[1] + got[2] <= 5000
            assert got == model.limit(**asked, **LIMITS)
            await ctx.tick()
        assert (ctx.get(dut.limit_level), ctx.get(dut.limit_off)) == (20, 50)

    simulate(top, bench)


@pytest.mark.parametrize(("wrong", "message"), [
    (dict(level_max=64), r"level_max must be 0 to 63, not 64"),
    (dict(on_max=0),     r"on_max must be 1 to 1048575 clocks, not 0"),
    (dict(off_min=0),    r"off_min must be 1 to 1048575 clocks, not 0"),
])
def test_refuses_wrong_limits(wrong, message):
    refuses(Limiter, message, **LIMITS | wrong)
