# SPDX-License-Identifier: Apache-2.0
"""A tape that power-off interrupts: its bookmark in the flash memory, and going on there."""

from itertools import pairwise

import pytest

from softcore.tables.causes import numbers
from softcore.tables.faults import named
from softcore.tables.settings import assign
from softcore.top import SIMULATED_JOURNAL as REGION
from testbench.firmware import Controller, events
from testbench.models import bookmark
from testbench.native.flash import ERASE_UNITS, SECTOR
from testbench.programs import punched
from testbench.unit.firmware.conftest import SIZE
from testbench.unit.firmware.test_homing import Machine, home

GREETING = "Grbl 1.1h ['$' for help]"
RING = bookmark.sectors(REGION, SIZE)
HEAD, MARK = bookmark.HEAD.size, bookmark.MARK.size
SECOND = 2000               # passes
REFUSED = f"error:{named('start_block').error}"
# Blocks 2 to 9; all but the last are longer than the least time between two marks.
BLOCKS = ("G21 G90 G01 X.3 F600", "G04 P1100", "Y.3", "G04 P1100", "G91 X.25 Z-.05", "G04 P1100",
          "Y-.25", "M02")
# Many blocks in a second.
QUICK = ("G21 G91 G01 F600", *["X.03", "G04 P70"] * 20, "M02")


def booted(memory, kind=Controller, **options):
    """Power off and on."""
    memory.cut(1 << 62)
    return kind(memory=memory, **options)


def kept(memory):
    """Block that the memory has; 0 for none."""
    found = bookmark.newest(memory.read, RING)
    return found.line if found else 0


def told(lines):
    """Numbers of the blocks that were told."""
    return [int(line.split(",")[2]) for line in lines if line.startswith("[E:block,")]


def message(block):
    return (f"[MSG:a tape was interrupted in block {block}: $H, $FROM=last and the same tape go on "
            "there.]")


def begin(machine, blocks, until, passes=60_000):
    """Begin a tape; run it until the memory has a block."""
    machine.library.gk_speed(1)
    machine.tape(punched(list(blocks)), passes=1)
    await_block(machine, until, passes)


