# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.pads``: every pin reaches its member, in the clocks stated."""

from types import SimpleNamespace

import pytest
from amaranth.lib import io

from rtl.pads import INPUTS, OUTPUTS, Pads
from testbench.refusal import refuses


def ports(*, inverted=()):
    """Return simulated ports, and the plain ones behind those that are inverted."""
    plain = {name: io.SimulationPort("i" if name in INPUTS else "o", width)
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
    """Before the first clock, whatever the machine says: off, idle, emergency stop."""
    seen, plain = ports(inverted=inverted)
    dut = Pads(seen)

    async def bench(ctx):
        for name, (width, _) in OUTPUTS.items():
            safe = (1 << width) - 1 if name in ("tx", "safe") else 0
            ctx.set(getattr(dut, name), (1 << width) - 1 - safe)
            expected = safe ^ ((1 << width) - 1 if inverted else 0)
            assert ctx.get(plain[name].o) == expected, name
        assert ctx.get(dut.estop)
        assert ctx.get(dut.rx)
        await ctx.tick()

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


def test_refuses_missing_and_wrong_ports():
    seen, _ = ports()
    del seen.fin
    refuses(Pads, r"there is no port 'fin'", seen)
    seen.fin = io.SimulationPort("i", 2)
    refuses(Pads, r"port 'fin' must have 1 pins, not 2", seen)
