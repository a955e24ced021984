# SPDX-License-Identifier: Apache-2.0
"""The depth series (G39), from its words to the gateware's registers."""

import pytest

from softcore.tables.faults import alarm_number, error_line
from softcore.tables.settings import assign
from testbench.firmware import Checker, Controller, Fault, events
from testbench.programs import punched

DATA = "G36 R300 L.5 H600 E60 Q.1"
STEPS = [(-1000, 140, 9), (-2000, 130, 6), (-2010, 120, 4), (-9000, 110, 2)]
DEPTH_SERIES = [f"G39 Z{depth / 10_000} C{number}" for depth, number, _ in STEPS]
WAY = "G01 Z-1 F60"


@pytest.fixture
def machine():
    ready = Controller()
    ready.unlock()
    ready.library.gk_speed(10)
    return ready


def switched(lines):
    """Number, 1/1000 IP and depth of every condition event; no depth for a plain C."""
    return [tuple(map(int, event[1:])) for event in events(lines, "condition")]


def levels(machine, rows, passes=30_000):
    """Run a tape; the currents in force and the depth at which each was seen first."""
    seen = []
    machine.library.gk_speed(0)     # it moves when all of the tape has come
    machine.tape(punched(rows), passes=0)
    machine.library.gk_speed(10)
    for _ in range(passes):
        level = machine.power["level"]
        if level != (seen[-1][0] if seen else 0):
            seen.append((level, machine.axes[2]))
        machine.run(1)
        if any(line.startswith("[E:end") for line in machine.lines[-3:]):
            break
    return seen


def test_each_step_comes_at_its_depth_within_one_block(machine):
    seen = levels(machine, [DATA, "C150", *DEPTH_SERIES, "M03", WAY, "M02"])
    assert [level for level, _ in seen] == [12, 9, 6, 4, 2]
    for (_, at), (depth, _, _) in zip(seen[1:], STEPS, strict=True):
        late = 200 if depth == -2010 else 0    # it follows on the heels of the one before
        assert depth - 10 - late <= at <= depth
    assert switched(machine.lines) == [(150, 12_000), *(
        (number, 1000 * ip, depth) for depth, number, ip in STEPS)]


def test_going_back_switches_nothing(machine):
    machine.library.gk_speed(0)
    machine.tape(punched([DATA, "C150", *DEPTH_SERIES, "M03", WAY, "M02"]), passes=600)
    machine.library.gk_go(1500)
    machine.run(100)
    assert machine.power["level"] == 9
    for way in (-1400, 1400, -1400):
        machine.library.gk_go(way)
        machine.run(100)
        assert machine.power["level"] == 9
    machine.library.gk_go(1899)
    machine.run(100)
    assert (machine.axes[2], machine.power["level"]) == (-1999, 9)
    machine.library.gk_go(1)
    machine.run(100)
    assert machine.power["level"] == 6
    assert switched(machine.lines)[1:] == [(140, 9000, -1000), (130, 6000, -2000)]


def test_a_depth_that_has_been_passed_applies_at_once(machine):
    seen = levels(machine, ["G01 Z-.15 F60", "C150", *DEPTH_SERIES[:2], "M03", "Z-.3", "M02"])
    assert seen == [(12, -1500), (9, -1500), (6, -2000)]
    # The furthest place counts, not the present one; a new depth series begins at the axis' place.
    assert machine.line("C150")[-1] == "ok"
    assert machine.line(DEPTH_SERIES[3])[-1] == "ok"
    assert machine.line("G01 Z0 F60", 2000)[-1] == "ok"
    machine.run(3000)
    assert machine.power["level"] == 12
    assert machine.line("G39")[-1] == "ok"
    assert machine.line(DEPTH_SERIES[0])[-1] == "ok"
    machine.run(100)
    assert machine.power["level"] == 12


def test_a_step_may_follow_while_machining_goes_on_from_block_to_block(machine):
    first, second, *_ = DEPTH_SERIES
    seen = levels(machine, [DATA, "C150", first, "M03", "G01 Z-.15 F60", second, WAY, "M02"])
    assert seen == [(12, 0), (9, -1000), (6, -2000)]


@pytest.mark.parametrize(("end", "level"), [("C110", 2), ("G39", 9), ("M05", 6)])
def test_what_ends_a_depth_series(machine, end, level):
    levels(machine, [DATA, "C150", *DEPTH_SERIES[:2], "M03", "G01 Z-.15 F60", end, WAY, "M02"])
    assert machine.power["level"] == level
    assert len(switched(machine.lines)) == {"C110": 3, "G39": 2, "M05": 3}[end]


def test_end_of_program_reset_and_alarm_end_a_depth_series(machine):
    for end in ("end", "reset", "alarm"):
        machine.run(2000)
        machine.lines.clear()
        assert machine.line("C150")[-1] == "ok"
        assert machine.line("G92 Z0")[-1] == "ok"
        machine.tape(punched([DATA, "C150", DEPTH_SERIES[0], "M03", "G01 Z-.05 F60",
                              "M02" if end == "end" else "G04 X9", "M02"]), passes=3000)
        if end == "reset":
            machine.send(b"\x18")
            machine.run(1000)
        if end == "alarm":
            machine.library.gk_trip(1, 0)
            machine.run(1000)
        if end != "end":
            machine.unlock()
        assert machine.line("G01 Z-1 F60", 4000)[-1] == "ok"
        machine.run(4000)
        assert switched(machine.lines)[2:] == []
        assert machine.power["level"] == 12


