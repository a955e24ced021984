# SPDX-License-Identifier: Apache-2.0
"""From the planning into the depth series: G39 P1 puts in force what ``$BP`` has found."""

import ctypes

import pytest

from host.roughing.basic import read_all
from host.roughing.load import lines
from host.roughing.roughing import condition, program
from host.roughing.staircase import Job, plan
from softcore.tables.faults import error_line
from softcore.tables.settings import assign
from testbench.firmware import ACTS, Checker, Controller, events
from testbench.programs import punched

DATA = read_all("copper", "steel")[1:3]
JOB = Job(70, 110, 15)
PLAN = "$BP70,110,15"
RETRACTION = "G36 R300 L.5 H600 E60 Q.1"
NOTHING = "G39 P1 without a staircase that has been planned ($BP)."
PASSES = 60_000     # of the main loop that a planning takes at most


class Row(ctypes.Structure):
    """``condition_row`` of conditions.h."""

    _fields_ = [
        ("number", ctypes.c_uint32), ("milli_ip", ctypes.c_uint16), ("negative", ctypes.c_bool),
        *((name, ctypes.c_uint16) for name in ("on_us", "off_us", "rest_us", "open_v")),
        *((name, ctypes.c_uint8) for name in ("open_percent", "arc_v", "short_v", "dame", "open",
                                              "ok")),
        ("step", ctypes.c_uint16), ("reference_mv", ctypes.c_uint32), ("drop_mv", ctypes.c_uint32)]

    def told(self):
        """Every field by name."""
        return {name: getattr(self, name) for name, _ in self._fields_}


@pytest.fixture
def checker():
    made = Checker()
    made.library.conditions_find.restype = ctypes.POINTER(Row)
    made.library.conditions_planned.restype = Row
    yield made
    made.forget()
    made.library.conditions_reset()


@pytest.fixture
def machine():
    """A machine with basic data."""
    ready = Controller()
    ready.unlock()
    ready.library.gk_speed(100)
    for line in lines(DATA):
        assert ready.line(line, 100) == ["ok"]
    return ready


def entered(checker, ip):
    """The row of the condition that a planned program has for a current."""
    number, block = condition(ip)
    assert not block or checker.enter(block) == ""
    return checker.library.conditions_find(number).contents


@pytest.mark.parametrize("kept", ["", "G10 C{number} E100 K-1 H60 L.003 X3 Y5 Z18 V5 U2.5"])
def test_a_planned_current_has_the_condition_of_a_planned_program(checker, kept):
    """Also when a row of the same number has been entered by hand, with more words."""
    for ip in range(1, 21):
        wanted = entered(checker, ip).told()
        checker.library.conditions_reset()
        if kept:
            number, block = condition(ip)
            more = " I1 P9 Q99 R9" if block else ""
            assert checker.enter(kept.format(number=number) + more) == ""
            found = checker.library.conditions_planned(ip).told()
            wanted = entered(checker, ip).told()
            assert wanted["drop_mv"] == 2500
        else:
            found = checker.library.conditions_planned(ip).told()
        assert found == wanted
        assert found["milli_ip"] == 1000 * ip
        checker.library.conditions_reset()


def machined(machine, blocks, passes=4000):
    """Run a tape; return the condition events, and the power supply's levels while machining."""
    powers = []
    count = len(machine.lines)
    machine.tape(punched(blocks), passes=0)
    for _ in range(passes):
        machine.run(1)
        if machine.power not in powers[-1:]:
            powers.append(machine.power)
    said = machine.lines[count:]
    assert events(said, "end"), said[-3:]
    told = [tuple(map(int, event[1:])) for event in events(said, "condition")]
    return told, [power for power in powers if power["level"]]


def test_it_machines_what_the_planned_program_machines(machine):
    found = plan(DATA, JOB)
    body = [line.split(" ", 1)[1] for line in program(found, DATA, depth_series=True).splitlines()
            if line.startswith("N")]
    steps = [block for block in body if block.startswith(("G10", "C", "G39 Z"))]
    assert len([block for block in steps if block.startswith("G39")]) == 2
    way = ["M03", "G01 Z-15 F60", "M02"]
    wanted = machined(machine, [RETRACTION, *steps, *way])
    assert wanted[0] == [(908, 8000), (907, 7000, -22_030), (130, 6000, -74_990)]
    # The power-on condition would hide the effect of the first one.
    for line in ("G92 Z0", "C150", PLAN):
        assert machine.line(line, PASSES)[-1] == "ok"
    assert machined(machine, [RETRACTION, "G39 P1", *way]) == wanted
    assert [power["level"] for power in wanted[1]] == [8, 7, 6]


