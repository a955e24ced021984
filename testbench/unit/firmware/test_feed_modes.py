# SPDX-License-Identifier: Apache-2.0
"""The feed modes of G95, as firmware writes them to the gateware."""

import pytest

from softcore.tables.faults import alarm_number
from softcore.tables.settings import assign
from testbench.firmware import events
from testbench.programs import punched

CLOCK_HZ = 2_000_000
DATA = "G36 R300 L.5 H600 E60 Q.1"
ROW = "G10 C900 I1 P20 Q60 E80 V12.5 U3.25"     # 20 V without discharges
SILENT = 8


def level(volts):
    """2**-16 of the converter's full scale, 100 V."""
    return int(volts * 65536 / 100)


def rate(um_per_min):
    """2**-32 pulse/clock."""
    return round(um_per_min * 10 / 60 / CLOCK_HZ * 2**32)


def under(machine, mode, *, passes=4000, more=()):
    """Begin a long way in a feed mode; the machine is slow."""
    machine.library.gk_speed(1)
    machine.tape(punched([DATA, ROW, *more, "C900", f"G95 P{mode}", "M03", "G01 Z-1 F60", "M02"]),
                 passes=passes)


def first_alarm(lines):
    """Code and sentence."""
    _, code, *parts = events(lines, "alarm")[0]
    return [code, ",".join(parts)]


