# SPDX-License-Identifier: Apache-2.0
"""A tape from one of its blocks (``$FROM``), on the firmware alone."""

import pytest

from testbench.firmware import Controller, events
from testbench.programs import punched

BLOCKS = ("G21 G91 G01 X.1 F600", "Y.1", "Z-.05", "X.1", "M02")     # the first is block 2
NO_AXIS = 15


@pytest.mark.parametrize("jump_axis", [2, NO_AXIS])
def test_a_machine_goes_to_the_block_and_on_with_or_without_a_jump_axis(jump_axis):
    """A wire machine has none: the way is then one straight line."""
    machine = Controller(jump_axis=jump_axis)
    machine.unlock()
    assert machine.line("$FROM=5") == ["ok"]
    lines = machine.tape(punched(list(BLOCKS)), passes=2000)
    assert [event[0] for event in events(lines)][-1] == "pause"
    assert machine.axes == (0, 0, 0)
    machine.send(b"~")
    lines = machine.run(6000)
    assert [event[0] for event in events(lines)][-1] == "end"
    assert machine.axes == (2000, 1000, -500)
