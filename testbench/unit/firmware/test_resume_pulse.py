# SPDX-License-Identifier: Apache-2.0
"""A tape goes on at the pulse at which an alarm that kept the position has left it."""

import math
from itertools import pairwise

import pytest

from softcore.tables.causes import numbers
from softcore.tables.faults import named
from softcore.tables.settings import assign
from testbench.firmware import Controller, events
from testbench.programs import punched
from testbench.unit.firmware.test_bookmark import Homed, told

MM = 10_000
ESTOP = numbers()["estop"]
# Block 4 is the one that is interrupted: 0.2 mm come before it, and 0.1 mm after it.
LINE = ("X.3 Y-.2 Z-.1",)
ARCS = {
    "quarter": "G03 X.2 Y.2 J.2",
    "half, clockwise": "G02 X.4 I.2",
    "full circle": "G03 I.2 J.1",
    "helix": "G02 X.4 I.2 Z-.1",
    "in the plane of Z and X": "G18 G03 X.2 Z-.2 K-.2",
}


def program(block):
    return ("G91 G01 F60", "X.2", block, "G01 Y.1", "M02")


def stop(machine, *, trips=True):
    """Stop the machine by an emergency stop, or a reset, and unlock it; where it was left."""
    machine.library.gk_trip(ESTOP, 0) if trips else machine.send(b"\x18")
    machine.run(200)
    left = machine.axes
    assert machine.line("$X")[-1] == "ok"
    machine.library.gk_arm()
    return left


def come_to(machine, block):
    """Run until a block is told."""
    for _ in range(20_000):
        if told(machine.lines)[-1:] == [block]:
            return
        machine.run(1)
    pytest.fail(f"block {block} is never told")


def interrupt(machine, blocks, block, passes, *, speed=7, trips=True):
    """Run a tape into a block, and let an emergency stop, or a reset, end it there."""
    machine.library.gk_speed(speed)
    machine.tape(punched(list(blocks)), passes=1)
    come_to(machine, block)
    machine.run(passes)
    assert told(machine.lines)[-1] == block
    return stop(machine, trips=trips)


def go_on(machine, blocks, *, speed=7):
    """The message before the word of the operator, and every place of the axes after it."""
    assert machine.line("$FROM=last") == ["ok"]
    stood = machine.axes
    count = len(machine.lines)
    machine.tape(punched(list(blocks)), passes=2000)
    (says,) = (line for line in machine.lines[count:] if "goes there without discharge" in line)
    assert machine.axes == stood, "nothing moves before the operator's word"
    machine.library.gk_speed(speed)
    machine.send(b"~")
    places = [stood]
    for _ in range(40_000):
        machine.run(1)
        if machine.axes != places[-1]:
            places.append(machine.axes)
        if events(machine.lines[count:], "end"):
            return says, places
    pytest.fail("the tape does not end")


def end_of(machine, blocks):
    """Where an uninterrupted run ends."""
    stood = machine.axes
    machine.library.gk_speed(1000)
    machine.tape(punched(list(blocks)), passes=20_000)
    assert events(machine.lines, "end")
    return tuple(b - a for a, b in zip(stood, machine.axes, strict=True))


@pytest.mark.parametrize("trips", [True, False])
@pytest.mark.parametrize("passes", [6, 40, 300])
def test_a_line_goes_on_where_it_was_left(machine, trips, passes):
    blocks = program(*LINE)
    whole = end_of(machine, blocks)
    begun = machine.axes
    left = interrupt(machine, blocks, 4, passes, trips=trips)
    assert left[1] < begun[1], "within the line"
    says, places = go_on(machine, blocks)
    x, y, z = (value / MM for value in left)
    assert f"block 4 was left at X{x:.4f} Y{y:.4f} Z{z:.4f}: ~ goes there" in says
    assert places[0] == left
    assert machine.axes == tuple(a + b for a, b in zip(begun, whole, strict=True))
    corner = tuple(a + b for a, b in zip(begun, (5000, -2000, -1000), strict=True))
    way = math.dist(left, corner) + 1000
    gone = sum(math.dist(a, b) for a, b in pairwise(places))
    assert gone == pytest.approx(way, rel=0.02), "not a pulse of it again"
    # All of them on the line from where it began, and then on the next.
    for place in places:
        along = place[0] - begun[0] - 2000
        if along < 3000:
            assert abs(place[1] - begun[1] + along * 2 / 3) <= 1.5
            assert abs(place[2] - begun[2] + along / 3) <= 1.5
    assert told(machine.lines)[-3:] == [4, 5, 6]


