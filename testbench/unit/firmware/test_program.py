# SPDX-License-Identifier: Apache-2.0
"""Programs carried out by the firmware on a model machine that follows without lag."""

from itertools import pairwise

import pytest

from softcore.tables.faults import alarm_number, error_line
from softcore.tables.settings import assign
from testbench.firmware import Controller, events
from testbench.programs import damage, program, punched

DATA = "G36 R300 L.5 H600 E60 Q.1"


def names(lines):
    return [event[0] for event in events(lines)]


def run(machine, *blocks, passes=4000):
    return machine.tape(punched(list(blocks)), passes=passes)


def test_program_from_start_to_end(machine):
    lines = run(machine, "O77", DATA, "C130 M08", "M03", "G01 Z-.5 F6", "G00 Z2. M05", "M30")
    assert names(lines) == ["start", "block", "block", "set", "block", "condition", "aux",
                            "block", "aux", "block", "block", "aux", "block", "end"]
    assert events(lines, "start") == [["start", "77"]]
    assert events(lines, "set") == [["set", "300000", "5000", "600000", "60000", "1000", "-", "t"]]
    assert events(lines, "condition") == [["condition", "130", "6000"]]
    assert events(lines, "aux") == [["aux", "M", "8"], ["aux", "M", "3"], ["aux", "M", "5"]]
    assert machine.axes == (0, 0, 20_000)
    assert machine.flags == {"data"}, "no motion and no discharge after the end"


def test_events_carry_line_and_place_in_the_frame_in_force(machine):
    machine.line("G92 X0 Y0 Z.05")
    lines = run(machine, DATA, "G01 X1 Z-1 F600", "G92 X5", "G91 X1", "M02")
    blocks = [line for line in lines if line.startswith("[E:block")]
    assert [line[:-1].split(",")[2:6] for line in blocks] == [
        ["2", "0", "0", "500"], ["3", "0", "0", "500"], ["4", "10000", "0", "-10000"],
        ["5", "50000", "0", "-10000"], ["6", "60000", "0", "-10000"]]


def test_work_offsets_frame_the_events_in_their_turn(machine):
    machine.line("G10 P2 X1 Z-.5")
    lines = run(machine, "G00 X2", "G55 X2", "G10 P2 X.5", "M02")
    blocks = [line for line in lines if line.startswith("[E:block")]
    assert [line[:-1].split(",")[2:6] for line in blocks] == [
        ["2", "0", "0", "0"], ["3", "20000", "0", "0"], ["4", "20000", "0", "5000"],
        ["5", "25000", "0", "5000"]]
    assert machine.axes == (30_000, 0, 0)


def test_offsets_stay_until_power_off_and_are_told(machine):
    machine.line("G10 P6 Y-2.5")
    machine.line("G10 D3 R.125")
    machine.line("G00 X-1.5")
    machine.line("G28.1")
    machine.line("G00 X0")
    machine.line("G92 X-1")
    run(machine, "G59", "M02")
    told = ["[G54:0.0000,0.0000,0.0000]", "[G55:0.0000,0.0000,0.0000]",
            "[G56:0.0000,0.0000,0.0000]", "[G57:0.0000,0.0000,0.0000]",
            "[G58:0.0000,0.0000,0.0000]", "[G59:0.0000,-2.5000,0.0000]",
            "[G28:-1.5000,0.0000,0.0000]", "[G30:0.0000,0.0000,0.0000]",
            "[G92:1.0000,0.0000,0.0000]", "[TLO:0.0000]", "[PRB:0.0000,0.0000,0.0000:0]",
            "[D3:0.1250]", "ok"]
    assert machine.line("$#") == told
    machine.send(b"\x18")
    machine.run(100)
    machine.unlock()
    assert machine.line("$#") == told
    run(machine, "G00 X0 Y0", "M02")
    assert machine.axes[:2] == (10_000, 0), "a program begins in G54"
    run(machine, "G59 G00 X0 Y0", "M02")
    assert machine.axes[:2] == (10_000, -25_000)


def test_functions_between_two_moves_beside_the_path_act_at_the_corner(machine):
    machine.line("G10 D1 R.1")
    lines = run(machine, "G41 D1 G00 X1", "G01 X2 F600", "M77", "Y1 M78", "X1.5", "G40 X0 Y0",
                "M02", passes=20_000)
    told = [line[3:-1].split(",") for line in lines if line.startswith(("[E:block", "[E:aux"))]
    assert [(event[0], *event[2:5]) for event in told] == [
        ("block", "2", "0", "0"), ("block", "3", "10000", "1000"),
        ("block", "4", "19000", "1000"), ("aux", "4", "19000", "1000"),
        ("block", "5", "19000", "1000"), ("aux", "5", "19000", "1000"),
        ("block", "6", "19000", "9000"), ("block", "7", "15000", "9000"),
        ("block", "8", "0", "0")]
    assert machine.axes == (0, 0, 0)