def test_what_is_staged_waits_for_a_pulse_that_goes_on(machine):
    machine.library.gk_pulse_lasts(0)
    machine.library.gk_speed(0)
    machine.line(assign("fluid_mode", 1))
    machine.tape(punched([DATA, "C150", *DEPTH_SERIES, "M03", WAY, "M02"]), passes=800)
    machine.library.gk_pulse_lasts(1)
    machine.library.gk_go(1200)
    machine.run(100)
    # The fluid's class changes meanwhile: nothing is staged over what is still to be taken.
    machine.event("fluid_class", 3, 3 << 4, 700)
    machine.run(100)
    assert (machine.power["level"], machine.gap["presets"]) == (12, (3, 6, 14))
    machine.library.gk_pulse_lasts(0)
    machine.run(100)
    assert (machine.power["level"], machine.gap["presets"]) == (9, (13, 2, 28))
    machine.library.gk_go(1000)
    machine.run(200)
    assert (machine.power["level"], machine.gap["presets"]) == (4, (13, 2, 28))
    assert switched(machine.lines)[1:] == [(140, 9000, -1000), (130, 6000, -2000),
                                           (120, 4000, -2010)]


def test_a_class_that_changes_while_a_step_is_staged(machine):
    machine.library.gk_speed(0)
    machine.line(assign("fluid_mode", 1))
    machine.tape(punched([DATA, "C150", *DEPTH_SERIES, "M03", WAY, "M02"]), passes=800)
    for number, presets in ((1, (5, 5, 18)), (2, (8, 3, 22))):
        machine.event("fluid_class", number, number << 4, 3000)
        machine.run(100)
        assert (machine.power["level"], machine.gap["presets"]) == (12, presets)
    machine.library.gk_go(1000)
    machine.run(100)
    assert (machine.power["level"], machine.gap["presets"]) == (9, (8, 3, 22))


def test_depths_are_of_the_frame_in_which_they_are_said(machine):
    seen = levels(machine, ["G92 Z1", DATA, "C150", "G39 Z.9 C140", "G91", "G39 Z.8 C130", "M03",
                            WAY, "M02"])
    assert seen == [(12, 0), (9, -1000), (6, -2000)]
    assert switched(machine.lines)[1:] == [(140, 9000, 9000), (130, 6000, 8000)]


@pytest.mark.parametrize(("blocks", "name", "words"), [
    (["C150", "G39 Z-1 C777"], "condition",
     "Block 3, character 9: the machining condition C777 is not in"),
    (["G39 Z-1 C130"], "condition",
     "Block 2, character 1: G39 without a machining condition (C) before it"),
    (["C150", *DEPTH_SERIES[:2], "G39 Z-.2 C120"], "condition",
     "Block 5, character 5: a step of G39 must lie deeper than the one before it, at -0.2000 mm."),
    (["C150", "G92 Z1", "G39 Z.5 C140", "G92 Z0", "G39 Z-.4 C140"], "condition",
     "before it, at -0.5000 mm"),
    (["C150", "G39 Z-1"], "missing", "a step of G39 needs its depth Z and its condition C"),
    (["C150", "G39 C100"], "missing", "a step of G39 needs its depth Z and its condition C"),
    (["C150", "G39 Z-1 C130 M03"], "place",
     "Block 3, character 14: a G39 block carries no other word"),
    (["C150", "G39 Z-1 C130 F5"], "place", "a G39 block carries no other word"),
    (["C150", "G39 Z-1 X5 C130"], "place", "a G39 block carries no other word"),
    (["C150", "G01 G39 Z-1 C130"], "conflict", "G1 and G39 exclude each other"),
    (["C150", "G10 D1 R.1", "G41 D1", "G39 Z-1 C130"], "conflict",
     "G39 and a wire offset (G41, G42) exclude each other"),
    (["C150", *(f"G39 Z-{n} C100" for n in range(1, 34))], "condition",
     "Block 35, character 5: no more than 32 steps fit a series (G39)"),
    (["G10 C900 I1 P20 Q60 V9", "C900 G95 P2", "G39 Z-1 C130"], "condition",
     "Block 4, character 5: G95 P2 needs a reference voltage Vs, V of G10, which the condition C1"),
    (["G10 C900 I1 P20 Q60 V9", "C900", "G39 Z-1 C130", "G95 P2"], "condition",
     "Block 5, character 1: G95 P2 needs a reference voltage Vs, V of G10, which the condition C1"),
])
def test_steps_that_make_no_sense_are_refused(machine, blocks, name, words):
    found = Checker().check(punched([*blocks, "M02"]))
    assert found.name == name
    assert words in found.sentence
    told = events(machine.tape(punched([*blocks, "M02"]), passes=9000), "alarm")[0]
    assert told[1] == str(alarm_number(name))
    assert words in ",".join(told[2:])


