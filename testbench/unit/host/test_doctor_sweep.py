# SPDX-License-Identifier: Apache-2.0
"""The doctor's sweep of the comparators, and what it does not look at, without a machine."""

from types import SimpleNamespace

import pytest

from host.doctor import comparators
from host.doctor.comparators import Look, Seen, sweep
from host.doctor.doctor import Doctor
from host.doctor.levels import FULL
from softcore.build import BOARDS

VOLTAGE = 246.0     # of 1024: 24 V of 100
TOUCH = ["[MSG:the electrode touches the work.]", "ALARM:152"]
EXCHANGED = {"gap_high": {"gap_high", "gap_short", "gap_reference[0]", "gap_reference[2]"},
             "gap_arc": {"gap_arc", "gap_short", "gap_reference[1]", "gap_reference[2]"}}


class Patient:
    """Keeps what is found."""

    board = BOARDS["ulx3s"]

    def __init__(self):
        self.found, self.looks = [], []

    def command(self, line, **_):
        return []

    def find(self, check, ok, said, places=()):
        self.found.append((ok, said, {one.wire for one in places}))


@pytest.fixture
def swept(monkeypatch):
    """Outcome of a sweep whose looks are those of a function of the number and both levels."""
    def run(look):
        patient = Patient()

        def looked(doctor, name, levels, way):
            patient.looks.append((levels, way))
            return look(len(patient.looks) - 1, *levels)

        monkeypatch.setattr(comparators, "_look", looked)
        return patient, *sweep(patient, "X")
    return run


def sound(number, high, arc):
    return Look(Seen(high, VOLTAGE, high < VOLTAGE, arc > VOLTAGE), 0.05, None)


def test_a_sound_machine_goes_there_and_back_and_on(swept):
    patient, said, goes_on = swept(sound)
    (ok, _, wires), = patient.found
    assert (ok, wires, said, goes_on) == (True, set(), [], True)
    ways = [way for _, way in patient.looks]
    assert len(ways) == 8
    assert ways == [1, -1] * 4


@pytest.mark.parametrize("raised", EXCHANGED)
def test_contacts_level_exchanged_with_another_is_named(swept, raised):
    """The gap reads as a short from the beginning, as soon as that level is above its voltage."""
    def look(number, high, arc):
        short = (high if raised == "gap_high" else arc) > VOLTAGE
        return Look(None, 0.0, TOUCH) if short else sound(number, high, arc)

    patient, said, goes_on = swept(look)
    (ok, _, wires), = patient.found
    assert (ok, wires, said, goes_on) == (False, EXCHANGED[raised], [], False)


@pytest.mark.parametrize(("at", "moved"), [(1, 0.0), (2, 0.0), (4, 0.02), (0, 0.01)])
def test_a_true_touch_accuses_no_wire(swept, at, moved):
    """No level that is tried explains it: none is above the voltage, or the axis has moved."""
    patient, said, goes_on = swept(
        lambda number, *levels: Look(None, moved, TOUCH) if number == at else
        sound(number, *levels))
    (ok, text, wires), = patient.found
    assert (ok, wires, said, goes_on) == (None, set(), [], False)
    assert "touched on the way" in text
    assert len(patient.looks) == at + 1, "nothing moves after it"


def test_without_a_voltage_a_touch_accuses_no_wire(swept):
    def look(number, high, arc):
        return Look(None, 0.0, TOUCH) if number == 5 else Look(Seen(high, 0.0, 1, 0), 0.05, None)

    patient, _, _ = swept(look)
    assert [ok for ok, _, _ in patient.found] == [None]


def test_another_stop_is_left_to_the_caller(swept):
    fault = ["[MSG:a drive reports a fault: axis X.]", "ALARM:100"]
    patient, said, goes_on = swept(lambda number, *levels: Look(None, 0.01, fault) if number else
                                   sound(number, *levels))
    assert (patient.found, said, goes_on) == ([], fault, False)


def test_a_stop_without_its_reason_is_told(swept):
    patient, said, goes_on = swept(lambda number, *levels: Look(None, 0.01, []))
    assert [ok for ok, _, _ in patient.found] == [None]
    assert (said, goes_on) == ([], False)


def test_an_alarm_whose_line_was_lost_is_seen_in_the_state():
    clock = iter(range(1000))
    patient = SimpleNamespace(
        said=[], places=lambda: [0.0, 0.0, 0.0], listen=lambda _: [], since=lambda _: [],
        command=lambda line, **_: [], await_state=lambda *_, **__: None,
        link=SimpleNamespace(status=lambda: {"state": "Alarm"}),
        port=SimpleNamespace(time_s=lambda: next(clock)))
    assert comparators._look(patient, "Y", (FULL - 1, 1), 1) == Look(None, 0.0, [])


class Mute(Doctor):
    """Sends nothing, asks nothing, and keeps the checks with their outcomes."""

    def __init__(self):
        super().__init__(None, BOARDS["ulx3s"], ask=lambda _: pytest.fail("it asks"), say=print)

    def find(self, check, ok, said, places=()):
        self.findings.append((check, ok))

    def command(self, line, **_):
        pytest.fail(f"it sends {line}")


def test_nothing_is_unlocked_that_does_not_tell_its_inputs(monkeypatch):
    monkeypatch.setattr(Mute, "inputs", lambda self: None)
    doctor = Mute()
    doctor._inputs(unlock=True)
    assert doctor.findings == [("inputs", None)]
    assert not doctor._free


def test_wires_of_another_boards_gateware_are_not_looked_at(monkeypatch):
    """They would be told with pins of the board that is not there."""
    monkeypatch.setattr(Mute, "_identify", lambda self: False)
    assert Mute().examine() == [("wires", None)]
