# SPDX-License-Identifier: Apache-2.0
"""The doctor's judgement of inputs, comparators, digests and clock, without a machine."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from host.doctor import identity
from host.doctor.comparators import LADDER, Seen, apart, judged, levels_around, seen
from host.doctor.levels import Build, Inputs, open_guards, resting
from host.scope.record import LEVELS, Record
from softcore.build import BOARDS, gateware_digest

BOARD = BOARDS["ulx3s"]
SOUND = Inputs.of("[INPUTS:0,0,2000,16]")
QUIET = replace(SOUND, levels=SOUND.levels | {"gap_arc": 1, "gap_short": 1})


def test_a_line_is_decoded_by_the_registers_bits():
    word = 1 | 5 << 1 | 2 << 4 | 1 << 10 | 1 << 21 | 1 << 24
    told = Inputs.of(f"[INPUTS:{word},983,40,24]")
    assert {name: level for name, level in told.levels.items() if level} == {
        "estop": 1, "drive_fault": 5, "limit_low": 2, "fluid_low": 1, "gap_short": 1,
        "adc_data": 1}
    assert (told.voltage, told.cell, told.silent) == (983, 40, True)
    assert not Inputs.of("[INPUTS:0,0,0,23]").silent


def test_each_bit_of_an_open_guard_is_named():
    levels = QUIET.levels | {"limit_high": 6, "drive_fault": 1, "estop": 1}
    assert [one.wire for _, one in open_guards(BOARD, replace(QUIET, levels=levels))] == [
        "estop", "drive_fault[0]", "limit_high[1]", "limit_high[2]"]


def test_a_sound_machine_at_rest_has_nothing_wrong():
    assert list(resting(BOARD, QUIET)) == []


@pytest.mark.parametrize(("pad", "level", "named"), [
    ("fin", 1, {"fin"}), ("arm", 1, {"arm"}), ("gap_noise", 1, {"gap_noise"}),
    ("gap_current", 1, {"gap_current", "gap_on", "gap_sense"}),
    ("gap_high", 1, {"gap_high", "gap_reference[0]"}),
    ("gap_arc", 0, {"gap_arc", "gap_reference[1]"}),
    ("gap_short", 0, {"gap_short", "gap_reference[2]"})])
def test_each_level_that_does_not_belong_there_is_one_finding(pad, level, named):
    (_, _, places), = resting(BOARD, replace(QUIET, levels=QUIET.levels | {pad: level}))
    assert {one.wire for one in places} == named


def test_a_voltage_at_rest_accuses_the_gates_and_not_the_comparators():
    inputs = replace(QUIET, voltage=983, levels=QUIET.levels | {"gap_short": 0})
    (check, said, places), = resting(BOARD, inputs)
    assert check == "gap voltage"
    assert said.startswith("24 %")
    assert {one.wire for one in places} == {"gap_on", "gap_sense"}


def sweep(voltage, *, shown=None, high=None, arc=None):
    """Both comparators at the levels around a voltage; the others' behaviour may be given."""
    first = Seen(1023, voltage if shown is None else shown, False, True)
    return [Seen(level, first.voltage, (high or (lambda at: voltage > at))(level),
                 (arc or (lambda at: voltage < at))(level)) for level in levels_around(first)]


@pytest.mark.parametrize("voltage", [8, 40, 246, 500])
def test_sound_comparators_change_sides_at_the_converters_reading(voltage):
    sound, said, places = judged(BOARD, sweep(voltage))
    assert sound, said
    assert places == []
    assert f"{100 * voltage / 1024:.1f} %" in said


@pytest.mark.parametrize("voltage", [0, 3])
def test_without_a_converter_they_are_judged_by_each_other(voltage):
    assert [one.level for one in sweep(246, shown=voltage)] == list(LADDER)
    assert judged(BOARD, sweep(246, shown=voltage))[0]
    shifted = sweep(246, shown=voltage, arc=lambda level: level > 40)
    sound, _, places = judged(BOARD, shifted)
    assert not sound
    assert {one.wire for one in places} == {
        "gap_high", "gap_arc", "gap_reference[0]", "gap_reference[1]"}


@pytest.mark.parametrize("shown", [246, 0])
@pytest.mark.parametrize("stuck", [False, True])
@pytest.mark.parametrize(("which", "named"), [
    ("high", {"gap_high", "gap_reference[0]"}), ("arc", {"gap_arc", "gap_reference[1]"})])
def test_a_comparator_that_never_changes_is_named(shown, stuck, which, named):
    sound, _, places = judged(BOARD, sweep(246, shown=shown, **{which: lambda level: stuck}))
    assert not sound
    assert {one.wire for one in places} == named


def test_a_level_that_is_off_by_a_third_is_named():
    sound, said, places = judged(BOARD, sweep(246, high=lambda level: level < 300 * 4 / 3))
    assert not sound, said
    assert {one.wire for one in places} == {"gap_high", "gap_reference[0]"}


@pytest.mark.parametrize(("sides", "sound"), [
    ([(True, True), (False, False)], True), ([(False, False), (True, True)], False),
    ([(True, True), (True, False)], False), ([(True, False), (False, False)], False)])
def test_exchanged_levels_are_seen_with_one_below_and_one_above(sides, sound):
    """First the level of gap_high is below the voltage, then that of gap_arc."""
    ways = [(below, Seen(100, 246.0, *side)) for below, side in zip((True, False), sides,
                                                                   strict=True)]
    assert {one.wire for one in apart(BOARD, ways)} == (set() if sound else {
        "gap_high", "gap_arc", "gap_reference[0]", "gap_reference[1]"})