def test_depths_count_from_the_zero_in_force_and_by_hand_it_works_too(machine):
    assert machine.line(PLAN, PASSES)[-1] == "ok"
    assert machine.line("G92 Z3.5")[-1] == "ok"
    assert events(machine.line("G39 P1"), "condition") == [["condition", "908", "8000"]]
    assert machine.power["level"] == 8
    assert machine.line("G01 Z1 F60", 4000)[-1] == "ok"
    assert machine.power["level"] == 8, "zero was declared 3.5 mm lower"
    said = machine.line("G01 Z-2.5 F60", 4000)
    assert events(said, "condition") == [["condition", "907", "7000", "-22030"]]
    assert machine.axes[2] == -60_000


def test_it_ends_a_depth_series_and_is_ended_like_one(machine):
    assert machine.line(PLAN, PASSES)[-1] == "ok"
    for line in ("C150", "G39 Z-1 C140", "G39 P1", "G39 Z-14 C100"):
        assert machine.line(line)[-1] == "ok"
    assert "must lie deeper" in machine.line("G39 Z-14 C110")[0]
    said = machine.line("G01 Z-5 F60", 4000)
    assert [event[1] for event in events(said, "condition")] == ["907"]
    assert machine.line("G39")[-1] == "ok"
    assert events(machine.line("G01 Z-15 F60", 8000), "condition") == []
    assert machine.power["level"] == 7


def test_a_plan_outlives_a_reset_and_other_data_but_not_another_planning(machine):
    assert machine.line(PLAN, PASSES)[-1] == "ok"
    machine.send(b"\x18")
    machine.run(400)
    machine.unlock()
    assert machine.line("$BD0,1")[-1] == "ok"
    assert machine.line("G39 P1")[-1] == "ok"
    assert machine.line(PLAN)[-1] == error_line("table")
    assert machine.line("G39 P1")[-1] == "ok", "nothing was planned instead"


def test_while_a_planning_is_not_over_there_is_nothing(machine):
    assert machine.line(PLAN, PASSES)[-1] == "ok"
    machine.send(PLAN.encode() + b"\n")
    machine.run(50)
    machine.send(b"\x18")
    machine.run(400)
    machine.unlock()
    assert machine.line("G39 P1") == [f"[MSG:MDI, character 5: {NOTHING}]", error_line("condition")]
    assert machine.line("$BP70,40,15", PASSES)[-1] == error_line("table")
    assert machine.line("G39 P1")[-1] == error_line("condition")
    assert machine.line(PLAN, PASSES)[-1] == "ok"
    assert machine.line("G39 P1")[-1] == "ok"


def test_a_supply_that_lacks_a_current_has_no_depth_series(machine):
    assert machine.line(PLAN, PASSES)[-1] == "ok"
    machine.line(assign("current_step_ma", 1000))
    assert machine.line("G39 P1")[-1] == error_line("condition"), "planned for another supply"
    assert machine.line(PLAN, PASSES)[-2:] == [
        "[MSG:The power supply is not set to all of these currents: G39 P1 has no staircase]", "ok"]
    assert machine.line("G39 P1")[-1] == error_line("condition")
    machine.line(assign("current_step_ma", 750))
    assert machine.line(PLAN, PASSES)[-3] == "[MSG:IP 6 to 15.0000 mm]"
    assert events(machine.line("G39 P1"), "condition") == [["condition", "908", "8000"]]
    assert machine.power["level"] == 16
    machine.line(assign("current_step_ma", 1500))
    machine.line("G10 C130 I5")
    assert "not set to all" in machine.line(PLAN, PASSES)[-2], "C130 has another current by hand"


@pytest.mark.parametrize(("block", "name", "words"), [
    ("G39 P1", "condition", f"MDI, character 5: {NOTHING}"),
    ("G39 P2", "number", "MDI, character 5: G39 takes P1 only: what has been planned last."),
    ("G39 P1.5", "number", "G39 takes P1 only"),
    ("G39 P-1", "number", "MDI, character 6: the word P takes no sign."),
    ("G39 P1 Z-1", "conflict",
     "MDI, character 8: G39 P1 takes depths and conditions from what has been"),
    ("G39 P1 C100", "conflict",
     "MDI, character 8: G39 P1 takes depths and conditions from what has been"),
    ("G39 P1 M03", "place", "a G39 block carries no other word"),
])
def test_bad_words_get_one_sentence(block, name, words):
    ready = Controller()
    ready.unlock()
    said = ready.line(block)
    assert said[-1] == error_line(name)
    assert words in said[0]
    assert len(said) == 2