def await_block(machine, block, passes=60_000):
    """Run until the memory has a block."""
    for _ in range(passes // 20):
        if kept(machine.memory) == block:
            return
        machine.run(20)
    pytest.fail(f"block {block} was never kept, but {kept(machine.memory)}")


def interrupted(memory, blocks=BLOCKS, until=5):
    """What a power cut in a block leaves."""
    machine = booted(memory)
    machine.unlock()
    begin(machine, blocks, until)
    return machine


@pytest.mark.parametrize("blocks", [BLOCKS, QUICK])
def test_it_is_at_most_a_second_old_and_never_ahead(memory, blocks):
    machine = booted(memory)
    machine.unlock()
    machine.library.gk_speed(1)
    machine.tape(punched(list(blocks)), passes=1)
    history, writes, before = [], [], 0
    for passes in range(0, 60_000, 20):
        machine.run(20)
        history.append(max(told(machine.lines), default=0))
        now = kept(memory)
        if events(machine.lines, "end"):
            break
        if now != before:
            writes.append(passes)
        before = now
        assert now <= history[-1], "never ahead of the machine"
        # An erase before the first one; a quarter of a second covers writing and looking.
        assert now >= history[max(0, len(history) - 1 - (SECOND + SECOND // 4) // 20)]
    else:
        pytest.fail("the tape does not end")
    assert before >= 7
    assert all(b - a >= SECOND - 60 for a, b in pairwise(writes[1:]))
    machine.run(SECOND)
    assert kept(memory) == 0, "the end of the tape"
    assert booted(memory).lines == [GREETING]


def test_without_a_tape_nothing_is_written(memory):
    machine = booted(memory)
    machine.unlock()
    for line in ("G91 G00 X.1", "G04 P100", "M00"):
        machine.line(line, SECOND)
    assert memory.units == 0


def test_it_is_told_once_and_the_machine_is_locked(memory):
    interrupted(memory)
    machine = booted(memory)
    assert machine.lines == [GREETING, message(5)]
    machine.send(b"\x18")
    assert machine.run() == [GREETING], "once"
    assert "Alarm" in machine.line("?")[0]
    assert booted(memory).lines == [GREETING, message(5)], "still there"


def test_an_alarm_leaves_it_and_a_dry_run_neither_moves_nor_ends_it(memory):
    machine = interrupted(memory)
    machine.send(b"\x18")
    machine.run(SECOND)
    assert kept(memory) == 5
    machine.unlock()
    assert machine.line(assign("dry_run_mm_min", 900)) == ["ok"]
    machine.tape(punched(["G21 G91 G01 X.1 F600", "M02"]), passes=SECOND)
    assert events(machine.lines, "end")
    assert kept(memory) == 5
    assert machine.line(assign("dry_run_mm_min", 0)) == ["ok"]
    machine.tape(punched(["G21 G91 G01 X.1 F600", "M02"]), passes=SECOND)
    machine.run(SECOND)
    assert kept(memory) == 0, "another tape, to its end"


def test_the_operator_forgets_it(memory):
    interrupted(memory)
    machine = booted(memory)
    assert machine.line("$FROM=0", SECOND) == ["ok"]
    assert booted(memory).lines == [GREETING]


# ---- power cuts


def cuts(memory, change, total, step=1):
    """Blocks that are found after power cuts at every byte of a change."""
    start = [memory.read(place, SECTOR) for place in RING]
    found = []
    for units in range(0, total + 1, step):
        for place, data in zip(RING, start, strict=True):
            memory.write(place, data)
        machine = booted(memory)
        machine.unlock()
        memory.cut_after(units)
        change(machine)
        memory.cut_after(-1)
        again = booted(memory)
        block = kept(memory)
        assert again.lines == [GREETING, message(block)], units
        assert "Alarm" in again.line("?")[0], "locked as always"
        found.append(block)
    return found


TWO = ("G04 P1100", "G04 P100", "G04 P3000", "M02")     # blocks 2 to 5


def test_a_power_cut_at_every_byte_leaves_the_old_block_or_a_new_one(memory):
    """In the erase, in the head of the next sector, and in two marks; the ring was full before."""
    for _ in RING:
        machine = booted(memory)
        machine.unlock()
        machine.tape(punched(["G04 P1", "M02"]), passes=SECOND)
        machine.run(SECOND // 2)
    interrupted(memory)
    marks = 2 * MARK        # at once, and after a second
    found = cuts(memory, lambda machine: machine.tape(punched(list(TWO)), passes=2 * SECOND),
                 ERASE_UNITS + HEAD + marks - MARK)
    assert found[0] == 5
    assert set(found) == {5, 2, 3} or set(found) == {5, 2, 4}
    assert found == sorted(found, key=(5, 2, 3, 4).index), "each cut leaves what was before it"
    assert found.index(2) == ERASE_UNITS + HEAD
    assert found.count(2) == MARK


def test_a_power_cut_at_every_byte_of_the_end_of_a_tape(memory):
    """And of the erase that follows it."""
    total = []

    def change(machine):
        before = memory.units
        machine.tape(punched(["G04 P100", "M02"]), passes=SECOND)
        total.append(memory.units - before)

    interrupted(memory)
    start = [memory.read(place, SECTOR) for place in RING]
    machine = booted(memory)
    machine.unlock()
    change(machine)
    assert total == [2 * ERASE_UNITS + HEAD + MARK]
    found = []
    for units in range(ERASE_UNITS + HEAD, total[0] + 1):
        for place, data in zip(RING, start, strict=True):
            memory.write(place, data)
        machine = booted(memory)
        machine.unlock()
        memory.cut_after(units)
        change(machine)
        memory.cut_after(-1)
        lines = booted(memory).lines
        found.append(kept(memory))
        assert lines == [GREETING, *([message(found[-1])] if found[-1] else [])]
    assert found == [2] * MARK + [0] * (ERASE_UNITS + 1)


def test_what_a_cut_left_is_passed_over(memory):
    """A machine that is switched on after a cut in any byte keeps the next tape."""
    interrupted(memory)
    start = [memory.read(place, SECTOR) for place in RING]
    for units in range(0, ERASE_UNITS + HEAD + MARK, 7):
        for place, data in zip(RING, start, strict=True):
            memory.write(place, data)
        machine = booted(memory)
        machine.unlock()
        memory.cut_after(units)
        machine.tape(punched(list(TWO)), passes=2 * SECOND)
        memory.cut_after(-1)
        interrupted(memory, until=7)
        assert booted(memory).lines == [GREETING, message(7)], units


# ---- the ring


def test_wear_is_spread_over_the_ring_and_nothing_else_is_touched(memory):
    machine = booted(memory)
    machine.unlock()
    tapes = 3 * len(RING)
    outside = memory.read(REGION.base, REGION.size), memory.read(RING[0] - 8 * SECTOR, 8 * SECTOR)
    for _ in range(tapes):
        machine.tape(punched(["G04 P1", "M02"]), passes=SECOND // 2)
    erased = [memory.erasures(place // SECTOR) for place in RING]
    assert max(erased) - min(erased) <= 1
    assert sum(erased) == tapes + 1
    assert sum(memory.erasures(number) for number in range(4096)) == sum(erased)
    assert outside == (memory.read(REGION.base, REGION.size),
                       memory.read(RING[0] - 8 * SECTOR, 8 * SECTOR))


def test_a_full_sector_is_followed_by_the_next(memory):
    machine = booted(memory)
    machine.unlock()
    blocks = ["G21 G91 G01 F600", *["G04 P1000"] * (bookmark.MARKS + 6), "M02"]
    begin(machine, blocks, bookmark.MARKS + 5, passes=(bookmark.MARKS + 40) * SECOND)
    found = bookmark.newest(memory.read, RING)
    assert found.sequence == 2
    assert memory.erasures(RING[2] // SECTOR) == 1, "before it was needed"
    assert booted(memory).lines == [GREETING, message(bookmark.MARKS + 5)]


def test_a_place_that_does_not_read_back_is_left_and_after_four_it_is_told(memory):
    machine = interrupted(memory, (*BLOCKS[1:2], *BLOCKS), 2)
    sector = bookmark.newest(memory.read, RING).sector
    for at in (0, 2):
        memory.write(sector + bookmark.FIRST + 16 * at + 4, b"\0\0")
    await_block(machine, 4)
    for at in range(4, 12):
        memory.write(sector + bookmark.FIRST + 16 * at + 4, b"\0\0")
    lines = machine.run(8 * SECOND)
    assert [line for line in lines if line.startswith("[MSG")] == [
        "[MSG:the flash memory does not keep the block of the tape: what it tells at power-on may "
        "be old.]"]
    assert events(machine.lines, "end"), "the tape goes on"


# ---- going on


class Homed(Machine):
    """A machine with reference switches near by, and a flash memory."""

    def __init__(self, memory, stands=(0, 0, 0)):
        """``stands``: where the axes are, counted from where the machine stood at first."""
        super().__init__(low=(-1000 - stands[0], -1000 - stands[1], None),
                         high=(None, None, 1000 - stands[2]), memory=memory)
        self.stands = stands

    def ready(self):
        self.run(self.clock_hz // 25_000)
        assert self.line(assign("home_pull_off_um", 50)) == ["ok"]
        home(self)
        self.library.gk_arm()
        self.run(100)


def places(machine):
    """Machine coordinates in the status report."""
    report = next(line for line in machine.line("?", 60) if line.startswith("<"))
    part = next(part for part in report.split("|") if part.startswith("MPos:"))
    return [float(one) for one in part[5:].split(",")]


def cut_in(memory, block, *lines, blocks=BLOCKS, homes=True):
    """Home, set the zero, begin a tape, and run it up to a block."""
    memory.cut(1 << 62)
    machine = Homed(memory)
    machine.ready() if homes else machine.unlock()
    for line in ("G10 L20 P1 X0 Y0 Z0", *lines):
        assert machine.line(line)[-1] == "ok", line
    machine.run(SECOND)     # the journal keeps the zero
    begin(machine, blocks, block)
    return machine


def switched_on(memory, machine):
    memory.cut(1 << 62)
    stood = tuple(a + b for a, b in zip(machine.stands, machine.axes, strict=True))
    again = Homed(memory, stood)
    assert again.lines[0] == GREETING
    return again


@pytest.mark.parametrize("block", [2, 3, 4, 6, 8])
def test_it_goes_on_in_the_block_with_the_places_of_the_first_run(memory, block):
    """Incremental words count from where the axes stood at first, although homing moved them."""
    whole = cut_in(memory, 8)
    whole.run(3 * SECOND)
    end = places(whole)
    for place in RING:
        memory.write(place, b"\xff" * SECTOR)
    machine = switched_on(memory, cut_in(memory, block))
    assert machine.lines == [GREETING, message(block)]
    machine.ready()
    stood = machine.axes
    assert machine.line("$FROM=last") == ["ok"]
    lines = machine.tape(punched(list(BLOCKS)), passes=2 * SECOND)
    assert [event[0] for event in events(lines)] == ["start", "pause"]
    assert any(f"block {block} begins at" in line for line in lines)
    assert machine.axes == stood, "nothing moves before the operator's word"
    machine.send(b"~")
    machine.library.gk_speed(97)
    lines = machine.run(12 * SECOND)
    assert told(lines) == list(range(block, 10))
    assert events(lines, "end")
    # The model's switches act only at the end of a pass, up to 97 pulses late.
    assert places(machine) == pytest.approx(end, abs=0.02)
    assert booted(memory).lines == [GREETING]


def resumed(machine, blocks=BLOCKS, *lines):
    machine.ready()
    for line in lines:
        assert machine.line(line)[-1] == "ok", line
    assert machine.line("$FROM=LAST") == ["ok"]
    stood = machine.axes
    said = machine.tape(punched(list(blocks)), passes=SECOND)
    assert machine.axes == stood
    return said


def alarmed(lines):
    return [event[1] for event in events(lines, "alarm")] == [str(named("start_block").alarm)]


def test_it_can_be_cut_again_on_the_way_and_after_it(memory):
    machine = switched_on(memory, cut_in(memory, 5))
    resumed(machine)
    machine = switched_on(memory, machine)
    assert machine.lines == [GREETING, message(5)], "nothing has been done since then"
    resumed(machine)
    machine.send(b"~")
    await_block(machine, 7)
    machine = switched_on(memory, machine)
    assert machine.lines == [GREETING, message(7)]
    assert not alarmed(resumed(machine))
    machine.send(b"~")
    assert told(machine.run(8 * SECOND)) == [7, 8, 9]


@pytest.mark.parametrize(("change", "block"), [
    (("G21 G90 G01 X.1 F601", *BLOCKS[1:]), 5), ((*BLOCKS[:3], "G04 P1101", *BLOCKS[4:]), 5),
    (("G21 G90 G01 F600", *BLOCKS[1:]), 5), (("(a comment)", *BLOCKS), 5),
    ((*BLOCKS[:2], BLOCKS[-1]), 5)])
def test_another_tape_is_an_alarm_and_nothing_moves(memory, change, block):
    machine = switched_on(memory, cut_in(memory, block))
    lines = resumed(machine, change)
    assert alarmed(lines), lines
    assert booted(memory).lines == [GREETING, message(block)], "it is still there"


def test_a_comment_may_have_changed_but_not_the_numbers_of_the_blocks(memory):
    blocks = ("(one)", *BLOCKS)
    machine = switched_on(memory, cut_in(memory, 6, blocks=blocks))
    assert not alarmed(resumed(machine, ("(another)", *BLOCKS)))


def test_program_zero_must_be_where_it_was(memory):
    machine = switched_on(memory, cut_in(memory, 5, "G92 X-.1 Y-.2 Z.1"))
    machine.ready()
    says, error = machine.line("$FROM=last")
    assert error == REFUSED
    assert says.startswith("[MSG:program zero is not where it was; here, in G54 and G21, G92 X")
    assert says.endswith(" sets it.]")
    line = says.split("G21, ")[1].split(" sets")[0]
    assert not alarmed(resumed(machine, BLOCKS, "G54 G21", line))


def test_a_zero_that_moves_after_the_word_is_an_alarm(memory):
    machine = switched_on(memory, cut_in(memory, 5))
    machine.ready()
    assert machine.line("$FROM=last") == ["ok"]
    assert machine.line("G92 X-1") == ["ok"]
    lines = machine.tape(punched(list(BLOCKS)), passes=SECOND)
    assert alarmed(lines)
    assert any("program zero is not where" in line for line in lines)


def test_retraction_data_entered_by_hand_must_be_entered_again(memory):
    data = "G36 R300 L.5 H600 E60 Q.1"
    machine = switched_on(memory, cut_in(memory, 5, data))
    lines = resumed(machine)
    assert alarmed(lines)
    assert any("by hand have changed; see $FROM=5" in line for line in lines), lines
    machine = switched_on(memory, machine)
    assert not alarmed(resumed(machine, BLOCKS, data))


@pytest.mark.parametrize(("before", "now"), [(True, False), (False, True), (False, False)])
def test_axes_that_were_not_homed_are_refused(memory, before, now):
    machine = switched_on(memory, cut_in(memory, 5, homes=before))
    machine.ready() if now else machine.unlock()
    says, error = machine.line("$FROM=last")
    assert error == REFUSED
    assert says == ("[MSG:$FROM=last needs $H before that run and now; $FROM=5 begins there "
                    "without it.]")


def test_homing_of_some_axes_is_not_enough(memory):
    machine = switched_on(memory, cut_in(memory, 5))
    machine.run(100)
    assert machine.line(assign("home_pull_off_um", 50)) == ["ok"]
    assert machine.line(assign("home_order", 31)) == ["ok"]
    home(machine)
    assert machine.line("$FROM=last")[-1] == REFUSED


def test_without_an_interrupted_tape_it_is_refused(memory):
    machine = booted(memory)
    machine.unlock()
    assert machine.line("$FROM=last") == ["[MSG:no tape was interrupted.]", REFUSED]
    for wrong in ("$FROM=las", "$FROM=lastx", "$FROM="):
        assert "takes the number of a block of the next tape" in machine.line(wrong)[0]


def test_without_power_off_the_counted_position_is_enough(memory):
    machine = interrupted(memory)
    machine.send(b"\x18")
    machine.run(200)
    machine.unlock()
    assert machine.line("$FROM=last") == ["ok"]
    assert not alarmed(machine.tape(punched(list(BLOCKS)), passes=SECOND))


@pytest.mark.parametrize("trips", [False, True])
def test_after_homing_or_a_lost_position_the_frame_may_be_another(memory, trips):
    machine = cut_in(memory, 5, homes=False)
    machine.library.gk_trip(numbers()["coder"], 1) if trips else machine.send(b"\x18")
    machine.run(200)
    machine.unlock() if trips else machine.ready()
    says, error = machine.line("$FROM=last")
    assert error == REFUSED
    assert "needs $H before that run and now" in says


@pytest.mark.parametrize("line", ["G10 C900 I3 P40 Q40 V9", "G10 W1 X4 Y5 Z17",
                                  "$458=250000", "$529=1"])
def test_what_the_tape_uses_and_does_not_enter_must_be_as_it_was(memory, line):
    machine = switched_on(memory, cut_in(memory, 5))
    machine.ready()
    assert machine.line(line)[-1] == "ok"
    assert alarmed(resumed(machine))
