# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.pads``: every pin reaches its member, in the clocks stated."""

from types import SimpleNamespace

import pytest
from amaranth.lib import io

from constraints.pads import CHAINED
from rtl.pads import INPUTS, OUTPUTS, Pads
from testbench.models.shift_output import ShiftRegisters
from testbench.refusal import refuses
from testbench.simulators.benches import settle


def ports(*, inverted=()):
    """Return simulated ports, and the plain ones behind those that are inverted."""
    plain = {name: io.SimulationPort("i" if name in INPUTS else "o", width, name=name)
             for name, (width, _) in (INPUTS | OUTPUTS).items()}
    seen = {name: ~port if name in inverted else port for name, port in plain.items()}
    return SimpleNamespace(**seen), plain


def pattern(name, width, count):
    """Return a value of a pin that differs from pin to pin and from clock to clock."""
    return hash_of(name) * (2 * count + 1) % 65_521 & (1 << width) - 1


def hash_of(name):
    return sum(ord(letter) * 31 ** index for index, letter in enumerate(name)) % 65_521


def test_inputs_come_after_3_clocks_and_outputs_after_1(simulate):
    seen, plain = ports()
    dut = Pads(seen)

    async def bench(ctx):
        for count in range(40):
            for name, (width, _) in INPUTS.items():
                ctx.set(plain[name].i, pattern(name, width, count))
            for name, (width, _) in OUTPUTS.items():
                ctx.set(getattr(dut, name), pattern(name, width, count))
            await ctx.tick()
            for name, (width, _) in OUTPUTS.items():
                assert ctx.get(plain[name].o) == pattern(name, width, count), name
                assert ctx.get(plain[name].oe) == (1 << width) - 1, name
            if count >= 2:
                for name, (width, _) in INPUTS.items():
                    assert ctx.get(getattr(dut, name)) == pattern(name, width, count - 2), name

    simulate(dut, bench)


@pytest.mark.parametrize("inverted", [(), (*OUTPUTS, *INPUTS)], ids=["plain", "inverted"])
def test_starts_safe(simulate, inverted):
    """Levels before the first clock, for any outputs: off, idle, emergency stop."""
    seen, plain = ports(inverted=inverted)
    dut = Pads(seen)

    async def bench(ctx):
        for name, (width, _) in OUTPUTS.items():
            safe = (1 << width) - 1 if name in ("tx", "safe", "adc_clock") else 0
            ctx.set(getattr(dut, name), (1 << width) - 1 - safe)
            expected = safe ^ ((1 << width) - 1 if inverted else 0)
            await settle(ctx)
            assert ctx.get(plain[name].o) == expected, name
        assert ctx.get(dut.estop)
        assert ctx.get(dut.rx)
        await ctx.tick()

    simulate(dut, bench)


def test_an_optional_input_without_pins_keeps_its_level(simulate):
    seen, plain = ports()
    del seen.enc_index
    dut = Pads(seen)

    async def bench(ctx):
        ctx.set(plain["enc_a"].i, 7)
        await ctx.tick().repeat(5)
        assert ctx.get(dut.enc_a) == 7
        assert ctx.get(dut.enc_index) == 0

    simulate(dut, bench)


def test_inverted_ports_are_inverted(simulate):
    seen, plain = ports(inverted=("estop", "drive_enable"))
    dut = Pads(seen)

    async def bench(ctx):
        ctx.set(dut.drive_enable, 0b101)
        ctx.set(plain["estop"].i, 0)
        await ctx.tick().repeat(3)
        assert ctx.get(plain["drive_enable"].o) == 0b010
        assert ctx.get(dut.estop) == 1
        ctx.set(plain["estop"].i, 1)
        await ctx.tick().repeat(3)
        assert ctx.get(dut.estop) == 0

    simulate(dut, bench)


FRAME = (2 * 24 + 2) * 8  # clocks: 24 bits and the latch, 8 clocks each half


def chained_ports():
    seen, plain = ports()
    for name in CHAINED:
        delattr(seen, name)
    seen.chain = plain["chain"] = io.SimulationPort("o", 3, name="chain")
    return seen, plain


def test_chain_brings_code_and_strobes_and_the_code_first(simulate, rng):
    """Everything arrives within three frames; a code is there for a frame before its strobe."""
    seen, plain = chained_ports()
    dut, chain = Pads(seen), ShiftRegisters(24)
    rose = []

    async def run(ctx, clocks):
        """Run, and note for how many frames the code was constant when a strobe rose."""
        for _ in range(clocks):
            await ctx.tick()
            before = chain.outputs
            levels = ctx.get(plain["chain"].o)
            if chain.see(levels & 1, levels >> 1 & 1, levels >> 2):
                run.stood = run.stood + 1 if chain.outputs & 0xFFFF == before & 0xFFFF else 0
                if chain.outputs >> 16 & ~(before >> 16) & 7:
                    rose.append(run.stood)

    run.stood = 0

    async def bench(ctx):
        await run(ctx, rng.randrange(FRAME))
        for _ in range(15):
            # As ``rtl.auxiliary.functions`` does: the code, a clock later its strobe, and back.
            code, strobe = rng.randrange(1 << 16), 1 << rng.randrange(3)
            supply = rng.randrange(1 << 5)
            ctx.set(dut.auxiliary_code, code)
            ctx.set(dut.gap_supply, supply)
            await run(ctx, 1)
            ctx.set(dut.auxiliary_strobe, strobe)
            await run(ctx, 3 * FRAME)
            assert chain.outputs == supply << 19 | strobe << 16 | code
            ctx.set(dut.auxiliary_strobe, 0)
            await run(ctx, 2 * FRAME + rng.randrange(FRAME))
            assert chain.outputs == supply << 19 | code
        assert len(rose) == 15
        assert min(rose) >= 1

    simulate(dut, bench)


def test_chain_must_have_three_pins():
    seen, _ = chained_ports()
    seen.chain = io.SimulationPort("o", 2)
    refuses(Pads, r"port 'chain' must have 3 pins, not 2", seen)


def test_refuses_missing_and_wrong_ports():
    seen, _ = ports()
    del seen.fin
    refuses(Pads, r"there is no port 'fin'", seen)
    seen.fin = io.SimulationPort("i", 2)
    refuses(Pads, r"port 'fin' must have 1 pins, not 2", seen)
