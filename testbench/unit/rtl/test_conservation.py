# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.motion.conservation``.

``testbench.checkers.motion`` asserts that the guard gives no false alarm, on the joined motion
blocks in every test of the retraction.
"""

import pytest

from rtl.motion.conservation import Conservation
from testbench.simulators.benches import settle

WIDTHS = {"command": 32, "position": 32, "stored": 24}


class Path:
    """Pulses under way, as generator, ramp and window would count them."""

    def __init__(self, start):
        self.command = self.position = start
        self.stored = self.ps = self.pp = 0
        self.step = 1

    def clock(self, rng):
        """One clock: a pulse moves the command with ``ps``, and the position after ``pp``."""
        self.position += self.step * self.pp
        self.stored += self.ps
        self.pp = int(self.stored > 0 and rng.random() < 0.3)
        self.stored -= self.pp
        self.ps = int(rng.random() < 0.3)
        self.command += self.step * self.ps
        if not (self.stored or self.ps or self.pp):
            self.step = rng.choice((1, -1))

    def inputs(self):
        values = {name: getattr(self, name) % (1 << bits) for name, bits in WIDTHS.items()}
        return values | {"ps": self.ps, "pp": self.pp, "reverse": self.step < 0}


def put(ctx, dut, values):
    for name, value in values.items():
        signed = name in ("command", "position") and value >> 31
        ctx.set(getattr(dut, name), value - (1 << 32) if signed else value)


@pytest.mark.parametrize("start", [0, (1 << 31) - 20], ids=["0", "at the wrap"])
def test_sees_nothing_while_pulses_are_kept(simulate, rng, start):
    dut, path = Conservation(), Path(start)

    async def run(ctx):
        for _ in range(2000):
            path.clock(rng)
            put(ctx, dut, path.inputs())
            await ctx.tick()
            assert not ctx.get(dut.damaged)

    simulate(dut, run)


@pytest.mark.parametrize("name", WIDTHS)
def test_every_bit_that_turns_over_is_found_in_three_clocks(simulate, rng, name):
    dut, path = Conservation(), Path(1000)

    async def run(ctx):
        for bit in range(WIDTHS[name]):
            for clock in range(12):
                path.clock(rng)
                values = path.inputs()
                values[name] ^= (1 << bit) * (clock >= 6)
                put(ctx, dut, values)
                await settle(ctx)
                assert ctx.get(dut.damaged) == ((clock < 3 and bit > 0) or clock >= 9)
                await ctx.tick()

    simulate(dut, run)


def test_holds_its_peace_while_the_pulses_are_dropped(simulate):
    dut = Conservation()

    async def run(ctx):
        put(ctx, dut, {"command": 9, "drop": 1})
        for _ in range(6):
            await ctx.tick()
            assert not ctx.get(dut.damaged)
        put(ctx, dut, {"command": 0, "drop": 0})
        for _ in range(6):
            await ctx.tick()
            assert not ctx.get(dut.damaged)
        put(ctx, dut, {"command": 9})
        await ctx.tick().repeat(3)
        assert ctx.get(dut.damaged)

    simulate(dut, run)
