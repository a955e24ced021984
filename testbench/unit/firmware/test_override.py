# SPDX-License-Identifier: Apache-2.0
"""Overrides of the constant feed and of rapids: the speeds that they scale, and all others."""

import pytest

from testbench.firmware import Controller
from testbench.programs import punched

DATA = "G36 R300 L.5 H600 E60 Q.1"
CUT = ("G10 C130 V20 U20", "C130 M03")


def rates(machine, count):
    return [machine.slot(number).rate for number in range(count)]


def near(*expected):
    """Rates are rounded down, and so is the factor."""
    return [pytest.approx(rate, abs=1) for rate in expected]


def override(machine):
    (line,) = (line for line in machine.line("?", 30) if line.startswith("<"))
    return line.partition("|Ov:")[2].partition("|")[0]


def paused(machine, *blocks, passes=600):
    """A program whose first motion has just begun."""
    machine.library.gk_speed(0)
    machine.tape(punched(list(blocks)), passes=passes)
    machine.library.gk_speed(1)
    machine.run(4)
    machine.library.gk_speed(0)


def press(machine, *data, passes=60):
    machine.send(bytes(data))
    machine.run(passes)


PATH = ("G91 G01 X1 F60", "G00 X1", "G02 X1 Y1 I1 J0 F30", "G01 X1", "M02")


def test_feed_and_rapids_have_an_override_each(machine):
    paused(machine, *PATH)
    feed, rapid, *arc = rates(machine, 3)
    assert rapid > feed
    press(machine, 0x91, 0x91, 0x93)
    assert override(machine) == "121,100,100"
    assert rates(machine, 3) == near(feed * 1.21, rapid, arc[0] * 1.21)
    press(machine, 0x97)
    assert override(machine) == "121,25,100"
    assert rates(machine, 3) == near(feed * 1.21, rapid / 4, arc[0] * 1.21)
    press(machine, 0x90, 0x95)
    assert override(machine) == "100,100,100"
    assert rates(machine, 3) == [feed, rapid, *arc]


def test_it_acts_in_the_block_under_way_and_in_those_to_come(machine):
    paused(machine, "G91 G01 F60", *["X.1"] * 90, "M02")
    before = machine.slot(0).rate
    press(machine, 0x92)
    assert rates(machine, 40) == near(*[before * 0.9] * 40)
    machine.library.gk_speed(300)
    machine.run(220)
    machine.library.gk_speed(0)
    assert machine.library.gk_position() > 50_000
    assert rates(machine, 64) == near(*[before * 0.9] * 64)


def test_no_feed_is_above_the_highest_speed_nor_nothing(machine):
    paused(machine, "G91 G00 X1", "G01 X1 F1200", "X1 F.001", "M02")
    highest, fast, slow = rates(machine, 3)
    assert 2 * fast > highest
    press(machine, *[0x91] * 10)
    assert rates(machine, 3) == near(highest, min(highest, 2 * fast), 2 * slow)
    press(machine, *[0x92] * 30)
    assert rates(machine, 3) == near(highest, fast / 10, max(1, slow / 10))


@pytest.mark.parametrize("mode", ["P1", "P2", "P3", "P4"])
def test_what_goes_by_the_gap_keeps_its_feed(machine, mode):
    """Also in the blocks behind the machine, into which the servo may go back."""
    paused(machine, DATA, "G91 G01 X.01 F60", *CUT, f"G95 {mode} X1 F6", "G00 X1", "M02")
    before = rates(machine, 1)
    data = machine.data
    press(machine, 0x91, 0x97)
    assert rates(machine, 1) == near(before[0] * 1.1)
    machine.library.gk_speed(1)
    machine.run(500)
    assert machine.feed_mode["mode"] == {"P1": 0, "P2": 1, "P3": 2, "P4": 3}[mode]
    assert rates(machine, 2) == near(before[0], before[0] / 10)
    press(machine, 0x91, 0x92, 0x92, 0x95)
    assert rates(machine, 2) == near(before[0], before[0] / 10)
    assert override(machine) == "100,100,100"
    assert machine.data == data


def test_a_retraction_keeps_its_speeds(machine):
    paused(machine, DATA, "G38 P500 L.2 R600 H900", "C130 M03", "G01 X1 F60", "M02")
    before = machine.data
    for byte in range(0x90, 0xA2):
        press(machine, byte)
        assert machine.data == before


@pytest.mark.parametrize("end", [b"\x18", b"M02\n", b"M30\n"])
def test_they_end_with_the_program_and_with_a_reset(machine, end):
    press(machine, 0x91, 0x96)
    assert override(machine) == "110,50,100"
    machine.send(end)
    machine.run(600)
    assert override(machine) == "100,100,100"


def test_a_tape_that_ends_ends_them(machine):
    press(machine, 0x91, 0x96)
    machine.tape(punched(["G01 X.1 F60", "M02"]), passes=4000)
    assert override(machine) == "100,100,100"


def test_a_guarded_link_has_none(machine):
    machine.send(Controller.numbered(0, "$I"))
    machine.run(100)
    press(machine, 0x91)
    assert override(machine) == "100,100,100"
    machine.send(Controller.numbered(1, "$L"))
    assert "ignored 1]" in machine.run(100)[-2]


# ---- the spindle stop of grbl

def held(machine):
    paused(machine, DATA, "C130 M03", "G01 X1 F60", "M02")
    press(machine, 0x21)
    assert "discharge" in machine.flags


def test_the_discharge_goes_off_in_a_hold_and_on_with_the_order_to_go_on(machine):
    held(machine)
    for _ in range(3):
        press(machine, 0x9E)
        assert "discharge" not in machine.flags, "never on"
    press(machine, 0x7E)
    assert {"discharge", "run"} <= machine.flags
    assert "hold" not in machine.flags


def test_it_does_nothing_where_the_machine_moves(machine):
    paused(machine, DATA, "C130 M03", "G01 X1 F60", "M02")
    press(machine, 0x9E)
    assert "discharge" in machine.flags
    press(machine, 0x21)
    machine.library.gk_moving(1)
    press(machine, 0x9E)
    assert "discharge" in machine.flags


def test_nothing_is_armed_anew(machine):
    held(machine)
    press(machine, 0x9E)
    machine.library.hal_disarm()
    for order in (b"~", b"$RESUME\n"):
        machine.send(order)
        said = machine.run(200)
        assert "arm" in said[0]
        assert {"hold", "held"} <= machine.flags
        assert "discharge" not in machine.flags
    machine.library.gk_arm()
    press(machine, 0x7E)
    assert "discharge" in machine.flags
    assert "hold" not in machine.flags


def test_no_block_switches_it_on_in_that_hold(machine):
    machine.line("C100 M03", 2000)
    press(machine, 0x21)
    press(machine, 0x9E)
    assert machine.line("M05", 400)[-1] == "ok"
    assert machine.line("M03", 400)[-1] == "ok"
    assert "discharge" not in machine.flags
    press(machine, 0x7E)
    assert "discharge" in machine.flags


def test_a_reset_forgets_it(machine):
    held(machine)
    press(machine, 0x9E)
    press(machine, 0x18, passes=400)
    machine.unlock()
    machine.line("C130 M03", 2000)
    assert "discharge" in machine.flags