def test_a_feed_mode_needs_its_reference_in_every_step(machine):
    assert machine.line(PLAN, PASSES)[-1] == "ok"
    for line in ("G10 C900 I1 P20 Q60 V9", "C900", "G95 P2"):
        assert machine.line(line)[-1] == "ok"
    said = machine.line("G39 P1")
    assert said[-1] == error_line("condition")
    assert "G95 P2 needs a reference voltage Vs, V of G10, which the condition C908" in said[0]


def test_a_depth_series_whose_pulses_are_not_looked_at_is_refused(machine):
    assert machine.line(PLAN, PASSES)[-1] == "ok"
    machine.line(assign("blanking_ns", 1_000_000))
    assert machine.line("G39 P1")[-1] == error_line("condition")
    machine.line(assign("blanking_ns", 3000))
    assert machine.line("G39 P1")[-1] == "ok"


@pytest.mark.parametrize("mode", ["G94", "G95 P1", "G95 P2", "G95 P3", "G95 P4"])
def test_a_checked_tape_may_count_on_a_plan(checker, mode):
    """Only the machine knows whether a plan exists; the check takes it as an empty depth series."""
    tape = [RETRACTION, mode, "G39 P1", "M03", "G01 Z-1 F60", "M05", "G39 Z-14 C130", "M02"]
    if mode in ("G95 P2", "G95 P3", "G95 P4"):
        tape.remove("G39 Z-14 C130")    # which has no reference
    records = checker.check(punched(tape))
    assert isinstance(records, list), records
    assert [one.act for one in records].count(ACTS.index("planned")) == 1


@pytest.mark.parametrize(("tape", "words"), [
    (["G39 P2"], "Block 2, character 5: G39 takes P1 only: what has been planned last."),
    (["G39 P1 Z-1"], "takes depths and conditions from what has been planned"),
    (["G39 P1 M03"], "a G39 block carries no other word"),
    (["G10 D1 R.1", "G41 D1", "G39 P1"], "G39 and a wire offset (G41, G42) exclude each other"),
])
def test_a_checked_tape_is_refused_for_what_is_wrong_without_a_plan_too(checker, tape, words):
    assert words in checker.check(punched([*tape, "M02"])).sentence


def test_settings_by_hand_are_in_force_in_a_check(checker):
    rows = punched(["G10 C900 I6.5 P20 Q60", "C900", "M02"])
    assert "1500 mA each" in checker.check(rows).sentence
    assert checker.enter(assign("current_step_ma", 750)) == ""
    assert isinstance(checker.check(rows), list)
    assert checker.enter("G10 C901 I.5 P20 Q60") == ""
    assert isinstance(checker.check(rows), list), "a line by hand leaves them"
    checker.forget()
    assert "1500 mA each" in checker.check(rows).sentence


@pytest.mark.parametrize(("line", "why"), [
    ("$455", "MDI, character 4: a setting reads $number=value."),
    ("$455=7x", "MDI, character 6: a setting reads $number=value."),
    ("$455=0", "setting 455 does not exist or is out of range."),
    ("$999=1", "setting 999 does not exist or is out of range."),
    ("$BP70,110,15", "of the lines with $ a check takes settings only."),
    ("$", "of the lines with $ a check takes settings only."),
])
def test_other_lines_with_a_dollar_are_refused_in_a_check(checker, line, why):
    assert checker.enter(line) == why


def test_what_is_planned_anew_says_nothing_of_what_is_in_force(machine):
    """The first condition planned then, which has a reference voltage, is not in force."""
    for line in ("G10 C150 V20", PLAN, RETRACTION):
        assert machine.line(line, PASSES)[-1] == "ok"
    assert "ok" in machine.line("G39 P1")
    assert "[MSG:IP 12 to 1.3980 mm]" in machine.line("$BP70,150,15", PASSES)[1]
    said = machine.line("G95 P2")
    assert said[-1] == error_line("condition")
    assert "which the condition C908 does not have" in said[0]