def test_damaged_block_leaves_the_held_move_undone(machine):
    machine.line("G10 D1 R.1")
    lines = run(machine, "G41 D1 G00 X1", "G01 X2 F600", "Y1", "X1.95 Y.95", "G77", "M02")
    assert events(lines, "alarm")[0][2].startswith("Block 6")
    assert machine.axes[0] == 19_000, "the move of block 5 was held"
    assert machine.line("$X") == ["ok"]
    assert names(run(machine, "G00 X0 Y0", "M02"))[-1] == "end", "no offset is left"
    assert machine.axes[:2] == (0, 0)


def test_wire_offset_is_for_tapes(machine):
    machine.line("G10 D1 R.1")
    assert machine.line("G41 D1 G00 X1")[-1] == error_line("refused")
    assert machine.axes == (0, 0, 0)


def test_short_blocks_run_through(machine):
    """The machine stands; firmware loads blocks ahead without waiting for it."""
    machine.library.gk_speed(0)
    run(machine, "G91 G01 F60", *(["X.01"] * 100), "M02", passes=1)
    machine.run(4000)
    assert machine.bound("ahead") == 49 * 100, "the window holds the machine's segment and 48 more"
    assert machine.library.gk_position() == 0


@pytest.mark.parametrize(("length", "ahead"), [(0, 49), (65, 26)])
def test_long_texts_wait_for_the_machine_too(machine, length, ahead):
    """The machine stands. What a block's event will show is kept meanwhile: 2 KiB of it."""
    machine.library.gk_speed(0)
    run(machine, "G91 G01 F60", *([f"X.01({'W' * length})"] * ahead), passes=1)
    machine.run(4000)
    assert machine.bound("ahead") == ahead * 100


def test_blocks_read_ahead_are_told_with_their_text(machine, rng):
    """Texts of all lengths, of which up to 71 characters are told."""
    texts = [f"X.1({'W' * rng.choice((0, 1, 26, 61, 65, 66, 67, 80))})" for _ in range(300)]
    machine.library.gk_speed(2)
    run(machine, "G91 G01 F600", *texts, "M02", passes=200_000)
    blocks = [line for line in machine.lines if line.startswith("[E:block")]
    assert [line[:-1].split(",", 6)[6] for line in blocks[1:-1]] == [text[:71] for text in texts]
    assert names(machine.lines)[-1] == "end"


@pytest.mark.parametrize("block", ["C100", "M77", "G04 P1", "G92 X1", DATA, "G38 P0", "M05", "M00",
                                   "M30"])
def test_blocks_that_act_wait_for_the_front(machine, block):
    machine.library.gk_speed(0)
    run(machine, DATA, "G91 G01 X.01 F60", block, "X.01", "M02")
    assert machine.bound("ahead") == 100
    told = names(machine.lines)
    machine.library.gk_speed(100)
    machine.run(4000)
    assert len(names(machine.lines)) > len(told)


def test_stop_waits_for_the_operator_with_the_discharge_off(machine):
    lines = run(machine, "C100 M03", "M00", "G00 X1", "M02")
    assert names(lines)[-1] == "pause"
    assert "discharge" not in machine.flags
    assert machine.line("?")[-1].startswith("<Hold:0|")
    machine.send(b"~")
    lines = machine.run(4000)
    assert names(lines) == ["block", "block", "end"]
    assert machine.axes[0] == 10_000


def test_discharge_returns_after_the_stop(machine):
    run(machine, "C100 M03", "M00", "G04 X36000", "M02")
    machine.send(b"~")
    machine.run(400)
    assert "discharge" in machine.flags


def test_optional_stop(machine):
    assert names(run(machine, "M01", "M02"))[-1] == "end"
    machine.line(assign("optional_stop", 1))
    assert names(run(machine, "M01", "M02"))[-1] == "pause"


def test_dwell_takes_its_time(machine):
    lines = run(machine, "G04 P500", "G04 X.25", "M02")
    cycles = [int(line.split(",")[1]) for line in lines if line.startswith("[E:block")]
    assert 1_000_000 <= cycles[1] - cycles[0] < 1_100_000
    assert 500_000 <= cycles[2] - cycles[1] < 600_000


def test_hold_keeps_and_resume_goes_on(machine):
    machine.library.gk_speed(10)
    run(machine, "G01 X1 F60", "M02", passes=10)
    machine.send(b"!")
    machine.run(10)
    held = machine.library.gk_position()
    machine.run(1000)
    assert machine.library.gk_position() == held
    assert machine.line("?")[-1].startswith("<Hold:0|")
    machine.send(b"~")
    machine.run(10_000)
    assert machine.axes[0] == 10_000