def test_a_comparator_that_goes_back_is_named():
    ways = itertools.cycle((True, False))
    assert not judged(BOARD, sweep(246, high=lambda level: next(ways)))[0]


def record(sense, **levels):
    """A record with a sample in every entry; levels not given are low."""
    count = len(sense)
    codes = levels.pop("code", [0] * count)
    return Record(2_000_000, 0, 0, np.arange(count), np.array(codes) / 40.96, np.array(codes),
                  {name: np.array(levels.get(name, [0] * count), bool) for name in LEVELS}
                  | {"sense": np.array(sense, bool)}, np.zeros(count, int), np.zeros(count, int))


def test_a_record_tells_the_sides_at_the_end_of_each_pulse():
    found = seen(record([0, 1, 1, 0, 1, 1, 0, 1], high=[1, 0, 1, 0, 0, 1, 0, 0],
                        arc=[0, 1, 0, 1, 1, 0, 1, 1], code=[0, 0, 984, 0, 0, 900, 0, 0]), 200)
    assert found == Seen(200, 246, high=True, arc=False)


@pytest.mark.parametrize("sense", [[0, 0, 0], [1, 1, 1], [0, 1, 1]])
def test_a_record_without_the_end_of_a_pulse_tells_nothing(sense):
    assert seen(record(sense), 200) is None


def test_the_clock_count_wraps():
    assert Build(1, 2, 2**32 - 5).clocks_to(Build.of("[BUILD:1,2,7]")) == 12


class Patient:
    """A controller that tells its builds, one after the other, a second apart."""

    def __init__(self, *builds, board=BOARD):
        self.board, self.found, self.builds, self.answered_s = board, {}, list(builds), 0.0

    def build(self):
        self.answered_s += 1
        return self.builds.pop(0)

    def listen(self, seconds):
        pass

    def find(self, check, ok, said, places=()):
        self.found[check] = ok, said


OWN, HZ = int(gateware_digest(BOARD)[:8], 16), BOARD.clock_hz


@pytest.mark.parametrize(("gateware", "told_hz", "counted_hz", "found"), [
    (OWN, HZ, HZ, (True, True)), (OWN ^ 1, HZ, HZ, (False, True)),
    (OWN, HZ, HZ * 1.019, (True, True)), (OWN, HZ, HZ * 1.021, (True, False)),
    (OWN, HZ, HZ / 1.3, (True, False)), (OWN, HZ // 2, HZ // 2, (True, False))])
def test_gateware_and_clock_are_compared(gateware, told_hz, counted_hz, found):
    start = 2**32 - 1000
    patient = Patient(Build(gateware, told_hz, start),
                      Build(gateware, told_hz, (start + round(counted_hz)) % 2**32))
    assert identity.gateware(patient, BOARD.memory_size)
    assert tuple(ok for ok, _ in patient.found.values()) == found


def test_gateware_of_another_board_is_named_though_it_has_the_same_memory_and_clock():
    other = BOARDS["colorlight_i9"]
    beside = BOARDS["ulx3s_45f"]
    assert (other.memory_size, other.clock_hz) == (beside.memory_size, beside.clock_hz)
    there = int(gateware_digest(other)[:8], 16)
    patient = Patient(Build(there, HZ, 0), Build(there, HZ, HZ), board=beside)
    assert not identity.gateware(patient, beside.memory_size)
    ok, said = patient.found["gateware"]
    assert not ok
    assert "for colorlight_i9, not for ulx3s_45f: give the board that is there by --board" in said


def test_another_memory_than_the_boards_tells_of_another_board():
    patient = Patient(Build(OWN, HZ, 0), Build(OWN, HZ, HZ))
    identity.gateware(patient, BOARDS["colorlight_i9"].memory_size)
    assert [check for check, (ok, _) in patient.found.items() if not ok] == ["board"]


def test_a_simulation_has_no_digest_and_any_clock():
    patient = Patient(Build(0, 2_000_000, 0))
    identity.gateware(patient, 1)
    assert patient.found["gateware"][0]
    assert len(patient.found) == 1


@pytest.mark.parametrize("line", ["", "[BUILD:1,2]", "[BUILD:1,2,x]", "[BUILD:1,2,3", "[INPUTS:1]",
                                  "[INPUTS:1,2,3,4,5]", "[INPUTS:1,2,-3,4]"])
def test_a_damaged_line_is_none(line):
    assert Build.of(line) is None
    assert Inputs.of(line) is None


@pytest.mark.parametrize("board", BOARDS.values(), ids=list(BOARDS))
def test_every_board_has_all_wires_that_may_be_named(board):
    """The worst of all machines: everything is wrong at once, with a voltage and without."""
    worst = Inputs({name: 0 if name in ("gap_arc", "gap_short") else (1 << 3) - 1 if name in (
        "drive_fault", "limit_low", "limit_high", "enc_a", "enc_b") else 1
        for name in QUIET.levels}, 0, 0, silent=True)
    found = [*open_guards(board, worst), *resting(board, worst)]
    assert len(found) == 11 + 8
    assert {check for check, *_ in resting(board, replace(worst, silent=False, voltage=983))} == {
        "fin", "arm", "gap voltage"}
    assert not judged(board, [Seen(level, None, high=False, arc=False) for level in LADDER])[0]


def test_gateware_that_does_not_know_the_question_is_old():
    patient = Patient(None)
    identity.gateware(patient, 0)
    assert not patient.found["gateware"][0]
    assert "load a bitstream" in patient.found["gateware"][1]
