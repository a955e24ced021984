# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.gap.sampler``: against the exact model, with the converter on delay lines."""

from itertools import pairwise
from types import SimpleNamespace

import pytest
from amaranth.hdl import Fragment, Module
from amaranth.lib import io

from rtl.gap.sampler import Sampler
from rtl.pads import INPUTS, OUTPUTS, Pads
from testbench.models import sampler as model
from testbench.models.converter import Converter
from testbench.refusal import refuses

SLOW, FAST = 2_000_000, 50_000_000
PINS = dict(select=0, clock=1, command=0)  # idle
VOLTAGE, FLUID = 0, 1


class Bench:
    """The front end, its model, and a converter ``delay`` clocks away, there and back.

    ``wire`` gives the received level for the level sent. ``read`` has the converter's measurements,
    as (channel, code).
    """

    def __init__(self, rng, delay=None, wire=lambda level: level, **parameters):
        self.dut = Sampler(**parameters)
        self.model = model.Sampler(**parameters)
        self.delay = self.model.latency if delay is None else delay
        self.wire = wire
        self.line = [PINS] * self.delay
        self.read = []
        self.given = []
        self.rng = rng
        self.converter = Converter(self._read)
        self.clocks = 34 * self.model.half  # of a frame

    def _read(self, channel):
        code = self.rng.choice((0, 4095, self.rng.randrange(4096)))
        self.read.append((channel, code))
        return code

    async def clock(self, ctx):
        dut, expected = self.dut, self.model
        for name, level in expected.pins.items():
            assert ctx.get(getattr(dut, f"adc_{name}")) == level, (name, expected.now)
        self.line.append(expected.pins)
        level = self.wire(self.converter.tick(**self.line.pop(0)))
        ctx.set(dut.adc_data, level)
        expected.clock(level)
        await ctx.tick()
        for name in ("voltage", "voltage_valid", "fluid", "fluid_valid", "fault"):
            assert ctx.get(getattr(dut, name)) == getattr(expected, name), (name, expected.now)
        if ctx.get(dut.voltage_valid):
            self.given.append((VOLTAGE, ctx.get(dut.voltage)))
        if ctx.get(dut.fluid_valid):
            self.given.append((FLUID, ctx.get(dut.fluid)))

    async def frames(self, ctx, count):
        for _ in range(count * self.clocks):
            await self.clock(ctx)


@pytest.mark.parametrize(("clock_hz", "half"), [
    (1, 1), (SLOW, 1), (32_000_000, 1), (32_000_001, 2), (FAST, 2), (64_000_000, 2),
    (64_000_001, 3), (100_000_000, 4),
])
def test_serial_clock_is_as_fast_as_allowed(clock_hz, half):
    dut = Sampler(clock_hz=clock_hz)
    Fragment.get(dut, None)
    assert dut.half == half == model.half_of(clock_hz)


@pytest.mark.parametrize("clock_hz", [SLOW, FAST, 80_000_000])
@pytest.mark.parametrize("latency", [1, 2, 3, 4, 5, 9, 31])
def test_every_sample_arrives_over_the_delay(simulate, rng, clock_hz, latency):
    bench = Bench(rng, clock_hz=clock_hz, latency=latency, every=3)

    async def run(ctx):
        await bench.frames(ctx, 14)

    simulate(bench.dut, run)
    # The first frame's answer belongs to no command; that of the last is still under way.
    assert len(bench.given) in (12, 13)
    assert bench.given == bench.read[1:1 + len(bench.given)]
    assert [channel for channel, _ in bench.given[:6]] == [VOLTAGE, VOLTAGE, FLUID] * 2


@pytest.mark.parametrize("clock_hz", [SLOW, FAST, 80_000_000])
def test_the_window_of_the_delay_is_as_wide_as_promised(simulate, rng, clock_hz):
    half = model.half_of(clock_hz)

    def reads(delay):
        bench = Bench(rng, clock_hz=clock_hz, delay=delay, every=3)

        async def run(ctx):
            await bench.frames(ctx, 14)
            return len(bench.given) > 11 and bench.given == bench.read[1:1 + len(bench.given)]

        (right,) = simulate(bench.dut, run, apart=True)
        return right

    found = [delay for delay in range(12) if reads(delay)]
    assert found == list(range(4 - half + 1, 4 + half + 1))


@pytest.mark.parametrize("clock_hz", [SLOW, FAST])
def test_reads_through_the_pads(simulate, rng, clock_hz):
    """Through real pads (other pads of one bit are used) and a converter without delay."""
    ports = {name: io.SimulationPort("i" if name in INPUTS else "o", width, name=name)
             for name, (width, _) in (INPUTS | OUTPUTS).items()}
    top = Module()
    top.submodules.pads = pads = Pads(SimpleNamespace(**ports))
    bench = Bench(rng, clock_hz=clock_hz, every=3)
    top.submodules.sampler = sampler = bench.dut
    top.d.comb += [
        pads.gap_on.eq(sampler.adc_select),
        pads.tx.eq(sampler.adc_clock),
        pads.gap_sense.eq(sampler.adc_command),
        sampler.adc_data.eq(pads.gap_high),
    ]

    async def run(ctx):
        for _ in range(20 * bench.clocks):
            level = bench.converter.tick(
                select=ctx.get(ports["gap_on"].o), clock=ctx.get(ports["tx"].o),
                command=ctx.get(ports["gap_sense"].o))
            ctx.set(ports["gap_high"].i, level)
            await ctx.tick()
            for channel, valid, code in ((VOLTAGE, sampler.voltage_valid, sampler.voltage),
                                         (FLUID, sampler.fluid_valid, sampler.fluid)):
                if ctx.get(valid):
                    bench.given.append((channel, ctx.get(code)))
        assert not ctx.get(sampler.fault)

    simulate(top, run)
    assert len(bench.given) == 18
    assert bench.given == bench.read[1:19]