@pytest.mark.parametrize(("blocks", "line", "moved"), [
    (["G77", "G00 X1", "M02"], 2, 0),
    (["G00 X1", "G77", "G00 X2", "M02"], 3, None),
    (["G00 X1", "M05", "G77", "G00 X2", "M02"], 4, 10_000),
    (["G00 X1", "M05", "G01 X2", "M02"], 4, 10_000),
    (["G00 X1", "M05"], 4, 10_000),
])
def test_damaged_block_never_moves(machine, blocks, line, moved):
    lines = run(machine, *blocks)
    code, text = events(lines, "alarm")[0][1:3]
    assert f"ALARM:{code}" in lines
    assert text.startswith(f"Block {line}")
    assert "end" not in names(lines)
    assert machine.axes[0] in ((0, 10_000) if moved is None else (moved,))
    assert not machine.flags & {"run", "discharge"}
    assert machine.line("?")[-1].startswith("<Alarm|")


def test_damaged_tapes_stop_where_the_model_stands(rng):
    """The position is kept: at the end of the blocks before the fault, or on the way there."""
    for _ in range(40):
        machine = Controller()
        machine.unlock()
        blocks = program(rng, 8)
        at = rng.randrange(2, len(blocks) - 1)
        blocks[at] = damage(rng, blocks[at])
        if "%" in blocks[at]:
            continue
        lines = run(machine, *blocks, passes=6000)
        if "pause" in names(lines):
            continue
        assert ("end" in names(lines)) != ("alarm" in names(lines)), (blocks, lines)
        assert not machine.flags & {"run", "discharge"}


def test_alarm_ends_the_tape_and_unlock_allows_another(machine):
    run(machine, "G77", "M02")
    assert machine.line("G92 X0")[-1] == error_line("locked")
    assert events(run(machine, "M02"), "alarm") == []
    assert "[MSG:the machine is locked; unlock it with $X first.]" in machine.lines
    assert machine.line("$X") == ["ok"]
    assert names(run(machine, "G00 X1", "M02"))[-1] == "end"


@pytest.mark.parametrize(("detail", "code"), [(1, 141), (2, 142), (3, 143), (4, 144)])
def test_halt_of_the_gateware_is_an_alarm(machine, detail, code):
    machine.library.gk_speed(0)
    run(machine, DATA, "C100 M03", "G01 Z-1 F6", "M02")
    machine.library.gk_go(1)
    machine.run(100)
    machine.state("halted")
    machine.event("halt", detail)
    lines = machine.run(200)
    assert events(lines, "alarm")[0][1] == str(code)
    assert events(lines, "alarm")[0][2].startswith("Block 4: ")
    assert not machine.flags & {"run", "discharge"}
    assert machine.line("$X") == ["ok"]
    machine.library.gk_speed(1 << 30)
    assert names(run(machine, "G00 X1", "M02"))[-1] == "end"


def test_a_fault_of_the_third_drive_of_a_wire_machine_is_its_wire():
    for jump_axis, axes, words in (
            (2, 4, "interlock: a drive reports a fault (axis Z);"),
            (15, 4, "interlock: the wire has a break or its drive reports a fault;"),
            (15, 3, "interlock: a drive reports a fault (axes X and Y);")):
        machine = Controller(jump_axis=jump_axis)
        machine.unlock()
        machine.library.gk_trip(2, axes)
        assert words in events(machine.run(200), "alarm")[0][2]


@pytest.mark.parametrize(("cause", "words"), [(1, "emergency stop"), (6, "watchdog"),
                                              (10, "position deviation in motion")])
def test_trip_is_an_alarm_and_position_is_taken_anew(machine, cause, words):
    machine.library.gk_speed(7)
    run(machine, "G01 X1 F6", "M02", passes=20)
    machine.library.gk_trip(cause, 0)
    lines = machine.run(200)
    assert words in events(lines, "alarm")[0][2]
    stopped = machine.axes[0]
    assert 0 < stopped < 10_000
    machine.library.gk_live(1 << cause)
    assert "|Er:5,5,5|" in machine.line("?")[-1]
    assert machine.line("$X")[-1] == error_line("trip")
    machine.library.gk_live(0)
    assert machine.line("$X")[-1] == "ok"
    assert "|Er:0,0,0|" in machine.line("?")[-1], "taken over before the drives are enabled"
    machine.line("$POSITION=HERE")
    machine.library.gk_speed(1 << 30)
    run(machine, "G91 G00 X1", "M02")
    assert machine.axes[0] == stopped + 10_000


