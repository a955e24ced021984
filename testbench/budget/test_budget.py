# SPDX-License-Identifier: Apache-2.0
"""Every block stays within its budget of cells; the processor is third-party and has none.

A budget is the cost of the block when the budget was set. Look-up tables and carries have a tenth
more, since the synthesiser may exchange them. To raise a budget there must be a good reason.
"""

from functools import cache

import pytest
from amaranth.back import rtlil
from amaranth.hdl import Value

from rtl.gap.discriminator import Discriminator
from rtl.gap.preset_counter import PresetCounters
from rtl.motion.servo import Servo
from softcore.build import Cells
from testbench.budget import resources
from testbench.some import some

BUDGETS = {
    "arming":        Cells(lut4=50,   ccu2c=23,  ff=45,   ram=0,  bram=0,  dsp=0),
    "auxiliary":     Cells(lut4=75,   ccu2c=37,  ff=56,   ram=0,  bram=0,  dsp=0),
    "axis_z":        Cells(lut4=954,  ccu2c=508, ff=880,  ram=0,  bram=0,  dsp=0),
    "condition":     Cells(lut4=177,  ccu2c=114, ff=450,  ram=0,  bram=0,  dsp=0),
    "conduction":    Cells(lut4=30,   ccu2c=8,   ff=20,   ram=0,  bram=0,  dsp=0),
    "conservation":  Cells(lut4=42,   ccu2c=51,  ff=93,   ram=0,  bram=0,  dsp=0),
    "contact":       Cells(lut4=66,   ccu2c=61,  ff=63,   ram=0,  bram=0,  dsp=0),
    "counters":      Cells(lut4=78,   ccu2c=64,  ff=64,   ram=0,  bram=0,  dsp=0),
    "discriminator": Cells(lut4=123,  ccu2c=88,  ff=177,  ram=0,  bram=0,  dsp=0),
    "distributor":   Cells(lut4=575,  ccu2c=398, ff=395,  ram=0,  bram=0,  dsp=0),
    "feed":          Cells(lut4=60,   ccu2c=66,  ff=69,   ram=0,  bram=0,  dsp=0),
    "feed_forward":  Cells(lut4=530,  ccu2c=82,  ff=340,  ram=0,  bram=0,  dsp=0),
    "feed_mode":     Cells(lut4=311,  ccu2c=92,  ff=259,  ram=0,  bram=0,  dsp=0),
    "flash":         Cells(lut4=22,   ccu2c=4,   ff=26,   ram=0,  bram=0,  dsp=0),
    "fluid":         Cells(lut4=110,  ccu2c=32,  ff=60,   ram=0,  bram=0,  dsp=0),
    "index":         Cells(lut4=13,   ccu2c=0,   ff=15,   ram=0,  bram=0,  dsp=0),
    "interlock":     Cells(lut4=297,  ccu2c=65,  ff=194,  ram=0,  bram=0,  dsp=0),
    "limits_z":      Cells(lut4=41,   ccu2c=35,  ff=6,    ram=0,  bram=0,  dsp=0),
    "mean_level":    Cells(lut4=34,   ccu2c=59,  ff=79,   ram=0,  bram=0,  dsp=0),
    "memory":        Cells(lut4=460,  ccu2c=0,   ff=145,  ram=0,  bram=95, dsp=0),
    "notice":        Cells(lut4=220,  ccu2c=28,  ff=67,   ram=0,  bram=0,  dsp=0),
    "path":          Cells(lut4=775,  ccu2c=110, ff=758,  ram=0,  bram=2,  dsp=0),
    "power":         Cells(lut4=297,  ccu2c=77,  ff=101,  ram=0,  bram=0,  dsp=0),
    "ramp":          Cells(lut4=210,  ccu2c=133, ff=209,  ram=0,  bram=0,  dsp=0),
    "references":    Cells(lut4=0,    ccu2c=20,  ff=33,   ram=0,  bram=0,  dsp=0),
    "registers":     Cells(lut4=2110, ccu2c=0,   ff=2735, ram=0,  bram=2,  dsp=0),
    "removal":       Cells(lut4=535,  ccu2c=144, ff=277,  ram=0,  bram=0,  dsp=0),
    "report":        Cells(lut4=330,  ccu2c=12,  ff=401,  ram=62, bram=0,  dsp=0),
    "retraction":    Cells(lut4=1372, ccu2c=572, ff=1153, ram=0,  bram=0,  dsp=0),
    "sampler":       Cells(lut4=51,   ccu2c=4,   ff=71,   ram=0,  bram=0,  dsp=0),
    "scope":         Cells(lut4=173,  ccu2c=34,  ff=197,  ram=0,  bram=1,  dsp=0),
    "short":         Cells(lut4=112,  ccu2c=53,  ff=76,   ram=0,  bram=0,  dsp=0),
    "sleep":         Cells(lut4=27,   ccu2c=9,   ff=16,   ram=0,  bram=0,  dsp=0),
    "uart":          Cells(lut4=270,  ccu2c=57,  ff=125,  ram=8,  bram=1,  dsp=0),
    "watchdog":      Cells(lut4=53,   ccu2c=64,  ff=57,   ram=0,  bram=0,  dsp=0),
}


@cache
def netlists():
    return resources.blocks(resources.netlist())


def over(found, budget):
    """Cells above the budget, as text by kind of cell."""
    return {kind: f"{used} of {limit}" for kind, used, limit in
            ((kind, getattr(found, kind), getattr(budget, kind)) for kind in vars(budget))
            if used > limit}


def test_every_block_has_a_budget():
    assert set(netlists()) == set(BUDGETS) | {"cpu"}


@pytest.mark.parametrize("block", some(BUDGETS, "registers", "interlock"))
def test_block_stays_within_its_budget(block):
    found = resources.cells(netlists()[block])
    assert over(found, BUDGETS[block]) == {}
    # A budget far above the need would let anything pass.
    assert found.lut4 >= 0.75 * BUDGETS[block].lut4


def alone(block, without=()):
    """Cells of a block without some of its outputs, and so without the logic for only those."""
    ports = [Value.cast(getattr(block, name)) for name in block.signature.members
             if name not in without]
    return resources.cells(rtlil.convert(block, name="block", ports=ports, emit_src=False))


def test_the_gap_servo_is_small():
    """Discriminator, counters and servo: under 400 LUT4, a carry pair is two.

    That is what the second patent describes: without statistics, and without the classes of a
    capacitor's pulses, which take 24 more.
    """
    others = "open_count", "ok_count", "dame_count", "short_count", "relaxation"
    used = alone(Discriminator(), without=others), alone(PresetCounters()), alone(Servo())
    assert sum(cells.lut4 + 2 * cells.ccu2c for cells in used) < 400


def test_one_cell_too_many_is_found():
    budget = Cells(lut4=1, ccu2c=1, ff=1, ram=0, bram=0, dsp=0)
    assert over(Cells(lut4=1, ccu2c=1, ff=2, ram=0, bram=0, dsp=0), budget) == {"ff": "2 of 1"}
