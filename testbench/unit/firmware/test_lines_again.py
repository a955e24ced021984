# SPDX-License-Identifier: Apache-2.0
"""Numbered lines that come again, since their answers were lost."""

import pytest

from softcore.tables.faults import error_line
from testbench.unit.firmware.test_lines import Sender, answers, named


@pytest.fixture
def sender(machine):
    return Sender(machine)


def test_lines_that_wait_are_known_again_and_their_answers_too(machine, sender):
    """A sender that has several lines without an answer sends all of them again."""
    sent = []
    for sender.number, line in enumerate(("G04 X1", "G91 G00 X1", "G77", "$RESUME")):
        sent.append(sender.bytes(line))
    machine.send(b"".join(sent))
    assert answers(machine.run(200)) == ["ok @3"], "an order does not wait"
    machine.send(b"".join(sent))
    assert answers(machine.run(200)) == ["ok @3"], "the others wait"
    told = answers(machine.run(4000))
    assert told == ["ok @0", "ok @1", f"{error_line('unknown')} @2"]
    machine.send(b"".join(sent))
    assert machine.run(400) == [*told, "ok @3"]
    assert machine.axes[0] == 10_000


def test_a_line_at_work_keeps_its_number_while_64_orders_pass_it(machine, sender):
    first = sender.bytes("G04 X1")
    machine.send(first)
    assert answers(machine.run(100)) == []
    for sender.number in range(1, 66):
        machine.send(sender.bytes("$RESUME"))
        assert answers(machine.run(20)) == [f"ok @{sender.number}"]
    machine.send(first)
    assert answers(machine.run(100)) == [], "it is at work"
    assert answers(machine.run(4000)) == ["ok @0"]
    machine.send(first)
    assert answers(machine.run(100)) == ["ok @0"]


def until_answered(machine):
    for _ in range(200):
        if told := answers(machine.run(50)):
            return told
    return []


def test_a_line_that_orders_passed_while_it_waited_is_known_when_at_work(machine, sender):
    sent = []
    for sender.number, line in enumerate(("G04 X1", "G04 X2")):
        sent.append(sender.bytes(line))
    machine.send(b"".join(sent))
    for sender.number in range(2, 68):
        machine.send(sender.bytes("$RESUME"))
        assert answers(machine.run(5)) == [f"ok @{sender.number}"]
    assert until_answered(machine) == ["ok @0"]
    machine.send(sent[1])
    assert answers(machine.run(100)) == [], "it is at work"
    assert until_answered(machine) == ["ok @1"]
    machine.send(sent[1])
    assert answers(machine.run(100)) == ["ok @1"]


def test_as_many_short_lines_as_can_wait_are_known_again(machine, sender):
    """At work and in the queue of 512 characters."""
    sent = []
    for sender.number, line in enumerate(["G04 X1", *[""] * 52]):
        sent.append(sender.bytes(line))
    for line in sent:
        machine.send(line)
        machine.run(2)
    for line in sent:
        machine.send(line)
        assert answers(machine.run(4)) == []
    told = answers(machine.run(5000))
    assert told == [f"ok @{number}" for number in range(len(sent))]


def test_the_last_64_lines_are_known_again(machine, sender):
    sent = [(sender.bytes("G91 G00 X0.1"), sender("G91 G00 X0.1")) for _ in range(65)]
    machine.send(sent[1][0])
    assert machine.run(200) == ["ok @1"]
    machine.send(sent[0][0])
    assert named(machine.run(200)) == "its number is not the next"
    assert machine.axes[0] == 65_000