@pytest.mark.parametrize("passes", [30, 150, 400])
@pytest.mark.parametrize("arc", ARCS)
def test_an_arc_goes_on_where_it_was_left(machine, arc, passes):
    blocks = program(ARCS[arc])
    first, second = (2, 0) if "G18" in ARCS[arc] else (0, 1)
    whole = end_of(machine, blocks)
    begun = machine.axes
    words = {word[0]: float(word[1:]) for word in ARCS[arc].split()}
    start = (begun[0] + 2000, *begun[1:])
    centre = [start[axis] + MM * words.get("IJK"[axis], 0) for axis in range(3)]
    radius = math.hypot(*(start[axis] - centre[axis] for axis in (first, second)))
    left = interrupt(machine, blocks, 4, passes)
    says, places = go_on(machine, blocks)
    assert "block 4 was left at" in says
    assert places[0] == left
    assert machine.axes == tuple(a + b for a, b in zip(begun, whole, strict=True))
    end = tuple(a + MM * words.get("XYZ"[axis], 0) for axis, a in enumerate(start))
    ends = next(number for number, place in enumerate(places) if math.dist(place, end) < 7)
    curve = places[:ends + 1]
    for place in curve:
        away = math.hypot(*(place[axis] - centre[axis] for axis in (first, second)))
        assert away == pytest.approx(radius, abs=1.8)
    # It goes on in the same sense, and the rest is no more than what was left.
    turns = [math.atan2(place[second] - centre[second], place[first] - centre[first])
             for place in curve]
    steps = [math.remainder(b - a, math.tau) for a, b in pairwise(turns)]
    assert all((step > -0.01) if "G03" in ARCS[arc] else (step < 0.01) for step in steps)
    assert abs(sum(steps)) < math.tau


@pytest.mark.parametrize(("block", "passes"), [("X.3", 0), ("G03 I.2", 0), ("X.001 Y.001", 2)])
def test_a_block_that_has_hardly_begun_begins_anew(machine, block, passes):
    blocks = program(block)
    whole = end_of(machine, blocks)
    begun = machine.axes
    interrupt(machine, blocks, 4, passes, speed=1)
    says, places = go_on(machine, blocks)
    assert "block 4 begins at" in says
    assert places[1] != places[0]
    assert machine.axes == tuple(a + b for a, b in zip(begun, whole, strict=True))


@pytest.mark.parametrize("near", [2, 3, 5, 7, 9, 12, 15, 18, 24])
@pytest.mark.parametrize("arc", ["G03 X.0071 Y.01 I-.0029 J.01", "G02 X.02 I.01",
                                 "G03 X-.0141 Y.0074 I-.0099 J-.0017"])
def test_an_arc_that_has_almost_ended_ends(machine, arc, near):
    blocks = program(arc)
    words = {word[0]: float(word[1:]) for word in arc.split()}
    begun = machine.axes
    end = (begun[0] + 2000 + round(MM * words.get("X", 0)),
           begun[1] + round(MM * words.get("Y", 0)), begun[2])
    machine.library.gk_speed(1)
    machine.tape(punched(list(blocks)), passes=1)
    for _ in range(20_000):
        if told(machine.lines)[-1:] == [4] and math.dist(machine.axes, end) <= near:
            break
        machine.run(1)
    assert 0 < math.dist(machine.axes, end) <= near
    stop(machine)
    says, places = go_on(machine, blocks, speed=1)
    assert "block 4 was left at" in says
    assert len(places) < 2 * near + 1010
    assert machine.axes == (end[0], end[1] + 1000, end[2])


