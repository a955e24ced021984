# SPDX-License-Identifier: Apache-2.0
"""The controller after synthesis, of the device's cells, beside the Verilog before it.

``make bench`` runs the motion alone, as one of its figures.
"""

import re
from shutil import copytree

import pytest

from testbench.cosim.netlist import MACHINE, SEEN, compare
from testbench.native import synthesised

PARTS = {
    "controller.motion": {"LUT4": 3500, "TRELLIS_FF": 3000},
    "": {"LUT4": 12_000, "TRELLIS_FF": 9000, "DP16KD": 100, "MULT18X18D": 4},
}


@pytest.mark.soak
@pytest.mark.parametrize("part", PARTS)
def test_the_cells_of_the_device_run_a_tape_like_the_verilog(part):
    """A jump, a short and its retraction, every pin in every clock."""
    found = compare(part)
    few = {kind: found.cells[kind] for kind, least in PARTS[part].items()
           if found.cells[kind] < least}
    assert not few, "another netlist than the one asked for"
    assert found.seen == SEEN
    assert found.clocks > 3_000_000
    assert found.difference is None


@pytest.mark.soak
def test_a_look_up_table_that_is_wrong_is_noticed(tmp_path):
    changed = copytree(synthesised.netlist(MACHINE.clock_hz, "controller.motion"),
                       tmp_path / tmp_path.name)
    text = (changed / "netlist.il").read_text()
    place = re.search(r"cell \\LUT4 \\ramp\S*\n +parameter \\INIT 16'([01]{16})", text)
    begin, end = place.span(1)
    inverted = "".join("10"[int(bit)] for bit in place[1])
    (changed / "netlist.il").write_text(text[:begin] + inverted + text[end:])
    assert compare("controller.motion", changed).difference is not None