def test_room_is_for_32_steps(machine):
    rows = ["C150", *(f"G39 Z-{n} C100" for n in range(1, 33)), "G39", "G39 Z-1 C100", "M02"]
    assert not isinstance(Checker().check(punched(rows)), Fault)


def test_a_machine_without_a_jump_axis_has_no_depth_series():
    wire = Controller(jump_axis=15)
    wire.unlock()
    assert wire.line("C500")[-1] == "ok"
    lines = wire.line("G39 Z-1 C510")
    assert lines[-1] == error_line("refused")
    assert "G39 is for machines with a jump axis (sinkers)" in lines[0]


@pytest.mark.parametrize(("step_ma", "words", "level", "milli_ip"), [
    (1500, "I4", 4, 4000), (1500, "I4.01", 4, 4000), (500, "I4", 12, 4000), (500, "I.33", 1, 333),
    (500, "I5.333", 16, 5333), (500, "I6.67", 20, 6666), (1500, "I20", 20, 20_000),
    (750, "I1.5", 3, 1500), (500, "I0", 0, 0),
])
def test_currents_go_by_steps_of_the_power_supply(machine, step_ma, words, level, milli_ip):
    assert machine.line(assign("current_step_ma", step_ma)) == ["ok"]
    assert machine.line(f"G10 C900 {words} P40 Q40") == ["ok"]
    lines = machine.line("C900")
    assert lines[-1] == "ok"
    assert switched(lines) == [(900, milli_ip)]
    assert machine.power["level"] == level


@pytest.mark.parametrize(("step_ma", "words"), [
    (1500, "I1.5"), (1500, "I21"), (1500, "I4.02"), (500, "I.3"), (500, "I7"), (1500, "I99999"),
])
def test_currents_that_the_power_supply_does_not_have_are_refused(machine, step_ma, words):
    machine.line(assign("current_step_ma", step_ma))
    lines = machine.line(f"G10 C900 {words} P40 Q40")
    assert lines[-1] == error_line("table")


def test_a_condition_for_which_the_supply_has_no_step_is_refused(machine):
    machine.line(assign("current_step_ma", 1000))
    assert machine.line("C110")[-1] == "ok"
    lines = machine.line("C100")
    assert lines[-1] == error_line("condition")
    assert "the power supply cannot give the current of the condition C100" in lines[0]
    machine.line(assign("current_step_ma", 500))
    assert machine.line("C130")[-1] == "ok"
    refused = error_line("condition")
    assert machine.line("C140")[-1] == refused, "27 steps; the gateware lets 20 through"


UNSEEN = ("[MSG:MDI, character 1: a pulse of C901 takes 6 us, and the gap is sampled "
          "after 51000 ns only ($404, $427).]")
SHORTER = "G10 C901 I3 P6 Q10 R10"


def by_hand(machine, *lines):
    """Enter lines that must all be accepted."""
    for line in lines:
        assert "ok" in machine.line(line), line


def test_machining_begins_only_if_all_that_is_to_come_is_seen(machine):
    """Settings may change between the G39 and the M03, both entered by hand."""
    by_hand(machine, DATA, SHORTER, "C150", "G39 Z-.1 C901", assign("blanking_ns", 50_000))
    assert machine.line("M03") == [UNSEEN, error_line("condition")]
    by_hand(machine, "G39", "M03")


def test_machining_goes_on_only_if_the_condition_that_was_reached_is_seen(machine):
    by_hand(machine, DATA, SHORTER, "C150", "G39 Z-.1 C901", "M03", "G01 Z-.2 F60")
    machine.run(20_000)
    assert machine.power["level"] == 3
    by_hand(machine, "M05", assign("blanking_ns", 50_000))
    assert machine.line("M03") == [UNSEEN, error_line("condition")]
    # A row that is entered anew is not in force before its next C.
    by_hand(machine, "G10 C901 P100")
    assert machine.line("M03") == [UNSEEN, error_line("condition")]
    by_hand(machine, "C901", "M03")


def test_the_supply_has_the_step_that_conditions_were_judged_by(machine):
    by_hand(machine, DATA, assign("current_step_ma", 4500), "G10 C901 I60 P60 Q10 R10", "C901",
            assign("current_step_ma", 1500))
    assert machine.line("M03")[-1] == error_line("condition")
    assert "M03 needs a C anew" in machine.lines[-2]
    by_hand(machine, "C150", "M03")


@pytest.mark.parametrize("setting", [assign("blanking_ns", 50_000), assign("settle_ns", 50_000),
                                     assign("current_step_ma", 750)])
def test_what_conditions_are_judged_by_stays_while_machining(machine, setting):
    by_hand(machine, DATA, "C150", "M03")
    number = setting[1:setting.index("=")]
    assert machine.line(setting) == [
        f"[MSG:setting {number} guards the machine: M05 and rest come first.]", error_line("busy")]
    by_hand(machine, assign("servo_window", 40), "M05", setting)
