# SPDX-License-Identifier: Apache-2.0
"""The lines ``$SCOPE``: arming, state, reading of the gap oscilloscope."""

import random
from binascii import crc_hqx

import pytest

from softcore.tables.faults import error_line
from testbench.firmware import Controller
from testbench.models.scope import PULSES
from testbench.programs import punched

DEPTH = 64
SOURCES = "now", "short", "retraction", "class", "rise", "fall"
FULL = 3


@pytest.fixture
def machine():
    return Controller()


def told(line):
    """Text of a line with a check, which must be right."""
    assert line.startswith("[SCOPE")
    text, _, check = line[1:-1].rpartition("*")
    assert check == f"{crc_hqx(text.encode(), 0xFFFF):04X}"
    return text


def state(machine):
    line, answer = machine.line("$SCOPE")
    assert answer == "ok"
    name, *numbers = told(line).removeprefix("SCOPE:").split(",")
    return name, *map(int, numbers)


def fill(machine, count=DEPTH, after=10, seed=5):
    """Give the machine a full record; return its entries."""
    rng = random.Random(seed)
    words = machine.scope
    entries = [rng.choice((0, 2**36 - 1, rng.randrange(2**36))) for _ in range(DEPTH)]
    words.entries[:] = entries
    words.recording, words.count, words.after, words.time = FULL, count, after, 2**32 - 7
    machine.scope = words
    return entries[:count]


def read(machine, first, count):
    """Entries that the lines of a reading hold, and the number of entries in each."""
    *lines, answer = machine.line(f"$scope=read,{first},{count}", 3000)
    assert answer == "ok"
    found, sizes = [], []
    for line in lines:
        place, _, data = told(line).removeprefix("SCOPE@").partition(":")
        assert int(place) == first + len(found)
        sizes.append(len(data) // 6)
        for at in range(0, len(data), 6):
            found.append(sum(ord(digit) - 48 << 30 - 6 * k
                             for k, digit in enumerate(data[at:at + 6])))
    return found, sizes


@pytest.mark.parametrize(("words", "source", "classes", "level", "before"), [
    ("NOW", "now", (), 0, 50), ("short", "short", (), 0, 50), ("SHORT,0", "short", (), 0, 0),
    ("retraction,99", "retraction", (), 0, 99), ("OPEN", "class", ("open",), 0, 50),
    ("OK", "class", ("ok",), 0, 50), ("Arc,25", "class", ("dame",), 0, 25),
    ("SHORTED", "class", ("short",), 0, 50), ("RISE,50,0", "rise", (), 0, 50),
    ("FALL,10,4095", "fall", (), 4095, 10)])
def test_arms_with_a_trigger(machine, words, source, classes, level, before):
    assert machine.line(f"$SCOPE={words}") == ["ok"]
    scope = machine.scope
    assert SOURCES[scope.source] == source
    assert scope.classes == sum(1 << PULSES.index(name) - 1 for name in classes)
    assert scope.level == level
    assert scope.after == DEPTH - 1 - DEPTH * before // 100
    assert state(machine)[0] == "armed"


def test_tells_the_state(machine):
    assert state(machine) == ("idle", DEPTH, 0, 0, 0, 2_000_000)
    machine.line("$SCOPE=SHORT")
    assert machine.line("$SCOPE=FORCE") == ["ok"]
    assert state(machine)[0] == "triggered"
    assert machine.line("$SCOPE=STOP") == ["ok"]
    assert state(machine)[0] == "idle"
    fill(machine, count=50, after=10)
    assert state(machine) == ("full", DEPTH, 50, 39, 2**32 - 7, 2_000_000)


@pytest.mark.parametrize(("first", "count", "sizes"), [
    (0, DEPTH, [16] * 4), (0, 1, [1]), (5, 17, [16, 1]), (63, 1, [1])])
def test_reads_entries_in_lines(machine, first, count, sizes):
    entries = fill(machine)
    assert read(machine, first, count) == (entries[first:first + count], sizes)


@pytest.mark.parametrize(("order", "says"), [
    ("=", "knows no such order"), ("=SHORTS", "knows no such order"), ("=SHO", "knows no such"),
    ("X", "reads $SCOPE=order"), ("=SHORT,100", "0 to 99 %"), ("=SHORT,", "0 to 99 %"),
    ("=SHORT,5,7", "only RISE and FALL have a level"), ("=RISE", "RISE and FALL need a level"),
    ("=RISE,50", "RISE and FALL need a level"), ("=FALL,50,4096", "need a level"),
    ("=FALL,50,1,1", "need a level"), ("=STOP,1", "have no numbers"),
    ("=READ,0,1", "no full record")])
def test_a_wrong_order_is_refused_and_changes_nothing(machine, order, says):
    before = bytes(machine.scope)
    message, answer = machine.line(f"$SCOPE{order}")
    assert says in message
    assert answer in (error_line("command"), error_line("busy"))
    assert bytes(machine.scope) == before


@pytest.mark.parametrize("recording", ["idle", "armed", "triggered"])
def test_a_record_that_is_not_full_cannot_be_read(machine, recording):
    fill(machine)
    words = machine.scope
    words.recording = ("idle", "armed", "triggered").index(recording)
    machine.scope = words
    assert state(machine)[0] == recording
    message, answer = machine.line("$SCOPE=READ,0,1")
    assert "no full record" in message
    assert answer == error_line("busy")


@pytest.mark.parametrize("order", ["", ",", ",0", ",0,0", ",50,1", ",0,51", ",49,2", ",0,1,1"])
def test_only_entries_of_the_record_are_read(machine, order):
    fill(machine, count=50)
    message, answer = machine.line(f"$SCOPE=READ{order}")
    assert "entries 0 to 49" in message
    assert answer == error_line("command")


def test_a_build_without_it_says_so(machine):
    words = machine.scope
    words.depth = 0
    machine.scope = words
    message, _ = machine.line("$SCOPE")
    assert "without the oscilloscope" in message


def test_works_while_a_tape_runs(machine):
    """The state is told and entries are read between the blocks of a tape."""
    machine.unlock()
    machine.tape(punched(["G91", "G04 P60000", "M02"]), passes=50)
    entries = fill(machine)
    assert machine.line("?")[-1].startswith("<Run")
    machine.send(Controller.numbered(0, "$SCOPE=READ,0,64"))
    said = machine.run(3000)
    assert "".join(told(line).partition(":")[2] for line in said if line.startswith("[SCOPE@")) == (
        "".join(chr(48 + (entry >> 30 - 6 * k & 63)) for entry in entries for k in range(6)))
    assert "ok @0" in said
    assert machine.line("?")[-1].startswith("<Run")


def test_a_reset_ends_a_reading(machine):
    fill(machine)
    machine.send(b"$SCOPE=READ,0,64\n")
    machine.run(3)
    machine.send(b"\x18")
    lines = machine.run(3000)
    assert len([line for line in lines if line.startswith("[SCOPE@")]) < 4
    assert lines[-1].startswith("Grbl")