def test_fluid_is_read_in_one_frame_of_sixteen(simulate, rng):
    bench = Bench(rng, clock_hz=SLOW)

    async def run(ctx):
        await bench.frames(ctx, 50)

    simulate(bench.dut, run)
    assert [n for n, (channel, _) in enumerate(bench.given) if channel == FLUID] == [15, 31, 47]
    assert len(bench.given) == 48


@pytest.mark.parametrize("clock_hz", [SLOW, FAST])
def test_follows_the_model_on_a_bad_line(simulate, rng, clock_hz):
    bench = Bench(rng, clock_hz=clock_hz, every=3)
    faults = []

    async def run(ctx):
        for turn in range(60):
            wrong = rng.choice((0, 0, 0.001, 0.01, 0.1, 1))
            stuck = (None, None, 0, None, 1)[turn % 5]
            bench.wire = lambda level, wrong=wrong, stuck=stuck: (
                (level ^ (rng.random() < wrong)) if stuck is None else stuck)
            for _ in range(rng.randrange(6) * bench.clocks + rng.randrange(bench.clocks)):
                await bench.clock(ctx)
                faults.append(bench.model.fault)

    simulate(bench.dut, run)
    rises = sum(b > a for a, b in pairwise(faults))
    assert rises > 3
    assert len(bench.given) > 20


@pytest.mark.parametrize(("level", "frames"), [(1, 4), (0, 4 * 16)])
def test_a_stuck_line_is_a_fault_until_both_channels_answer(simulate, rng, level, frames):
    bench = Bench(rng, clock_hz=SLOW)

    async def run(ctx):
        await bench.frames(ctx, 20)
        assert not ctx.get(bench.dut.fault)
        bench.wire = lambda _: level
        clocks = 0
        while not ctx.get(bench.dut.fault):
            await bench.clock(ctx)
            clocks += 1
        assert clocks <= (frames + 1) * bench.clocks
        given = len(bench.given)
        await bench.frames(ctx, 20)
        assert ctx.get(bench.dut.fault)
        assert len(bench.given) == given
        bench.wire = lambda level: level
        good = 0
        while ctx.get(bench.dut.fault):
            await bench.clock(ctx)
            good += 1
        assert good <= 18 * bench.clocks
        assert len(bench.given) == given
        await bench.frames(ctx, 20)
        assert bench.given[given:] == bench.read[-20:][-len(bench.given[given:]):]
        assert len(bench.given) == given + 20

    simulate(bench.dut, run)


@pytest.mark.parametrize("broken", ["select", "clock", "command"])
@pytest.mark.parametrize("level", [0, 1])
def test_every_broken_wire_to_the_converter_is_a_fault(simulate, rng, broken, level):
    bench = Bench(rng, clock_hz=SLOW, every=4)
    tick = bench.converter.tick
    bench.converter.tick = lambda **pins: tick(**pins | {broken: level})

    async def run(ctx):
        await bench.frames(ctx, 4 * 5)
        assert ctx.get(bench.dut.fault)

    simulate(bench.dut, run)


def test_one_channel_wrong_for_long_stays_a_fault(simulate, rng):
    bench = Bench(rng, clock_hz=SLOW, every=2)

    def wire(level):
        frame = (bench.model.now - bench.delay) // bench.clocks
        return 1 if bench.model.asked(frame - 1) == VOLTAGE else level

    async def run(ctx):
        await bench.frames(ctx, 5)
        bench.wire = wire
        await bench.frames(ctx, 9)
        for _ in range(40):
            assert ctx.get(bench.dut.fault)
            await bench.frames(ctx, 1)

    simulate(bench.dut, run)


def test_three_wrong_answers_are_no_fault(simulate, rng):
    bench = Bench(rng, clock_hz=SLOW)

    async def run(ctx):
        await bench.frames(ctx, 2)
        for _ in range(6):  # up to the end of the answer
            await bench.clock(ctx)
        for wrong in (3, 3, 4):
            given = len(bench.given)
            bench.wire = lambda _: 1
            await bench.frames(ctx, wrong)
            bench.wire = lambda level: level
            assert len(bench.given) == given
            assert ctx.get(bench.dut.fault) == (wrong == 4)
            await bench.frames(ctx, 1)
            assert len(bench.given) == given + (wrong < 4)

    simulate(bench.dut, run)


@pytest.mark.parametrize(("parameters", "message"), [
    (dict(clock_hz=0), r"^clock_hz must be at least 1, not 0$"),
    (dict(clock_hz=SLOW, every=1), r"^every must be at least 2, not 1$"),
    (dict(clock_hz=SLOW, latency=0), r"^latency must be 1 to 31, not 0$"),
    (dict(clock_hz=SLOW, latency=32), r"^latency must be 1 to 31, not 32$"),
])
def test_refuses_wrong_parameters(parameters, message):
    refuses(Sampler, message, **parameters)
