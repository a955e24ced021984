# SPDX-License-Identifier: Apache-2.0
"""Both simulators show a bench the same, value by value."""

import pytest
from amaranth.hdl import Cat, Fragment, Module, Mux, Signal, signed
from amaranth.lib import data, enum, memory, wiring
from amaranth.lib.wiring import In, Out

from testbench.simulators.benches import settle
from testbench.simulators.choice import in_amaranth
from testbench.simulators.emitted import emit
from testbench.simulators.isolated import Simulator, isolated
from testbench.some import some


class Kind(enum.Enum, shape=2):
    """Values of an enumeration."""

    NONE = 0
    SOME = 2


class Pair(data.Struct):
    """A number and a flag."""

    number: signed(5)
    flag: 1


class Part(wiring.Component):
    """A sum of signed numbers, wider than a machine word, in a block below the top."""

    by: In(signed(40))
    hold: In(1)
    total: Out(signed(70))

    def elaborate(self, platform):
        m = Module()
        with m.If(~self.hold):
            m.d.sync += self.total.eq(self.total + self.by)
        return m


class Mixture(wiring.Component):
    """Every form of value that benches use."""

    by: In(signed(40), init=-3)
    write: In(1)
    address: In(3)
    pair: In(Pair)
    seen: Out(Pair)
    kind: Out(Kind)
    word: Out(36)

    def __init__(self):
        super().__init__()
        self.part = Part()
        self.memory = memory.Memory(shape=36, depth=8, init=[1 << 35 | place for place in range(8)])
        self.clash = Signal(4)      # two signals of one name, in two blocks
        self.unused = Signal(6, init=5)

    def elaborate(self, platform):
        m = Module()
        m.submodules.part = self.part
        m.submodules.memory = self.memory
        total = Signal(4, name="clash")
        read, write = self.memory.read_port(domain="comb"), self.memory.write_port()
        m.d.comb += [
            self.part.by.eq(self.by), read.addr.eq(self.address), self.word.eq(read.data),
            write.addr.eq(self.address), write.data.eq(self.part.total[:36]),
            write.en.eq(self.write), self.kind.eq(Mux(self.pair.flag, Kind.SOME, Kind.NONE))]
        m.d.sync += [self.seen.number.eq(self.pair.number - 1), self.seen.flag.eq(self.pair.flag),
                     total.eq(self.part.total), self.clash.eq(total + 1)]
        return m


def benches(dut, rng):
    """Two benches, of which the second sees what the first has just set; both tell what they see.

    Everything that a bench can ask for is asked for.
    """
    shared = []

    async def first(ctx):
        said = [ctx.get(dut.by), ctx.get(dut.unused), ctx.get(dut.kind)]
        ctx.set(dut.unused, 70)
        await settle(ctx)
        said.append(ctx.get(dut.unused))
        for clock in range(60):
            ctx.set(dut.by, rng.randrange(-1 << 39, 1 << 39))
            ctx.set(dut.pair.number, rng.randrange(-16, 16))
            ctx.set(dut.pair.flag, rng.randrange(2))
            ctx.set(dut.address[0:2], rng.randrange(4))
            ctx.set(dut.write, rng.randrange(2))
            if clock % 7 == 0:
                ctx.set(dut.part.total, rng.randrange(-1 << 69, 1 << 69))   # a register below
            if clock % 11 == 0:
                ctx.set(dut.memory.data[clock % 8], rng.getrandbits(36))
            if clock % 5 == 0:
                ctx.set(Cat(dut.write, dut.address), rng.getrandbits(4))
            await settle(ctx)
            said += [ctx.get(value) for value in (
                dut.word, dut.pair.number, dut.kind, dut.part.total + dut.by,
                dut.memory.data[clock % 8], dut.by[30:40])]
            _, _, total, kind = await ctx.tick().sample(dut.part.total, dut.kind)
            seen = ctx.get(dut.seen)
            said += [total, kind, seen.number, seen.flag, ctx.get(dut.part.total),
                     ctx.get(dut.clash), list(shared)]
        said.append(await ctx.tick().sample(dut.clash, dut.kind).repeat(3))
        ctx.set(dut.part.hold, 1)
        ctx.set(dut.pair.number, 0)
        await ctx.tick().repeat(2)
        ctx.set(dut.pair.number, 4)     # seen is -1, and 3 in the clock after the next
        said.append(await ctx.tick().sample(dut.part.total).until(dut.seen.number == 3))
        return said

    async def second(ctx):
        said = []
        for _ in range(50):
            await ctx.tick()
            shared[:] = [ctx.get(dut.pair.number), ctx.get(dut.word)]
            said.append(tuple(shared))
        return said

    return first, second


def test_what_benches_see_is_the_same(workdir, request):
    import random

    def seen(run):
        dut = Mixture()
        return run(Fragment.get(dut, None), benches(dut, random.Random(request.node.name)))

    own = Simulator(workdir, seed=1, waves=False)
    in_one = seen(lambda dut, both: in_amaranth(dut, both, deadline=1e-3, waves=None))
    in_other = isolated(
        lambda: seen(lambda dut, both: own.run(emit(dut), both, 1e-3)), own)
    assert len(in_one[0]) > 700
    for one, other in zip(in_one, in_other, strict=True):
        assert one == other


@pytest.mark.parametrize("sim", some(["amaranth", "cocotb"]))
def test_waves_are_written(workdir, sim):
    waves = workdir / "waves.vcd"
    waves.unlink(missing_ok=True)

    def test(run):
        dut = Part()

        async def bench(ctx):
            ctx.set(dut.by, 1)
            await ctx.tick().repeat(5)

        run(Fragment.get(dut, None), bench)

    if sim == "amaranth":
        test(lambda dut, bench: in_amaranth(dut, (bench,), deadline=1e-3, waves=waves))
    else:
        own = Simulator(workdir, seed=1, waves=True)
        isolated(lambda: test(lambda dut, bench: own.run(emit(dut), (bench,), 1e-3)), own)
    text = waves.read_text()
    assert " total " in text
    assert text.count("\n#") >= 5, "a time for every clock"