@pytest.mark.parametrize("mode", [1, 2, 3, 4, 5])
def test_a_mode_brings_references_and_settings(machine, mode):
    under(machine, mode)
    assert machine.gap["servo"] == (mode == 1)
    assert machine.gap["convert"] == (mode != 1)
    found = machine.feed_mode
    if mode == 1:
        of_the_condition = {"no_load", "voltage", "drop", "share"}
        assert not any(found[name] for name in found.keys() - of_the_condition)
        return
    assert (found["mode"], found["measure"]) == (min(mode, 4) - 1, 1)
    assert found["shares"] == (mode == 5)
    assert found["voltage"] == level(12.5)
    assert found["drop"] == level(3.25)
    assert found["no_load"] == level(20), "off-time included"
    assert found["share"] == int(3.25 / 80 * 65536), "a discharge takes all of the 80 V"
    assert found["least"] == (1 if mode == 5 else level(0.2))
    assert (found["lowest"], found["highest"]) == (1024, 16384)
    assert found["fastest"] == pytest.approx(rate(1_800_000), abs=1)
    if mode in (2, 3):
        assert (found["unit"], found["window"]) == (0, CLOCK_HZ // 50)
        assert found["gain"] == pytest.approx(rate({2: 500, 3: 100}[mode] * 6.25), abs=1)
    if mode == 4:
        assert (found["unit"], found["window"]) == (100, CLOCK_HZ)
    if mode == 5:
        assert (found["unit"], found["window"]) == (200, CLOCK_HZ)


def test_the_mode_is_on_for_feed_motion_alone(machine):
    machine.library.gk_speed(2)
    rows = punched([DATA, ROW, "C900", "G04 P200", "G95 P4", "M03", "G01 Z-.1 F60", "G00 Z.1",
                    "G95 P2", "G01 Z-.2", "G95 P3", "Z-.3", "G94 Z-.4", "M05", "M02"])
    seen = []
    machine.tape(rows, passes=0)
    for _ in range(9000):
        machine.run(1)
        state = machine.feed_mode["mode"], machine.axes[2]
        if not seen or seen[-1][0] != state[0]:
            seen.append(state)
    assert seen == [(0, 0), (3, 0), (0, -1000), (1, 1000), (2, -2000), (0, -3000)]
    assert machine.gap["convert"] == 0


@pytest.mark.parametrize(("blocks", "name", "words"), [
    (["C130", "G95 P2"], "condition",
     "character 1: G95 P2 needs a reference voltage Vs, V of G10, which "
                             "the condition C130 does not have."),
    (["G95 P5", "C130"], "condition",
     "character 1: G95 P5 needs a reference drop Es, U of G10, which the condition C130"),
    (["G95 P4", "C130"], "condition",
     "character 1: G95 P4 needs a reference drop Es, U of G10, which the "
                             "condition C130 does not have."),
    (["G10 C130 U5", "C130 G95 P3"], "condition",
     "character 6: G95 P3 needs a reference voltage Vs"),
    ([DATA, ROW, "C900 G95 P4 M03", "G01 Z-1 F60", "C130", "Z-2"], "condition",
     "Block 6, character 1: G95 P4 needs"),
    ([DATA, ROW, "C900 G95 P4", "G01 Z-1 F60"], "mode",
     "Block 5: under servo (G95) there is no way"),
    ([ROW, "C900 G95 P4 M03", "G01 Z-1 F60"], "retraction", "Block 4: G95 needs retraction data"),
    ([ROW, "G10 C900 P1"], "table", "Block 3: the reference V must be below the mean without "
                               "discharges, 1311 mV"),
    (["G10 C900 P20 Q60 U20"], "table",
     "the reference U must be below the mean without discharges, "
                                   "20000 mV"),
    ([ROW, "G10 C900 V0", "C900 G95 P2"], "condition", "needs a reference voltage"),
])
def test_a_mode_without_what_it_needs_is_refused(machine, blocks, name, words):
    told, said = first_alarm(machine.tape(punched([*blocks, "M02"]), passes=4000))
    assert told == str(alarm_number(name))
    assert words in said


def test_bounds_of_the_ratio_that_exclude_each_other_are_refused(machine):
    machine.line(assign("feed_mode_ratio_lowest", 4001))
    assert machine.line(ROW) == ["ok"]
    lines = machine.tape(punched(["C900 G95 P3", "G95 P4", "M02"]), passes=4000)
    assert first_alarm(lines) == [
        str(alarm_number("setting")),
        "Block 3, character 1: the lowest ratio Es/Ex of the settings is above the highest."]


@pytest.mark.parametrize("mode", [2, 3, 4, 5])
def test_standing_at_the_front_for_ever_is_an_alarm(machine, mode):
    machine.line(assign("no_progress_s", 1))
    under(machine, mode, passes=300)
    machine.library.gk_speed(0)
    lines = machine.run(3000)
    assert first_alarm(lines) == [str(alarm_number("no_progress")),
                                  "Block 7: no progress in 1 s of machining at the front."]


def test_settings_reach_the_law(machine):
    for line in (assign("feed_mode_unit_um", 25), assign("feed_mode_longest_ms", 50),
                 assign("feed_mode_least_mv", 1000), assign("feed_mode_ratio_lowest", 1000),
                 assign("feed_mode_ratio_highest", 2000)):
        assert machine.line(line) == ["ok"]
    under(machine, 4)
    found = machine.feed_mode
    assert [found[name] for name in ("unit", "window", "least", "lowest", "highest")] == [
        250, CLOCK_HZ // 20, level(1), 4096, 8192]
    assert found["mode"] == 3


def test_the_fluid_takes_its_share_of_the_no_load_voltage(machine):
    machine.line(assign("fluid_mode", 1))
    under(machine, 4)
    machine.event("fluid_class", 3, 3 << 4, 200)
    machine.run(200)
    assert machine.feed_mode["no_load"] == level(20 * 0.75)


def mean(machine, volts, *, opens=0, discharges=0):
    """One more mean, and so many more pulses in its window."""
    machine.library.gk_opens(opens)
    machine.library.gk_discharges(discharges)
    machine.library.gk_mean(level(volts))
    machine.run(20)


def test_the_no_load_voltage_is_measured_while_nothing_discharges(machine):
    machine.line(assign("feed_mode_no_load", 1))
    under(machine, 4)
    machine.library.gk_discharges(1)
    machine.run(20)
    for volts in (5, 18, 18.5):
        assert machine.feed_mode["no_load"] == level(20)
        mean(machine, volts, opens=40)
    assert machine.feed_mode["no_load"] == level(18), "the second window had no discharge at all"
    mean(machine, 3, discharges=1)
    for volts in (4, 17, 17):
        assert machine.feed_mode["no_load"] == level(18), "a discharge begins it anew"
        mean(machine, volts, opens=10)
    assert machine.feed_mode["no_load"] == level(18), "too few pulses"
    mean(machine, 17, opens=60)
    assert machine.feed_mode["no_load"] == level(17)


def test_references_of_a_row_act_from_the_next_g95(machine):
    rows = punched([DATA, ROW, "C900", "G10 C900 V9 U2", "M03", "G95 P2", "G01 Z-.1 F60",
                    "G10 C900 V8", "G01 Z-1", "M02"])
    machine.library.gk_speed(1)
    machine.tape(rows, passes=6000)
    assert machine.feed_mode["voltage"] == level(9)
    assert machine.feed_mode["drop"] == level(2)
    assert machine.feed_mode["no_load"] == level(20)


def test_the_no_load_voltage_is_computed_otherwise(machine):
    under(machine, 4)
    for _ in range(6):
        mean(machine, 15, opens=100)
    assert machine.feed_mode["no_load"] == level(20)


@pytest.mark.parametrize("mode", [1, 2, 3, 4])
def test_a_silent_converter_stops_the_machine_if_it_is_in_use(machine, mode):
    under(machine, mode)
    assert "discharge" in machine.flags
    machine.library.gk_fluid(SILENT)
    lines = machine.run(200)
    if mode == 1:
        assert not events(lines, "alarm")
    else:
        assert first_alarm(lines) == [str(alarm_number("fluid")),
                                      "Block 7: the converter does not answer."]
    assert ("discharge" in machine.flags) == (mode == 1)


def test_a_cell_that_is_not_there_does_not_matter(machine):
    under(machine, 4)
    machine.event("fluid_class", 0, 2, 4095)
    assert not events(machine.run(200)), "nor is it told"


def voltage(machine, rows):
    """Reference voltage in the gateware when a tape has begun to move; and the lines sent."""
    machine.library.gk_speed(1)
    lines = machine.tape(punched([DATA, *rows, "M03", "G01 Z-.1 F5", "M02"]), passes=4000)
    return machine.feed_mode["voltage"], lines


def test_a_condition_is_under_the_mode_that_it_was_judged_for(machine):
    """A tape's row may replace a row entered by hand whose condition is in force."""
    assert machine.line("G10 C900 I1 P20 Q60 E80 V12.5") == ["ok"]
    reference, lines = voltage(machine, ["C900", "G10 C900 V0", "G95 P2"])
    assert not events(lines, "alarm")
    assert reference == level(12.5)


def test_a_row_that_changes_between_the_mode_and_the_way_is_judged_again(machine):
    reference, lines = voltage(machine, [ROW, "C900 G95 P2", "G10 C900 V0"])
    assert events(lines, "alarm"), reference
    assert "needs a reference voltage" in first_alarm(lines)[1]


def test_the_discharge_has_a_unit_distance_of_its_own(machine):
    for line in (assign("feed_mode_unit_um", 25), assign("feed_mode_discharge_um", 8)):
        assert machine.line(line) == ["ok"]
    under(machine, 5)
    assert machine.feed_mode["unit"] == 80


@pytest.mark.parametrize(("ns", "clocks"), [
    (0, 0), (1, 6), (3000, 6), (4000, 8), (1_000_000, 2000)])
def test_a_short_by_the_current_is_told_to_the_gateware(machine, ns, clocks):
    assert machine.gap["short_current"] == 0
    assert machine.line(assign("short_current_ns", ns)) == ["ok"]
    assert machine.gap["short_current"] == clocks
    if ns == 1:
        assert machine.line(assign("blanking_ns", 0)) == ["ok"]
        assert machine.gap["short_current"] == 1, "no time is rounded to none"


def test_a_short_by_the_mean_voltage_is_told_to_the_gateware_and_needs_the_converter(machine):
    assert (machine.gap["short_mean"], machine.gap["convert"]) == (0, 0)
    assert machine.line(assign("short_mean_mv", 5000)) == ["ok"]
    assert machine.line(assign("short_mean_us", 700)) == ["ok"]
    assert machine.gap["short_mean"] == -(-5 * 4096 // 100), "5 of 100 V, rounded up"
    assert machine.gap["short_mean_time"] == 1400
    assert machine.gap["convert"] == 1
    assert machine.line(assign("short_mean_mv", 1)) == ["ok"]
    assert machine.gap["short_mean"] == 1, "no preset is rounded to none"
    machine.library.gk_fluid(SILENT)
    lines = machine.tape(punched([DATA, ROW, "C900", "M03", "G01 Z-1 F60", "M02"]), passes=4000)
    assert first_alarm(lines)[0] == str(alarm_number("fluid"))
    machine.library.gk_fluid(0)
    assert machine.line(assign("short_mean_mv", 0)) == ["ok"]
    assert (machine.gap["short_mean"], machine.gap["convert"]) == (0, 0)