@pytest.mark.parametrize("arc", ["G02 X.02 Y.02 I.02 Z-3.2", "G03 X.02 Y.02 J.02 Z-1.6",
                                 "G03 I.02 Z-3.2"])
@pytest.mark.parametrize("part", [0.0003, 0.005, 0.5, 0.98, 0.992, 0.9988])
def test_a_steep_helix_turns_no_further_than_it_is_programmed(machine, arc, part):
    blocks = program(arc)
    words = {word[0]: float(word[1:]) for word in arc.split()}
    begun, way = machine.axes, round(MM * words["Z"])
    end = (begun[0] + 2000 + round(MM * words.get("X", 0)),
           begun[1] + round(MM * words.get("Y", 0)), begun[2] + way)
    machine.library.gk_speed(1)
    machine.tape(punched(list(blocks)), passes=1)
    for _ in range(80_000):
        if told(machine.lines)[-1:] == [4] and machine.axes[2] - begun[2] <= part * way:
            break
        machine.run(1)
    stop(machine)
    left = machine.axes
    says, places = go_on(machine, blocks, speed=3)
    if "begins at" in says:
        assert places[0] == left
        assert (begun[0] + 2000, *begun[1:]) in places
        return
    if part > 0.9:
        assert all(math.dist(place[:2], end[:2]) < 20 for place in places
                   if place[1] <= end[1] and place[2] > end[2])
    assert machine.axes == (end[0], end[1] + 1000, end[2])
    centre = (begun[0] + 2000 + MM * words.get("I", 0), begun[1] + MM * words.get("J", 0))
    turns = [math.atan2(place[1] - centre[1], place[0] - centre[0])
             for place in places if place[2] > end[2]]
    turned = sum(math.remainder(b - a, math.tau) for a, b in pairwise(turns))
    whole = math.tau if "X" not in words else math.pi / 2
    assert abs(turned) == pytest.approx((1 - part) * whole, abs=0.15)


@pytest.mark.parametrize("angle", [0.3, 2.36, 4.0])
def test_a_short_retraction_stays_in_the_arc(machine, angle):
    """An arc has several segments; it is one block."""
    blocks = program("G03 I.2 J.1")
    machine.library.gk_speed(7)
    machine.tape(punched(list(blocks)), passes=1)
    come_to(machine, 4)
    machine.run(round(angle * 2236 / 7))
    assert machine.library.gk_go(-600) == -600
    left = machine.axes
    stop(machine)
    says, places = go_on(machine, blocks)
    assert "block 4 was left at" in says
    assert places[0] == left


def test_a_jog_away_and_another_alarm_on_the_way_back(machine):
    blocks = program(*LINE)
    left = interrupt(machine, blocks, 4, 100)
    assert machine.line("$J=G91 Z.4 F600", 4000) == ["ok"]
    away = machine.axes
    assert away[2] == left[2] + 4000
    assert machine.line("$FROM=last") == ["ok"]
    machine.library.gk_speed(7)
    machine.tape(punched(list(blocks)), passes=2000)
    machine.send(b"~")
    machine.run(60)
    assert left[2] < machine.axes[2] < away[2]
    stop(machine)
    says, places = go_on(machine, blocks)
    assert "block 4 was left at" in says
    assert left in places
    assert [place[:2] for place in places[:places.index(left)]] == \
        [left[:2]] * places.index(left)


