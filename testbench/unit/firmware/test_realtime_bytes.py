# SPDX-License-Identifier: Apache-2.0
"""Every byte beyond ASCII, in every state: grbl's meaning, ours, or nothing."""

import pytest

from softcore.linkmap import DOOR, OVERRIDE_BYTES, PASSED_OVER, REALTIME
from softcore.tables.faults import error_line
from testbench.firmware import Controller
from testbench.programs import punched

DATA = "G36 R300 L.5 H600 E60 Q.1"
REST = 60               # passes in which the machine is taken to rest


def idle(machine):
    return machine


def running(machine):
    machine.library.gk_speed(0)
    machine.tape(punched([DATA, "C100 M03 M08", "G01 X1 F60", "M02"]), passes=600)
    machine.library.gk_moving(1)
    return machine


def holding(machine):
    running(machine).send(b"!")
    machine.library.gk_moving(0)
    machine.run(REST)
    return machine


def alarm(machine):
    machine.library.gk_trip(1, 0)
    machine.run(400)
    return machine


def retracting(machine):
    running(machine)
    machine.state("retracting")
    return machine


ACTING = {one.byte: one.name for one in REALTIME} | {DOOR: "hold"}
OVERRIDES = {one.byte for one in OVERRIDE_BYTES}
SCENES = {"Idle": idle, "Run": running, "Hold:0": holding, "Alarm": alarm, "retraction": retracting}


def look(machine):
    return machine.flags, machine.axes, machine.library.gk_override(), machine.data


@pytest.mark.parametrize("name", SCENES)
def test_every_byte_in_every_state(name):
    """What a byte may do: hold, override, in a hold the discharge off, an order to retract.

    All else stays, and no answer comes.
    """
    for byte in range(0x80, 0x100):
        machine = Controller()
        machine.unlock()
        machine.run(REST)
        SCENES[name](machine)
        flags, *rest = look(machine)
        machine.send(bytes([byte]))
        said = machine.run(12)
        now, *others = look(machine)
        expected = set(flags)
        if ACTING.get(byte) == "hold":
            expected |= {"held", "hold"}
        if ACTING.get(byte) == "stop" and name == "Hold:0":
            expected -= {"discharge"}
        assert now == expected, f"0x{byte:02X}"
        if byte in OVERRIDES:
            others[1] = rest[1]
        assert others == rest, f"0x{byte:02X}"
        retracts = ACTING.get(byte) == "retract" and name in ("Run", "Hold:0", "retraction")
        assert bool(said) == retracts, (f"0x{byte:02X}", said)


@pytest.mark.parametrize("before", [b"G91 G00 X", b"G91 G00 ("])
def test_every_byte_within_a_line(before):
    """The byte acts and leaves the line intact, or the line is refused."""
    known = {*ACTING, *OVERRIDES, *PASSED_OVER}
    machine = Controller()
    machine.unlock()
    for byte in range(0x80, 0x100):
        at = machine.axes[0]
        machine.send(before + bytes([byte]) + (b"1\n" if before[-1:] == b"X" else b") X1\n"))
        machine.run(100)
        machine.send(b"~")
        machine.run(300)
        moved = machine.axes[0] - at
        assert moved == (10_000 if byte in known else 0), f"0x{byte:02X}"
        answers = [line for line in machine.lines if line == "ok" or line.startswith("error:")]
        assert answers[-1] == ("ok" if byte in known else error_line("line")), f"0x{byte:02X}"


def test_every_byte_within_a_frame():
    """Stuffed it is a byte of the tape. Bare it may act, and leaves the frame whole.

    One that means nothing breaks the frame, which is asked for again.
    """
    known = {*ACTING, *OVERRIDES, *PASSED_OVER}
    for byte in range(0x80, 0x100):
        machine = Controller()
        machine.unlock()
        machine.frame(0, 0)
        machine.frame(3, 1, b"AAA")
        machine.run(REST)
        before = look(machine)
        machine.frame(3, 2, bytes([0x41, byte, 0x41]))
        assert look(machine) == before, f"0x{byte:02X}"
        machine.marks.clear()
        whole = Controller.framed(2, 3, b"AA")
        machine.send(whole[:4] + bytes([byte]) + whole[4:])
        machine.run(200)
        ((answer, _),) = machine.marks
        assert answer == (0x06 if byte in known else 0x15), f"0x{byte:02X}"


@pytest.mark.parametrize("bytes_", [b"!\x18", b"\x84\x18"])
@pytest.mark.parametrize("name", SCENES)
def test_a_hold_just_before_a_reset_is_dropped_with_it(name, bytes_):
    """As all that came before: both may be there in the same pass."""
    machine = Controller()
    machine.unlock()
    machine.run(REST)
    SCENES[name](machine).send(bytes_)
    machine.run(400)
    assert not {"held", "hold"} & machine.flags
