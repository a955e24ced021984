# SPDX-License-Identifier: Apache-2.0
"""Conditions whose on-time counts from the ignition, as firmware judges and writes them."""

import pytest

from softcore.tables.faults import error_line
from softcore.tables.settings import assign

PATH = 4        # clocks of the pads, 2 us at 2 MHz
NEW = "I1 P40 Q60"


def enter(machine, *rows):
    """Put the condition C900 in force after rows of it."""
    for row in rows:
        assert machine.line(f"G10 C900 {row}") == ["ok"]
    assert machine.line("C900")[-1] == "ok"
    return machine.power["on"], machine.power["wait"], machine.power["off"]


def test_the_on_time_counts_from_the_gate_by_default(machine):
    assert enter(machine, NEW) == (80, 0, 120)
    assert enter(machine, "A0") == (80, 0, 120)


def test_from_the_ignition_the_pads_delay_is_subtracted(machine):
    assert enter(machine, f"{NEW} A1") == (80 - PATH, 80, 120)
    machine.line(assign("ignition_lag_ns", 1400))
    assert machine.power["on"] == 80 - PATH - 3, "a setting changes the condition in force, too"
    assert machine.power["wait"] == 80


def test_the_wait_is_as_long_as_the_on_time_or_its_own(machine):
    assert enter(machine, f"{NEW} A1")[1] == 80
    assert enter(machine, "P50")[1] == 100
    assert enter(machine, "B70")[1] == 140
    assert enter(machine, "P60")[1] == 140
    assert enter(machine, "B0")[1] == 120
    assert enter(machine, "B70", "A0")[1] == 0
    assert enter(machine, "A1")[1] == 120, "A0 has forgotten B"


def test_a_capacitor_is_charged_for_at_most_the_on_time(machine):
    """The ignition ends the pulse; how it is judged follows with the condition."""
    assert enter(machine, f"{NEW} A2") == (1, 80, 120)
    assert machine.gap["criteria"] == 8
    assert enter(machine, "F1") == (1, 80, 120)
    assert machine.gap["criteria"] == 9
    assert enter(machine, "P70")[:2] == (1, 140)
    assert enter(machine, "A1 B50 F0") == (140 - PATH, 100, 120)
    assert machine.gap["criteria"] == 0
    assert enter(machine, "A2")[1] == 140, "A2 has forgotten B"
    assert enter(machine, "A0") == (140, 0, 120)


@pytest.mark.parametrize(("row", "column", "said"), [
    (f"{NEW} B50", 21, "the longest wait B needs A1, the on-time from the ignition"),
    (f"{NEW} A0 B50", 24, "the longest wait B needs A1, the on-time from the ignition"),
    (f"{NEW} A3", 21, "where the on-time counts from"),
    (f"{NEW} A2 B50", 24, "the longest wait B needs A1, the on-time from the ignition"),
    ("I1 P1001 Q60 A2", 0, "must not be above 2000 us together"),
    (f"{NEW} A1 B2001", 24, "the longest wait for the ignition"),
    ("I1 P1001 Q60 A1", 0, "must not be above 2000 us together"),
    ("I1 P1000 Q60 A1 B1001", 26, "must not be above 2000 us together"),
])
def test_what_is_refused_by_name(machine, row, column, said):
    line, answer = machine.line(f"G10 C900 {row}")
    assert answer in (error_line("table"), error_line("number")), line
    assert said in line
    assert f"character {column}:" in line or not column, line


def test_the_longest_pulse_is_taken(machine):
    assert enter(machine, "I1 P1000 Q60 A1") == (2000 - PATH, 2000, 120)
    assert enter(machine, "P10 B1990") == (20 - PATH, 3980, 120)


def test_a_pulse_must_be_seen(machine):
    """The gap is not observed for 1000 ns from an ignition, and for 3000 ns from a pulse's start.

    At 2 MHz these are 2 and 6 clocks.
    """
    assert machine.line("G10 C900 I1 P3 Q40 A1 B4") == ["ok"]
    assert machine.line("C900")[-1] == "ok", "3 us are 6 clocks: 4 of the pads and 2 to settle"
    assert machine.power["on"] == 2
    assert machine.line("G10 C900 P2") == ["ok"]
    assert machine.line("C900") == [
        "[MSG:MDI, character 1: a discharge of C900 takes 2 us and is sampled after 6 clocks only "
        "($480, $427).]", error_line("condition")]
    assert machine.line("G10 C900 P3 B3") == ["ok"]
    assert machine.line("C900") == [
        "[MSG:MDI, character 1: a pulse of C900 waits 3 us for its ignition, and the gap is "
        "sampled after 3000 ns only ($404).]", error_line("condition")]


def test_machining_does_not_begin_unseen(machine):
    enter(machine, "I1 P3 Q40 A1 B4")
    machine.line(assign("ignition_lag_ns", 500))
    assert machine.line("M03")[-1] == error_line("condition")
    machine.line(assign("ignition_lag_ns", 0))
    assert machine.line("M03")[-1] == "ok"


def test_the_mean_without_discharges_follows_the_wait(machine):
    """References are below it: 80 V x wait / (wait + off)."""
    assert machine.line("G10 C900 I1 P20 Q60 E80 A1 V19.9") == ["ok"]
    assert machine.line("G10 C900 B60 V39.9") == ["ok"]
    assert machine.line("G10 C900 V40")[-1] == error_line("table")
    assert machine.line("C900")[-1] == "ok"
    assert machine.feed_mode["no_load"] == int(40 * 65536 / 100)


@pytest.mark.parametrize("block", ["G01 X1 A5 F5", "A1", "G10 W1 A1", "C130 B5", "G00 X1 B2"])
def test_elsewhere_both_words_are_unknown(machine, block):
    line, answer = machine.line(block)
    letter = "A" if "A" in block else "B"
    assert f"the word {letter} is unknown" in line
    assert answer == error_line("unknown")


def test_built_in_conditions_for_wire(machine):
    """520 and 530 are 500 and 510 from the ignition."""
    assert machine.line("C520")[-1] == "ok"
    assert (machine.power["on"], machine.power["wait"], machine.power["off"]) == (10 - PATH, 40, 80)
    assert machine.line("C530")[-1] == "ok"
    assert (machine.power["on"], machine.power["wait"], machine.power["off"]) == (6 - PATH, 30, 60)
    assert (machine.power["level"], machine.power["negative"]) == (2, 1)
