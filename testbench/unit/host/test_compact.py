# SPDX-License-Identifier: Apache-2.0
"""Compact events: the firmware's lines for short blocks, and the host's expansion of them."""

import random
from itertools import pairwise

from host.link.compact import Expander
from host.run.events import Scale, parse
from testbench.firmware import Controller, events
from testbench.programs import punched

NUMBERS = (24, 6, 12, 12, 12)   # bits of clock, line and place


def short(numbers, text):
    """A compact event, written by the rules of softcore/firmware/link/output.h."""
    digits = [chr(ord("0") + (number >> shift & 63)) for number, bits in
              zip(numbers, NUMBERS, strict=True)
              for shift in range(bits - 6, -1, -6)]
    return f"[B{''.join(digits)}{text}]"


def full(numbers, text):
    return f"[E:block,{','.join(map(str, numbers))},{text}]"


def test_numbers_nearest_to_the_event_before_are_meant():
    draw = random.Random(1)
    for _ in range(300):
        expand = Expander()
        numbers = [draw.randrange(1 << 40), draw.randrange(1 << 20),
                   *(draw.randrange(-(1 << 28), 1 << 28) for _ in range(3))]
        assert expand(full(numbers, "X1")) == full(numbers, "X1")
        for _ in range(5):
            ends = draw.random() < 0.3
            numbers = [number + (draw.choice((-1 << bits - 1, (1 << bits - 1) - 1)) if ends
                                 else draw.randrange(-1 << bits - 1, 1 << bits - 1))
                       for number, bits in zip(numbers, NUMBERS, strict=True)]
            assert expand(short(numbers, "G01]X,1")) == full(numbers, "G01]X,1")


def test_every_event_in_full_is_begun_from():
    expand = Expander()
    for line in ("[E:start,7,1,5,-6,7,]", "[E:resume,5000000000,300,90000,-9,0]"):
        assert expand(line) == line
    assert expand(short([5000000900, 301, 90100, 0, -5], "X.01")) == full(
        [5000000900, 301, 90100, 0, -5], "X.01")


def test_what_is_no_event_stays_as_it_is():
    expand = Expander()
    before = short([1, 2, 3, 4, 5], "X1")
    for line in (before, "ok", "[E:block,1]", "[B]", "[MSG:no]", before):
        assert expand(line) == line


def machine_lines(machine, rows):
    """Lines of the firmware on a tape, as they come over the line."""
    came, inner = [], machine._full
    machine._full = lambda line: came.append(line) or inner(line)
    machine.unlock()
    machine.tape(punched(rows), passes=20_000)
    return came


def test_firmware_and_host_agree():
    machine = Controller()
    draw = random.Random(2)
    kinds = "X.01", "X-.01Y.02", "Z-.003", "X.7Y-1.1", "G04P1", "(NO)X.1", "G92X5", "X.19"
    moves = [draw.choice(kinds) for _ in range(200)]
    came = machine_lines(machine, ["G91 G01 F1000", *moves, "M02"])
    compact = [line for line in came if line.startswith("[B")]
    assert len(compact) > 60
    assert all(line.isascii() and line.isprintable() for line in came)
    told = [parse(line, Scale(2_000_000)) for line in machine.lines if line.startswith("[E:block")]
    assert [event["text"] for event in told] == [
        "G91 G01 F1000", *moves, "M02"]
    assert [event["line"] for event in told] == list(range(told[0]["line"], told[0]["line"] + 202))
    assert all(a["cycle"] <= b["cycle"] for a, b in pairwise(told))
    since = 0
    for line in came:
        since = since + 1 if line.startswith("[B") else 0 if line.startswith("[E:") else since
        assert since <= 31
    assert not events(machine.lines, "alarm")


def test_short_lines_tell_the_place():
    machine = Controller()
    came = machine_lines(machine, ["G91 G01 F1000", *["X.01Y-.02"] * 40, "M02"])
    assert sum(line.startswith("[B") for line in came) > 30
    told = [line[3:-1].split(",") for line in machine.lines if line.startswith("[E:block")][2:-2]
    steps = {(int(b[3]) - int(a[3]), int(b[4]) - int(a[4]))
             for a, b in pairwise(told)}
    assert steps <= {(100, -200), (99, -200), (100, -199), (101, -200), (100, -201), (99, -199),
                     (101, -201)}, steps
