# SPDX-License-Identifier: Apache-2.0
"""Conditions, tables, the fluid's class and the servo, as firmware writes them to the gateware."""

import pytest

from softcore.tables.faults import alarm_number, error_line
from softcore.tables.settings import assign
from testbench.firmware import Checker, Fault, events
from testbench.programs import punched

DATA = "G36 R300 L.5 H600 E60 Q.1"
SECOND_PATENT = [(3, 6, 14), (5, 5, 18), (8, 3, 22), (13, 2, 28)]
SHARES = [100, 99, 98, 75]   # of the open voltage, percent
SECOND = 2000   # passes: 2 MHz, 1000 clocks each
BROKEN_LOW, BROKEN_HIGH, DISORDERED, SILENT, KNOWN = 1, 2, 4, 8, 16


def run(machine, *blocks, passes=4000):
    return machine.tape(punched(list(blocks)), passes=passes)


def reference(volts):
    return volts * 1024 // 100


def test_condition_reaches_supply_and_comparators(machine):
    run(machine, "C130", "M02")
    assert machine.power == {"on": 200, "wait": 0, "off": 100, "rest": 100, "level": 6,
                             "voltage": 4, "negative": 0}
    assert machine.gap["reference"] == (reference(60), reference(20), reference(12))
    assert machine.gap["presets"] == SECOND_PATENT[0]
    assert machine.gap["step"] == 50


def test_a_condition_whose_pulses_are_not_looked_at_is_refused(machine):
    """The gap is not observed for 3000 ns from a pulse's start and 1000 ns from its ignition."""
    refused = ("a pulse of C900 takes 4 us, and the gap is sampled after 4000 ns "
               "only ($404, $427).")
    assert machine.line("G10 C900 I1 P4 Q40") == ["ok"]
    assert machine.line("C900") == [f"[MSG:MDI, character 1: {refused}]", error_line("condition")]
    assert machine.line("C130")[-1] == "ok"
    assert machine.line("G39 Z-1 C900") == [f"[MSG:MDI, character 9: {refused}]",
                                            error_line("condition")]
    assert machine.line("G10 C900 P5") == ["ok"]
    assert machine.line("C900")[-1] == "ok"
    assert machine.line("C510")[-1] == error_line("condition"), "3 us"


def test_the_longest_numbers_fit_the_sentence(machine):
    assert machine.line("G10 C99999999 I1 P1100 Q40") == ["ok"]
    for line in (assign("blanking_ns", 1_000_000), assign("settle_ns", 100_000)):
        assert machine.line(line) == ["ok"]
    assert machine.line("C99999999")[0] == (
        "[MSG:MDI, character 1: a pulse of C99999999 takes 1100 us, and the gap is sampled "
        "after 1100000 ns only ($404, $427).]")
    machine.line(assign("blanking_ns", 600))
    machine.line(assign("settle_ns", 300))
    assert machine.line("C510")[-1] == "ok"


def test_machining_does_not_begin_unseen(machine):
    """The setting has changed since the condition."""
    assert machine.line("G10 C900 I1 P5 Q40") == ["ok"]
    assert machine.line("C900")[-1] == "ok"
    machine.line(assign("settle_ns", 2000))
    assert machine.line("M03")[-1] == error_line("condition")
    machine.line(assign("settle_ns", 1999))
    assert machine.line("M03")[-1] == "ok"