@pytest.mark.parametrize("passes", [40, 200])
def test_it_can_be_left_again_in_the_same_block(machine, passes):
    blocks = program("G03 I.2 J.1")
    whole = end_of(machine, blocks)
    begun = machine.axes
    interrupt(machine, blocks, 4, 100)
    for _ in range(2):
        assert machine.line("$FROM=last") == ["ok"]
        machine.library.gk_speed(7)
        machine.tape(punched(list(blocks)), passes=2000)
        machine.send(b"~")
        machine.run(passes)
        stop(machine)
    left = machine.axes
    says, places = go_on(machine, blocks)
    assert "block 4 was left at" in says
    assert places[0] == left
    assert machine.axes == tuple(a + b for a, b in zip(begun, whole, strict=True))


def test_after_a_loss_of_the_position_the_place_is_forgotten(machine):
    blocks = program(*LINE)
    interrupt(machine, blocks, 4, 100)
    machine.library.gk_trip(numbers()["coder"], 1)
    machine.run(200)
    machine.unlock()
    says, error = machine.line("$FROM=last")
    assert "needs $H" in says
    assert error.startswith("error")


WIRE = ("G10 D1 R.05", "G91 G41 D1 G01 X.2 F60", "X.2", "Y-.3", "X.2", "G40 Y.1", "M02")
TURN = 5        # its block in which the wire goes round a corner first


def wire_machine():
    machine = Controller(jump_axis=15)
    machine.unlock()
    return machine


def corner_and_line(machine):
    """Passes until the wire has gone round the corner, from the event of that block on."""
    copy = wire_machine()
    copy.library.gk_speed(7)
    copy.tape(punched(list(WIRE)), passes=1)
    come_to(copy, TURN)
    passes, down = 0, 0
    while down < 3:
        before = copy.axes
        copy.run(1)
        passes += 1
        down = down + 1 if copy.axes[0] == before[0] and copy.axes[1] < before[1] else 0
    return passes


@pytest.mark.parametrize("times", [1, 2])
def test_a_line_behind_the_corner_of_a_wire_offset(times):
    turned = corner_and_line(wire_machine())
    machine = wire_machine()
    whole = end_of(machine, WIRE)
    begun = machine.axes
    left = interrupt(machine, WIRE, TURN, turned + 20)
    for _ in range(times - 1):
        assert machine.line("$FROM=last") == ["ok"]
        machine.library.gk_speed(7)
        machine.tape(punched(list(WIRE)), passes=2000)
        machine.send(b"~")
        machine.run(60)
        stop(machine)
        assert machine.axes[0] == left[0]
        assert machine.axes[1] < left[1] - 100
        left = machine.axes
    says, places = go_on(machine, WIRE)
    assert f"block {TURN} was left at" in says
    assert places[0] == left
    assert machine.axes == tuple(a + b for a, b in zip(begun, whole, strict=True))
    assert max(place[1] for place in places[:20]) == left[1], "not round the corner again"


def test_in_the_corner_of_a_wire_offset_the_block_begins_anew():
    machine = wire_machine()
    whole = end_of(machine, WIRE)
    begun = machine.axes
    interrupt(machine, WIRE, TURN, 40)
    says, _ = go_on(machine, WIRE)
    assert f"block {TURN} begins at" in says
    assert machine.axes == tuple(a + b for a, b in zip(begun, whole, strict=True))


def test_a_block_that_has_ended_is_not_carried_out_again(machine):
    """The machine waits at its end for a function of the machine side."""
    blocks = ("G91 G01 F60", "X.2", "Y.3", "M80", "X.2", "M02")
    machine.library.gk_fin((1 << 32) - 1)
    machine.library.gk_speed(7)
    begun = machine.axes
    machine.tape(punched(list(blocks)), passes=2000)
    left = machine.axes
    assert left == (begun[0] + 2000, begun[1] + 3000, begun[2])
    assert events(machine.lines, "alarm")
    machine.library.gk_fin(1)
    assert machine.line("$X")[-1] == "ok"
    machine.library.gk_arm()
    says, places = go_on(machine, blocks)
    block = int(says.split("block ")[1].split()[0])
    assert (block, "begins" in says) in {(4, False), (5, True)}
    assert {place[1] for place in places} == {left[1]}, "nothing of it again"
    assert machine.axes[0] == left[0] + 2000