def test_machine_side_that_does_not_answer(machine):
    machine.library.gk_fin(0xFFFFFFFF)
    lines = run(machine, "M77", "G00 X1", "M02")
    assert events(lines, "alarm")[0][1:] == [
        str(alarm_number("fin")), "Block 2: the machine side did not answer M77 in time."]
    assert machine.axes[0] == 0


def test_functions_wait_for_their_answer_in_turn(machine):
    machine.library.gk_fin(400)
    lines = run(machine, "S9 T8 M77 M08 M78", "M02", passes=8000)
    assert events(lines, "aux") == [["aux", *code] for code in (
        ("S", "9"), ("T", "8"), ("M", "77"), ("M", "8"), ("M", "78"))]
    cycles = [int(line.split(",")[1]) for line in lines if line.startswith("[E:aux")]
    assert all(b - a >= 400_000 for a, b in pairwise(cycles))


def test_reset_during_motion_is_an_alarm(machine):
    machine.library.gk_speed(7)
    run(machine, "G01 X1 F6", "M02", passes=20)
    machine.send(b"\x18")
    lines = machine.run(100)
    assert events(lines, "alarm")[0][1] == str(alarm_number("reset"))
    assert lines[-1].startswith("Grbl ")


def test_reset_at_rest_is_none(machine):
    machine.send(b"\x18")
    assert machine.run(100) == ["Grbl 1.1h ['$' for help]"]
    assert machine.line("?")[-1].startswith("<Idle|")


def test_watchdog_is_called_from_both_ends_of_every_pass_and_after_every_sleep(machine):
    pets, sleeps = machine.library.gk_pets(), machine.library.gk_sleeps()
    machine.run(1000)
    slept = machine.library.gk_sleeps() - sleeps
    assert slept > 0
    assert machine.library.gk_pets() == pets + 4000 + 2 * 1000 // 4 + 2 * slept, (
        "after the link, the task, and the checks of each round")
    assert machine.library.gk_unwatched() == 0, "the work is between the keys"


def test_watchdog_is_not_called_too_soon_and_its_interrupt_is_answered(machine):
    library = machine.library
    library.gk_watch(True, False)
    machine.run(1)                  # a first key that waits
    pets = library.gk_pets()
    machine.run(100)
    assert library.gk_pets() == pets, "no second key"
    library.main_loop_interrupt()
    assert library.gk_answers() == 0, "nobody asks"
    library.gk_watch(False, True)
    machine.run(1)
    assert library.gk_pets() > pets
    library.main_loop_interrupt()
    assert library.gk_answers() == 1


def test_processor_sleeps_only_when_there_is_nothing_to_do(machine):
    before = machine.library.gk_sleeps()
    machine.run(400)
    assert machine.library.gk_sleeps() == before + 100, "once in every round"
    # More than are read while they are sent.
    rows = punched(["G90 G01 F60", *["X1", "X2"] * 25, "M02"])
    machine.frame(0, 0)
    machine.send(b"".join(machine.framed(len(rows[at:at + 64]), 1 + at // 64, rows[at:at + 64])
                          for at in range(0, len(rows), 64)))
    machine.run(4)
    before = machine.library.gk_sleeps()
    machine.run(12)
    assert machine.library.gk_sleeps() == before, "blocks wait to be read"
    machine.run(4000)
    machine.frame(0xFF, 1 + -(-len(rows) // 64))
    machine.library.gk_speed(0)
    run(machine, "G91 G01 F60", *["X.01"] * 20, "M02")
    before = machine.library.gk_sleeps()
    machine.run(400)
    assert machine.library.gk_sleeps() == before + 100, "the machine has not gone on"


def test_block_skip(machine):
    run(machine, "/ G00 X1", "M02")
    assert machine.axes[0] == 0
    machine.line(assign("block_skip", 0))
    run(machine, "/ G00 X1", "M02")
    assert machine.axes[0] == 10_000


def test_a_tape_waits_for_the_line_before_it(machine):
    machine.library.gk_speed(0)
    assert machine.line("G91 G01 X1 F60") == ["ok"]
    lines = machine.tape(punched(["G00 X2", "M02"]), passes=2000)
    assert not events(lines, "start")
    machine.library.gk_speed(1 << 30)
    machine.run(2000)
    assert names(machine.lines)[-1] == "end"
    assert machine.axes[0] == 20_000


def test_lines_by_hand_move_too(machine):
    assert machine.line("G00 X1") == ["ok"]
    assert machine.line("G01 X2 F60 (slow)") == ["ok"]
    assert machine.axes[0] == 20_000
    assert machine.line("X A1")[-1] == error_line("number")
    assert machine.line("?")[-1].startswith("<Idle|MPos:2.0000,0.0000,0.0000|")
    assert names(run(machine, "G91 G00 X1", "M02"))[-1] == "end"
    assert machine.axes[0] == 30_000