def test_class_of_the_fluid_switches_presets_and_the_open_level_alone(machine):
    machine.line(assign("fluid_mode", 1))
    run(machine, "C130", "M02")
    before = machine.power
    for number in (1, 2, 3, 0):
        machine.event("fluid_class", number, number << 4, 1000 + number)
        lines = machine.run(200)
        row = [str(number), str(number), str(1000 + number), *map(str, SECOND_PATENT[number])]
        assert events(lines, "fluid") == [["fluid", *row]]
        assert machine.gap["presets"] == SECOND_PATENT[number]
        assert machine.gap["reference"] == (
            reference(80 * 75 * SHARES[number] // 10_000), reference(20), reference(12))
    assert machine.power == before


def test_tables_are_entered_by_program_and_by_hand(machine):
    assert machine.line("G10 C900 I3 P40 Q30 R70 E120 H80 K-1 L.002 X4 Y5 Z6") == ["ok"]
    assert machine.line("G10 W2 X9 Y8 Z7 H50") == ["ok"]
    run(machine, "C900", "M02")
    assert machine.power == {"on": 80, "wait": 0, "off": 60, "rest": 140, "level": 3, "voltage": 6,
                             "negative": 1}
    assert machine.gap["reference"][0] == reference(96)
    assert machine.gap["presets"] == (4, 5, 6), "the condition's own"
    assert machine.gap["step"] == 20
    machine.line(assign("fluid_mode", 1))
    machine.event("fluid_class", 2, 2 << 4, 2300)
    machine.run(200)
    assert machine.gap["presets"] == (4, 5, 6)
    assert machine.gap["reference"][0] == reference(48)
    run(machine, "G10 C900 X0 Y0 Z0", "C900", "M02")
    assert machine.gap["presets"] == (9, 8, 7), "those of the class, if the row has none"
    assert machine.power["level"] == 3


@pytest.mark.parametrize(("block", "name", "column"), [
    ("G10", "missing", 0), ("G10 C901 P5", "missing", 0), ("G10 C130 I64", "table",
                                                           10), ("G10 C130 I1.5", "table", 10),
    ("G10 C130 P0", "table", 10), ("G10 C130 K2", "table", 10), ("G10 C130 L0", "table", 10),
    ("G10 C130 E40 H50", "table", 5), ("G10 C130 E99", "table", 10), ("G10 C130 X-1", "table", 10),
    ("G10 C130 X256", "table", 10), ("G10 W1 H49", "table", 8),
    ("G10 W4", "table", 5), ("G10 W1 H101", "table", 8), ("G10 C130 D5", "place",
                                                          10), ("G10 C130 M03", "place", 10),
    ("G10 C130 J6", "table", 10), ("G10 C130 J-1", "table", 10), ("G10 C130 W0", "table", 10),
    ("G10 C130 W256", "table", 10), ("G10 C130 S16", "table", 10), ("G10 C130 F8", "table", 10),
    ("G10 C130 F1.5", "table", 10), ("G10 C130 T1000001", "table", 10),
    ("G10 W1 J1", "place", 8), ("G10 W1 F1", "place", 8),
])
def test_rows_that_make_no_sense_are_refused(machine, block, name, column):
    kept = machine.gap
    lines = machine.line(block)
    assert lines[-1] == error_line(name)
    assert (f"character {column}:" in lines[0]) == (column > 0)
    assert machine.gap == kept


def rules(machine):
    """How pulses are counted and judged, by the condition in force."""
    return machine.gap["counting"], machine.gap["criteria"], machine.gap["delay_least"]


USUAL = (0, 50, 1), 0, 0


def test_rules_of_counting_and_judging_follow_the_settings(machine):
    run(machine, "C130", "M02")
    assert rules(machine) == USUAL
    for mode in range(6):
        assert machine.line(assign("servo_mode", mode)) == ["ok"]
        assert rules(machine) == ((mode, 50, 1), 0, 0)
    machine.line(assign("servo_window", 255))
    machine.line(assign("servo_weight", 0))
    assert rules(machine) == ((5, 255, 0), 0, 0)
    for criteria in range(8):
        assert machine.line(assign("criteria", criteria)) == ["ok"]
        assert rules(machine) == ((5, 255, 0), criteria, 0)
    machine.line(assign("delay_least_ns", 4000))
    assert rules(machine) == ((5, 255, 0), 7, 8)
    machine.line(assign("delay_least_ns", 1_000_000))
    assert rules(machine) == ((5, 255, 0), 7, 2000)


def test_settings_of_counting_wait_for_the_pulse(machine):
    run(machine, "C130", "M02")
    machine.library.gk_pulse_lasts(1)
    assert machine.line(assign("servo_mode", 2)) == ["ok"]
    assert machine.line(assign("servo_window", 40)) == ["ok"]
    machine.run(50)
    assert rules(machine) == USUAL
    machine.library.gk_pulse_lasts(0)
    machine.run(50)
    assert rules(machine) == ((2, 40, 1), 0, 0)


@pytest.mark.parametrize(("words", "found"), [
    ("J0", USUAL), ("J1", ((1, 50, 1), 0, 0)), ("J2 W255", ((2, 255, 1), 0, 0)),
    ("J2 W1", ((2, 1, 1), 0, 0)), ("J3 S0", ((3, 50, 0), 0, 0)), ("J3 S15", ((3, 50, 15), 0, 0)),
    ("J4", ((4, 50, 1), 0, 0)), ("J5", ((5, 50, 1), 0, 0)), ("F1", ((0, 50, 1), 1, 0)),
    ("F2 T4000", ((0, 50, 1), 2, 8)), ("F6 T1000000", ((0, 50, 1), 6, 2000)), ("F0", USUAL),
])
def test_a_tape_chooses_how_pulses_are_counted_and_judged(machine, words, found):
    done = run(machine, f"G10 C900 I1 P40 Q40 {words}", "C900", "M02")
    assert not events(done, "alarm")
    assert rules(machine) == found
    assert machine.power["on"] == 80
    assert not events(done, "aux"), "S and T are not for the machine side here"
    run(machine, "C130", "M02")
    assert rules(machine) == USUAL, "another condition has the settings"


def test_words_of_a_condition_go_before_settings(machine):
    settings = {"servo_mode": 1, "servo_window": 30, "servo_weight": 3, "criteria": 6,
                "delay_least_ns": 5000}
    for name, value in settings.items():
        machine.line(assign(name, value))
    run(machine, "G10 C900 I1 P40 Q40 J0 S0 F0 T0", "C900", "M02")
    assert rules(machine) == ((0, 30, 0), 0, 0)
    # A word that is missing keeps its value; a setting holds for what no word has chosen.
    assert machine.line("G10 C900 W70") == ["ok"]
    assert machine.line("C900")[-1] == "ok"
    assert rules(machine) == ((0, 70, 0), 0, 0)
    for name in settings:
        machine.line(assign(name, settings[name] + 1))
    assert rules(machine) == ((0, 70, 0), 0, 0)
    run(machine, "C130", "M02")
    assert rules(machine) == ((2, 31, 4), 7, 11), "5001 ns begin an eleventh clock"


def test_rules_switch_with_the_depth(machine):
    run(machine, "G10 C900 I1 P40 Q40 J5 Z30 F4", DATA, "C130", "G39 Z-1 C900", "G00 Z-2", "M30")
    assert rules(machine) == ((5, 50, 1), 4, 0)
    assert machine.gap["presets"] == (0, 0, 30)


def test_criteria_stay_while_machining(machine):
    for block in (DATA, "C130", "M08", "M03"):
        assert machine.line(block)[-1] == "ok"
    for setting in (assign("criteria", 2), assign("delay_least_ns", 4000)):
        assert machine.line(setting)[-1] == error_line("busy")
    assert machine.line(assign("servo_mode", 4)) == ["ok"]
    assert rules(machine) == ((4, 50, 1), 0, 0)


def test_no_more_rows_than_there_is_room_for(machine):
    for number in range(16):
        assert machine.line(f"G10 C{900 + number} P1 Q1") == ["ok"]
    assert machine.line("G10 C916 P1 Q1")[-1] == error_line("table")
    assert machine.line("G10 C915 P2") == ["ok"]


NEW = "P40 Q30"     # without these no row is complete


def level(machine, *blocks):
    """Current in force after a tape, or its alarm."""
    found = events(run(machine, *blocks, "M02"), "alarm")
    return f"alarm {found[0][1]}" if found else machine.power["level"]


def test_rows_travel_with_the_tape_that_enters_them(machine):
    assert level(machine, f"G10 C900 I3 {NEW}", "G10 C130 I9", "C900") == 3
    assert machine.line("C130")[-1] == "ok", "kept up to the next program's start"
    assert machine.power["level"] == 9
    assert level(machine, "C130") == 6, "as built in"
    assert level(machine, "C900") == "alarm 133"


def test_rows_entered_by_hand_stay(machine):
    assert machine.line(f"G10 C900 I3 {NEW}") == ["ok"]
    for _ in range(2):
        assert level(machine, "G10 C900 I5 P50", "C900") == 5
        assert machine.power["on"] == 100
        assert level(machine, "C900") == 3
        assert machine.power["on"] == 80
    # A row of the tape that is changed by hand counts as entered by hand as a whole.
    level(machine, "G10 C900 I5 P50")
    assert machine.line("G10 C900 Q60") == ["ok"]
    for _ in range(2):
        assert level(machine, "C900") == 5
        assert (machine.power["on"], machine.power["off"]) == (100, 120)


def test_each_tape_has_the_room_that_lines_by_hand_leave(machine):
    for number in range(10):
        assert machine.line(f"G10 C{900 + number} {NEW}") == ["ok"]
    for first in (910, 920):
        rows = [f"G10 C{first + number} I{number} {NEW}" for number in range(6)]
        assert level(machine, *rows, f"C{first + 5}") == 5
    assert level(machine, *rows, f"G10 C800 {NEW}") == "alarm 139"
    assert machine.line("$X") == ["ok"]
    # A tape's row needs its own room; a row entered by hand in its place does not.
    assert level(machine, *rows[1:], "G10 C909 I7", "C909") == 7
    assert machine.line(f"G10 C800 {NEW}")[-1] == error_line("table")
    assert machine.line("G10 C909 I8") == ["ok"]
    assert machine.line(f"G10 C800 {NEW}") == ["ok"]
    assert level(machine, "C909") == 8


def test_classes_travel_with_the_tape_too(machine):
    assert machine.line("G10 W1 X9") == ["ok"]
    run(machine, "G10 W0 X7", "G10 W1 X8", "C130", "M02")
    assert machine.gap["presets"] == (7, 6, 14)
    run(machine, "C130", "M02")
    assert machine.gap["presets"] == SECOND_PATENT[0]
    machine.line(assign("fluid_mode", 1))
    machine.event("fluid_class", 1, 1 << 4, 3000)
    machine.run(200)
    assert machine.gap["presets"] == (9, 5, 18), "entered by hand"


def test_check_knows_the_rows_entered_by_hand_but_no_other_tapes():
    checker = Checker()
    with_row, without = (punched([*row, "C900", "M02"]) for row in ([f"G10 C900 {NEW}"], []))
    assert not isinstance(checker.check(with_row), Fault)
    assert checker.check(without).name == "condition"
    assert checker.enter(f"G10 C900 {NEW}") == ""
    for _ in range(2):
        assert not isinstance(checker.check(without), Fault)
    checker.forget()
    assert checker.check(without).name == "condition"


def test_servo_is_on_for_feed_motion_alone(machine):
    machine.library.gk_speed(2)
    rows = punched([DATA, "C130", "G04 P200", "G95 P1", "M03", "G01 Z-.1 F60", "G00 Z.1",
                    "G01 Z-.2", "G94 Z-.3", "M05", "M02"])
    seen = []
    machine.tape(rows, passes=0)
    for _ in range(6000):
        machine.run(1)
        state = machine.gap["servo"], machine.axes[2]
        if not seen or seen[-1][0] != state[0]:
            seen.append(state)
    assert seen == [(0, 0), (1, 0), (0, -1000), (1, 1000), (0, -2000)]


def test_servo_without_discharge_pulses_is_refused(machine):
    lines = run(machine, DATA, "C130", "G95 P1", "G01 Z-1 F60", "M02")
    assert events(lines, "alarm")[0][1:] == [
        str(alarm_number("mode")), "Block 5: under servo (G95) there is no way without M03."]
    assert machine.axes[2] == 0


def test_a_long_way_without_a_discharge_is_an_alarm(machine):
    machine.line(assign("no_discharge_um", 500))
    machine.library.gk_speed(15)
    machine.tape(punched([DATA, "C130", "G95 P1", "M03", "G01 Z-2 F60", "M02"]), passes=150)
    assert "discharge" in machine.flags
    machine.library.gk_discharges(1)
    at = -machine.axes[2]
    assert at > 0
    lines = machine.run(4000)
    assert events(lines, "alarm")[0][1:] == [
        str(alarm_number("no_discharge")), "Block 6: no discharge on the last 500 um of the way."]
    assert 5000 < -machine.axes[2] - at < 5000 + 2 * 30 * 4
    assert "discharge" not in machine.flags


@pytest.fixture
def stuck(machine):
    """Standing still under servo within a path; one second without progress is allowed."""
    machine.line(assign("no_progress_s", 1))
    machine.library.gk_speed(30)
    machine.tape(punched([DATA, "C130", "G95 P1", "M03", "G01 Z-2 F60", "M05", "M02"]), passes=250)
    machine.library.gk_speed(0)
    assert "discharge" in machine.flags
    assert 0 < -machine.axes[2] < 20_000
    return machine


def no_progress(machine, seconds):
    """Whether so long brings the alarm."""
    found = events(machine.run(round(seconds * SECOND)), "alarm")
    assert [alarm[1:] for alarm in found] in ([], [
        [str(alarm_number("no_progress")),
         "Block 6: no progress in 1 s of machining at the front."]])
    return bool(found)


def test_a_long_time_without_progress_is_an_alarm(stuck):
    at = stuck.axes[2]
    assert not no_progress(stuck, 0.99)
    assert no_progress(stuck, 0.02)
    assert "discharge" not in stuck.flags
    assert stuck.axes[2] == at
    assert stuck.line("G00 Z1")[-1] == error_line("locked")


def test_back_and_forth_is_no_progress_but_a_pulse_further_is(stuck):
    for _ in range(9):
        stuck.library.gk_go(-50)
        assert not no_progress(stuck, 0.05)
        stuck.library.gk_go(50)
        assert not no_progress(stuck, 0.05)
    stuck.library.gk_go(1)
    assert not no_progress(stuck, 0.99)
    assert no_progress(stuck, 0.02)


def test_without_a_bound_the_servo_may_stand_for_ever(machine):
    assert machine.line(assign("no_progress_s", 0)) == ["ok"]
    machine.library.gk_speed(30)
    machine.tape(punched([DATA, "C130", "G95 P1", "M03", "G01 Z-2 F60", "M02"]), passes=250)
    machine.library.gk_speed(0)
    assert not no_progress(machine, 5)


def test_hold_and_retraction_are_no_time_at_the_front(stuck):
    assert not no_progress(stuck, 0.9)
    stuck.send(b"!")
    assert not no_progress(stuck, 2)
    stuck.send(b"~")
    for name in ("retracting", "at_limit", "high", "low", "stopping"):
        stuck.state(name)
        assert not no_progress(stuck, 2)
    stuck.state("front")
    assert not no_progress(stuck, 0.05)
    assert no_progress(stuck, 0.1), "what was counted before counts"


@pytest.mark.parametrize("blocks", [
    ("M03", "G01 Z-.1 F60", "G04 X3"), ("M03", "G01 Z-.1 F60", "M00"),
    ("M03", "G01 Z-.1 F60 M05", "G04 X3"), ("G04 X3", "M03"), ("M03", "G04 X3"),
    ("M03", "G94", "G01 Z-20 F60"), ("M03", "G01 Z-.1 F60", "G00 Z-20"),
], ids=["dwell", "pause", "after M05", "before M03", "before the way", "G94", "G00"])
def test_no_alarm_where_the_servo_has_no_way_to_go(machine, blocks):
    machine.line(assign("no_progress_s", 1))
    machine.library.gk_speed(30)
    machine.tape(punched([DATA, "C130", "G95 P1", *blocks, "M02"]), passes=300)
    machine.library.gk_speed(0)
    assert not no_progress(machine, 2.5)
    assert not events(machine.lines, "alarm", "end")


@pytest.mark.parametrize(("flag", "words"), [
    (BROKEN_LOW, "shorted wire"), (BROKEN_HIGH, "open circuit"),
    (DISORDERED, "out of order"), (SILENT, "converter does not answer"),
])
def test_trouble_with_the_cell_stops_the_machine_if_it_is_in_use(machine, flag, words):
    machine.event("fluid_class", 0, flag, 0)
    assert not events(machine.run(200), "alarm"), "the class is set by hand"
    machine.line(assign("fluid_mode", 1))
    machine.event("fluid_class", 0, flag, 0)
    alarm, = events(machine.run(200), "alarm")
    assert alarm[1] == str(alarm_number("fluid"))
    assert words in alarm[2]
    machine.unlock()
    machine.library.gk_fluid(flag)
    lines = run(machine, DATA, "C130 M03", "G01 Z-1 F6", "M02")
    assert words in events(lines, "alarm")[0][2], "nor is machining begun"
    assert machine.axes[2] == 0


def test_machining_waits_until_the_class_is_known(machine):
    machine.line(assign("fluid_mode", 1))
    machine.library.gk_fluid(0)
    run(machine, DATA, "C130 M03", "G01 Z-1 F6", "M02")
    assert machine.axes[2] == 0
    assert "discharge" not in machine.flags
    machine.library.gk_fluid(KNOWN | 3 << 8)
    machine.run(4000)
    assert machine.axes[2] == -10_000
    assert machine.gap["presets"] == SECOND_PATENT[3], "whatever became of its event"


def test_halt_of_the_servo_has_its_sentence(machine):
    machine.library.gk_speed(7)
    machine.tape(punched([DATA, "G01 Z-1 F6", "M02"]), passes=60)
    machine.event("halt", 5)
    assert events(machine.run(200), "alarm")[0][1:] == [
        str(alarm_number("halt_servo")),
        "Block 3: the servo would go back beyond the retractable limit or the ceiling or the "
        "soft limit."]


def test_end_of_machining_in_the_block_of_the_motion_acts_after_it(machine):
    lines = run(machine, DATA, "C130", "G95 P1", "M03", "G01 Z-.1 F60 M05", "M02")
    assert not events(lines, "alarm")
    assert machine.axes[2] == -1000


def test_servo_needs_retraction_data(machine):
    lines = run(machine, "C130", "G95 P1", "M03", "G01 Z-1 F60", "M02")
    assert events(lines, "alarm")[0][1:] == [
        str(alarm_number("retraction")), "Block 5: G95 needs retraction data (G36) before it."]


def test_measuring_with_a_detector_that_was_known_to_be_broken_is_an_alarm(machine):
    machine.line(assign("fluid_mode", 2))
    for text in (DATA, "C130", "M03"):
        assert machine.line(text)[-1] == "ok"
    machine.library.gk_fluid(SILENT)
    machine.event("fluid_class", 0, SILENT, 0)
    assert not events(machine.run(200), "alarm")
    assert "discharge" in machine.flags
    assert machine.line(assign("fluid_mode", 1))[-1] == error_line("busy"), "it guards the machine"
    for text in ("M05", assign("fluid_mode", 1)):
        assert machine.line(text)[-1] == "ok"
    assert events(machine.line("M03"), "alarm")[0][1] == str(alarm_number("fluid"))
    assert "discharge" not in machine.flags
