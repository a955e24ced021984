# SPDX-License-Identifier: Apache-2.0
"""The firmware knows which moves lead away from the work, and how it reports contact."""

from itertools import count

import pytest

from testbench.firmware import Controller, events
from testbench.programs import punched

CONTACT, TRIP_CONTACT = 6, 14
DATA = "G36 R300 L.5 H600 E60 Q.1"
UNIQUE = count(1)   # pulses, so that no two moves are the same


@pytest.fixture
def wire():
    ready = Controller(jump_axis=15)
    ready.unlock()
    return ready


def slots(machine, delta):
    """Slots that hold a line."""
    words = [machine.slot(number) for number in range(64)]
    return [one for one in words if tuple(one.delta) == delta and not one.arc]


def leads_away(machine, x=0.0, y=0.0, z=0.0):
    """Move by hand; return whether the segment is marked as leading away."""
    odd = next(UNIQUE)
    delta = tuple(round(10_000 * way) + odd * (way > 0) - odd * (way < 0) for way in (x, y, z))
    words = " ".join(f"{letter}{pulses / 10_000:.4f}"
                     for letter, pulses in zip("XYZ", delta, strict=True) if pulses)
    assert machine.line(f"G91 G00 {words}")[-1] == "ok"
    one, = slots(machine, delta)
    return bool(one.away)


def touch(machine, tell, line, moved=500):
    """Move by hand, and touch the work after so many pulses."""
    machine.library.gk_speed(0)
    assert not any("error" in said for said in machine.line(f"G91 G01 {line} F60"))
    assert machine.library.gk_go(moved) == moved
    tell(machine)
    machine.state("halted")
    machine.library.gk_speed(1 << 30)


def cut(machine, *blocks):
    """Machine along some blocks, and end with the discharge off."""
    machine.tape(punched([DATA, "C500", "G91", "M03", *blocks, "M05", "M02"]))
    assert events(machine.lines, "end")


def test_without_a_cut_only_straight_up_is_away(machine):
    for way, away in ((dict(z=1), True), (dict(z=-1), False), (dict(x=1), False),
                      (dict(x=0.1, z=3), False)):
        assert leads_away(machine, **way) == away, way


def test_a_cut_from_before_the_power_went_counts_for_nothing(machine):
    cut(machine, "G01 X1 F60")
    assert leads_away(machine, x=-1)
    anew = Controller()
    anew.unlock()
    assert not leads_away(anew, x=-1)


def test_without_a_cut_nothing_is_away_for_a_wire(wire):
    for way in (dict(x=1), dict(x=-1), dict(y=1), dict(z=1)):
        assert not leads_away(wire, **way), way


@pytest.mark.parametrize(("blocks", "ways"), [
    # Down; straight, and then so that an eighth of the way leads up.
    (["G01 Z-1 F60"], [(0, 0, 2, 1), (0, 0, -2, 0), (5, 0, 5, 1), (5, 0, 0.5, 0), (5, 0, 1, 1),
                       (3, 3, 0.5, 0), (3, 3, 1, 1), (3, 3, 0, 0), (0, 5, -1, 0)]),
    # Aside: back, and still straight up, as a jump goes; but not aslant along the wall.
    (["G01 Z-1 F60", "X2"], [(-2, 0, 0, 1), (2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 2, 1),
                             (0, 1, 2, 0)]),
    (["G01 X1 Y1 F60"], [(-1, 0, 0, 1), (0, -1, 0, 1), (-1, 1, 0, 0), (1, -1.5, 0, 1),
                         (1, -1.2, 0, 0)]),
    # Of an arc it is the last piece: three quarters of a turn end towards +X.
    (["G17 G03 X-0.5 Y-0.5 I-0.5 F60"], [(1, 0, 0, 0), (-1, 0, 0, 1), (-1, 2, 0, 1), (1, 2, 0, 0)]),
])
def test_what_leads_away_from_a_cut(machine, blocks, ways):
    cut(machine, *blocks)
    for x, y, z, away in ways:
        assert leads_away(machine, x, y, z) == away, (x, y, z)


def test_arcs_and_what_is_cut_never_lead_away(machine):
    cut(machine, "G01 Z-1 F60")
    machine.line("G91 G18 G02 X1 Z1 I1 F60")
    arcs = [machine.slot(number) for number in range(64)]
    assert sum(one.arc for one in arcs) > 4
    assert not any(one.away for one in arcs)
    cut(machine, "G01 Z-0.5123 F60", "Z0.5123")
    assert not slots(machine, (0, 0, 5123))[0].away


@pytest.mark.parametrize("tell", [lambda machine: machine.event("halt", CONTACT),
                                  lambda machine: machine.library.gk_trip(TRIP_CONTACT)])
def test_contact_is_told_and_only_the_way_back_leads_away(wire, tell):
    before = len(wire.lines)
    touch(wire, tell, "X1")
    lines = wire.run(400)
    alarm, = events(wire.lines[before:], "alarm")
    assert alarm[1] in ("152", "140")
    assert any("with the discharge off" in line for line in lines)
    assert ("kept" in alarm[2]) == (alarm[1] == "140")
    assert any("locked" in line for line in wire.line("G91 X1"))
    wire.unlock()
    assert not leads_away(wire, x=1)
    assert leads_away(wire, x=-1)
    assert leads_away(wire, x=-1, y=3)
    # The direction of the motion before counts as the way out; neither a contact on the way away
    # nor one before the motion changes this.
    for line, moved in (("X-1.7", 500), ("Y1", 0), ("X1", 0), ("X-0.1 Y-1", 0)):
        touch(wire, tell, line, moved)
        wire.run(400)
        wire.unlock()
        touch(wire, tell, line, 0)
        wire.run(400)
        wire.unlock()
        assert leads_away(wire, x=-1)
        assert not leads_away(wire, x=1)
    touch(wire, tell, "Y1")
    wire.run(400)
    wire.unlock()
    assert leads_away(wire, y=-1)
    assert not leads_away(wire, x=-1)


@pytest.mark.parametrize("place", [4000, 10_000])
def test_alarms_in_a_cut_keep_its_direction(machine, place):
    """In mid-block, and at its end."""
    machine.library.gk_speed(0)
    machine.tape(punched([DATA, "C130", "M03", "G91 G01 Z-1 F60", "X1", "M05", "M02"]),
                 passes=2000)
    machine.library.gk_go(place)
    machine.library.gk_trip(1)
    machine.run(400)
    machine.unlock()
    machine.library.gk_speed(1 << 30)
    assert leads_away(machine, x=4, z=1)
    assert not leads_away(machine, x=-1)


def test_a_line_made_anew_leads_where_it_led(machine):
    """Back over more blocks than the window holds, and forward again."""
    cut(machine, "G01 Z-2 F60")
    machine.tape(punched(["G91", "G00 Z.5001", *["X.001"] * 150, "M02"]))
    assert machine.axes[0] == 1500
    assert not slots(machine, (0, 0, 5001))
    machine.library.gk_speed(0)
    machine.state("retracting")
    for _ in range(12):
        machine.library.gk_go(-200)
        machine.run(400)
    one, = slots(machine, (0, 0, 5001))
    assert one.away


def test_a_stuck_gate_is_named_after_another_cause(machine):
    machine.library.gk_trip(1)
    machine.run(400)
    machine.event("trip", 15)
    lines = machine.run(400)
    assert lines == ["[MSG:interlock: the gap had current or voltage with both sources off; the "
                     "position is kept.]"]
