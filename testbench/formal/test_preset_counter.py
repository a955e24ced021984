# SPDX-License-Identifier: Apache-2.0
"""Proofs on ``rtl.gap.preset_counter``: every output has its reason, for any settings."""

from amaranth import *
from amaranth.hdl import Assume, Cover
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In

from rtl.gap.discriminator import PulseClass
from rtl.gap.preset_counter import Mode, PresetCounters
from testbench.formal.prover import prove

PERIOD = 6  # clocks at most; the argument does not depend on it
NAMES = ("sample", "kind", "dame", "open", "ok", "mode", "window", "weight", "period", "freeze")
FULL = "dame_full", "open_full", "ok_full"


class PresetContract(wiring.Component):
    """Rules between the clock before (``was``) and this one; only ``period`` is constant."""

    def __init__(self):
        self.dut = PresetCounters()
        super().__init__({name: In(self.dut.signature.members[name].shape) for name in NAMES})

    def elaborate(self, platform):
        m = Module()
        m.submodules.dut = dut = self.dut
        for name in NAMES:
            m.d.comb += getattr(dut, name).eq(getattr(self, name))
        kept = {name: getattr(dut, name) for name in (*NAMES, *FULL)}
        was = Signal(data.StructLayout({name: signal.shape() for name, signal in kept.items()}))
        mode = Signal(Mode)  # of the clock before that
        ready = Signal()
        m.d.sync += [was[name].eq(signal) for name, signal in kept.items()]
        m.d.sync += [mode.eq(was.mode), ready.eq(1)]
        m.d.comb += [
            Assume(~ResetSignal("sync")),
            Assume(self.period <= PERIOD),
            Assume(~ready | (self.period == was.period)),
        ]

        # Outputs: one at a time, with a strobe, not while frozen, for a full counter, 7 first.
        dame = was.sample & ((was.kind == PulseClass.DAME) | (was.kind == PulseClass.SHORT))
        open_ = was.sample & (was.kind == PulseClass.OPEN)
        ok = was.sample & (was.kind == PulseClass.OK)
        ended = was.sample & (was.mode == Mode.TOTAL)  # a window, perhaps
        alone = was.mode == Mode.OK_ALONE
        changed = was.mode != mode
        m.d.comb += [
            Assert(~(dut.up & dut.down)),
            Assert(dut.strobe | ~(dut.up | dut.down)),
            Assert(~self.freeze | ~(dut.up | dut.down | dut.strobe)),
            Assert(~dut.up | was.dame_full | dame | ended | alone),
            Assert(~dut.down | was.open_full | open_ | ended | alone),
            Assert(~dut.up | (was.dame != 0) | alone),
            Assert(~dut.down | (was.open != 0) | alone),
            Assert(~(dut.up | dut.down)
                   | ~(dut.ok_full | dut.dame_full | dut.open_full | changed | was.freeze)),
        ]
        # With 7 alone every strobe moves: UP for a full one.
        with m.If(alone):
            m.d.comb += [
                Assert(~dut.up | was.ok_full | ok),
                Assert(~dut.down | ~was.ok_full),
                Assert(~(dut.up | dut.down) | (was.ok != 0)),
                Assert(~dut.dame_full & ~dut.open_full),
                Assert(~dut.strobe | dut.up | dut.down | (was.ok == 0) | was.freeze | changed),
            ]

        # At most one in a period.
        since = Signal(range(PERIOD + 1), init=PERIOD)
        m.d.sync += since.eq(Mux(dut.strobe, 1, Mux(since == PERIOD, PERIOD, since + 1)))
        m.d.comb += Assert(~dut.strobe | ((self.period != 0) & (since >= self.period)))

        # A counter becomes full by a pulse only, and stops being full for a reason only.
        moved = dut.up | dut.down
        frozen = self.freeze | was.freeze  # an output may be hidden
        for full, before, pulse, preset in (
                (dut.dame_full, was.dame_full, dame, was.dame),
                (dut.open_full, was.open_full, open_, was.open),
                (dut.ok_full & alone, was.ok_full & alone & ~changed, ok, was.ok)):
            with m.If(ready & full & ~before):
                m.d.comb += Assert((pulse | ended) & (preset != 0) & ~was.freeze & ~changed)
            with m.If(ready & before & ~full & ~frozen):
                m.d.comb += Assert(moved | dut.ok_full | (preset == 0) | changed | ended)
        m.d.comb += [
            Assert(~ready | ~dut.ok_full | (was.sample & (was.ok != 0)) | (alone & was.ok_full)),
            Assert(~dut.ok_full | ~(dut.dame_full | dut.open_full)),
        ]

        # OWN_GATE: UP and DOWN leave the other counter what it has, with the pulse of that clock.
        own = ready & (was.mode == Mode.OWN_GATE) & ~changed & ~frozen & ~dut.ok_full
        for way, name, other, pulse, preset in (
                (dut.up, "open", was.open_full, open_, was.open),
                (dut.down, "dame", was.dame_full, dame, was.dame)):
            count = dut.counts[name]
            before = Signal.like(count, name=f"{name}_before")
            m.d.sync += before.eq(count)
            with m.If(own & way & ~other & (preset > before + 1)):
                m.d.comb += Assert(count == before + pulse)

        # Nothing wraps; in a window no class has more pulses than there were.
        for count in dut.counts.values():
            m.d.comb += Assert(count < 255)
            with m.If(was.mode == Mode.TOTAL):
                m.d.comb += Assert(count <= dut.counts["window"])

        again = Signal()  # there was UP
        with m.If(dut.up):
            m.d.sync += again.eq(1)
        m.d.comb += [
            Cover(again & dut.down & (was.mode == mode_) & (was.period == 2)) for mode_ in Mode
        ]
        m.d.comb += [Cover(dut.up & own & (dut.counts["open"] == 2)),
                     Cover(dut.down & own & (dut.counts["dame"] == 2))]
        m.d.comb += [Cover(was.dame_full & was.open_full & dut.ok_full), Cover(dut.up & open_)]
        return m


def test_contract_holds(workdir):
    prove(PresetContract(), workdir, depth=PERIOD + 2)


def test_contract_is_reachable(workdir):
    prove(PresetContract(), workdir, depth=12, mode="cover")