def test_a_motion_that_has_ended_is_not_carried_out_again(machine):
    """The tape has not come further, as from a cable that was pulled."""
    blocks = program(*LINE)
    rows = punched(list(blocks))
    begun = machine.axes
    machine.library.gk_speed(7)
    machine.frame(0, 0)
    part = b"\n".join(rows.split(b"\n")[:4]) + b"\n"    # block 1 is the one of the %
    for sequence, start in enumerate(range(0, len(part), 64), 1):
        machine.frame(len(part[start:start + 64]), sequence, part[start:start + 64])
    machine.run(2000)
    left = machine.axes
    assert left == (begun[0] + 5000, begun[1] - 2000, begun[2] - 1000)
    assert told(machine.lines)[-1] == 4
    stop(machine)
    says, places = go_on(machine, blocks)
    assert "block 4 was left at" in says
    assert {(place[0], place[2]) for place in places} == {(left[0], left[2])}
    assert machine.axes[1] == left[1] + 1000
    assert told(machine.lines)[-3:] == [4, 5, 6]


def test_a_retraction_to_an_earlier_block_begins_the_block_anew(machine):
    blocks = program(*LINE)
    machine.library.gk_speed(7)
    machine.tape(punched(list(blocks)), passes=1)
    come_to(machine, 4)
    machine.run(30)
    assert machine.library.gk_go(-1000) == -1000
    stop(machine)
    says, _ = go_on(machine, blocks)
    assert "block 4 begins at X0.2000 Y0.0000" in says


def test_what_was_moved_by_hand_meanwhile_does_not_count(machine):
    """An alarm in a line entered by hand, after the one in the tape."""
    blocks = program(*LINE)
    left = interrupt(machine, blocks, 4, 100)
    machine.send(b"G91 G01 Y.2 F60\n")
    machine.run(100)
    assert machine.axes != left
    stop(machine)
    says, places = go_on(machine, blocks)
    assert "block 4 was left at" in says
    assert left in places


def test_a_dry_run_neither_takes_nor_forgets_the_place(machine):
    blocks = program(*LINE)
    left = interrupt(machine, blocks, 4, 100)
    assert machine.line(assign("dry_run_mm_min", 900)) == ["ok"]
    go_on(machine, blocks)
    assert machine.axes != left
    assert machine.line(assign("dry_run_mm_min", 0)) == ["ok"]
    says, places = go_on(machine, blocks)
    assert "block 4 was left at" in says
    assert left in places


def test_from_a_number_the_block_is_whole(machine):
    blocks = program(*LINE)
    interrupt(machine, blocks, 4, 100)
    assert machine.line("$FROM=4") == ["ok"]
    lines = machine.tape(punched(list(blocks)), passes=2000)
    assert any("block 4 begins at" in line for line in lines)


def test_an_alarm_before_the_rest_leaves_nothing_for_a_line_by_hand(machine):
    blocks = program("M80 X.3")
    left = interrupt(machine, blocks, 4, 100)
    machine.library.gk_fin((1 << 32) - 1)
    assert machine.line("$FROM=last") == ["ok"]
    machine.tape(punched(list(blocks)), passes=2000)
    machine.send(b"~")
    machine.run(2000)
    assert events(machine.lines, "alarm")[-1][1] == str(named("fin").alarm)
    assert machine.axes == left
    assert machine.line("$X")[-1] == "ok"
    assert machine.line("G91 G01 X.1 F60", 4000) == ["ok"]
    assert machine.axes[0] == left[0] + 1000


def test_after_homing_the_block_begins_anew(memory):
    """The counts of the axes mean other places then."""
    machine = Homed(memory)
    machine.ready()
    blocks = program("X.3 Y.2 Z-.1")
    left = interrupt(machine, blocks, 4, 100)
    machine.ready()
    assert machine.axes != left
    says, _ = go_on(machine, blocks)
    assert "block 4 begins at" in says
