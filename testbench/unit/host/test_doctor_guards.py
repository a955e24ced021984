# SPDX-License-Identifier: Apache-2.0
"""Guards opened by hand before a doctor without a machine: each guard's levels over the time."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import pytest

from host.doctor import guards
from host.doctor.levels import Inputs
from softcore.build import BOARDS

SOUND = Inputs.of("[INPUTS:0,0,2000,16]")
WAIT_S = 10.0


@dataclass
class Fake:
    """Answers the doctor's questions. Of each prompt, ``acts`` has what is open, and when.

    A prompt's text contains the key; the value has tuples of a guard's wire, the time from the
    prompt on at which it opens, and that at which it closes.
    """

    acts: dict[str, list[tuple[str, float, float]]]
    board: object = BOARDS["ulx3s"]
    findings: list = field(default_factory=list)
    said: list = field(default_factory=list)
    opened: list = field(default_factory=list)
    now_s: float = 0.0
    port: object = None
    lost: tuple = ()    # numbers of the looks whose answer gets lost; None is all
    looks: int = 0

    def __post_init__(self):
        self.port = SimpleNamespace(time_s=lambda: self.now_s)

    def ask(self, question):
        return True

    def say(self, text):
        self.said.append(text)
        for key, acts in self.acts.items():
            if text.startswith("Now ") and text.endswith(f": {_of(key)}."):
                self.opened += [(wire, self.now_s + start, self.now_s + end)
                                for wire, start, end in acts]

    def find(self, check, ok, said, places=None):
        self.findings.append(SimpleNamespace(check=check, ok=ok, said=said, places=places or []))

    def listen(self, seconds):
        self.now_s += seconds

    def inputs(self):
        self.now_s += 0.01
        self.looks += 1
        if self.looks > 1 and (self.lost is None or self.looks in self.lost):
            return None
        levels = dict(SOUND.levels)
        for wire, start, end in self.opened:
            if start <= self.now_s < end:
                pad, _, bit = wire.rstrip("]").partition("[")
                levels[pad] |= 1 << int(bit or 0)
        return replace(SOUND, levels=levels)


def _of(wire):
    pad, _, bit = wire.rstrip("]").partition("[")
    return str(guards.place(BOARDS["ulx3s"], pad, int(bit or 0)))


WIRES = [f"{pad}[{bit}]" if guards.WIDTH[pad] > 1 else pad
         for pads in guards.KINDS.values() for pad in pads for bit in range(guards.WIDTH[pad])]
GOOD = {wire: [(wire, 0.5, 1.0)] for wire in WIRES}


def tried(**changed):
    """Findings by wire, and whether all is sound, of acts that are good but for those changed."""
    fake = Fake(GOOD | {key.replace("_at_", "[") + "]" * ("_at_" in key): acts
                        for key, acts in changed.items()})
    sound = guards.opened(fake, WAIT_S)
    return {one.check.removesuffix(" opened"): one for one in fake.findings}, sound, fake


def wrong(found):
    return {wire: [one.wire for one in finding.places] for wire, finding in found.items()
            if finding.ok is False}


def test_sound_guards_are_right():
    found, sound, _ = tried()
    assert sound
    assert set(found) == set(WIRES)
    assert wrong(found) == {}


def test_a_guard_that_opens_again_before_its_turn_is_waited_for():
    """The supply of a drive flickers as it returns; then its own turn comes."""
    found, sound, fake = tried(drive_fault_at_0=[("drive_fault[0]", 0.5, 1.0),
                                                 ("drive_fault[1]", 0.9, 3.0)])
    assert wrong(found) == {}
    assert sound
    assert any(text.startswith("Waiting until this guard is closed again") for text in fake.said)


def test_drives_that_keep_their_fault_after_an_emergency_stop_are_named_alone():
    found, sound, _ = tried(estop=[("estop", 0.5, 1.0), ("drive_fault[0]", 0.6, 1e9)])
    assert not sound
    assert wrong(found) == {"drive_fault[0]": ["drive_fault[0]"]}
    assert "stayed open" in found["drive_fault[0]"].said
    assert found["estop"].ok is True


def test_an_emergency_stop_that_is_bridged_is_named_alone():
    """Its press takes the drives' supply away, but it is not seen itself."""
    drives = [(f"drive_fault[{axis}]", at, at + 0.5) for at in (0.5, 2.0) for axis in range(3)]
    found, sound, _ = tried(estop=drives)
    assert not sound
    assert wrong(found) == {"estop": ["estop"]}


def test_a_wrong_switch_that_is_pressed_once_accuses_nobody():
    found, sound, fake = tried(limit_low_at_1=[("limit_high[1]", 0.5, 1.0),
                                               ("limit_low[1]", 3.0, 4.0)])
    assert sound
    assert wrong(found) == {}
    assert any("Once more" in text for text in fake.said)


def test_another_that_opens_once_is_named_too_if_nothing_follows():
    found, _, _ = tried(limit_low_at_1=[("limit_high[1]", 0.5, 1.0)])
    assert wrong(found) == {"limit_low[1]": ["limit_low[1]", "limit_high[1]"]}


@pytest.mark.parametrize("wire", ["estop", "limit_low[2]"])
def test_a_guard_that_never_opens_is_named(wire):
    found, sound, _ = tried(**{wire.replace("[", "_at_").rstrip("]"): []})
    assert not sound
    assert wrong(found) == {wire: [wire]}


def test_exchanged_wires_are_both_named():
    twice = [(0.5, 1.0), (2.0, 3.0)]
    found, sound, _ = tried(limit_low_at_1=[("limit_high[1]", *when) for when in twice],
                            limit_high_at_1=[("limit_low[1]", *when) for when in twice])
    assert not sound
    assert wrong(found) == {"limit_low[1]": ["limit_low[1]", "limit_high[1]"],
                            "limit_high[1]": ["limit_high[1]", "limit_low[1]"]}


@pytest.mark.parametrize("lost", [2, 3, 4])
def test_a_lost_answer_accuses_nobody(lost):
    """The float switch has been open all the time. Look 2 is whether the first guard is closed."""
    fake = Fake(GOOD, lost=(lost,), opened=[("fluid_low", 0.0, 1e9)])
    assert guards.opened(fake, WAIT_S)
    assert [one.check for one in fake.findings if one.ok is not True] == []
    assert not any("with it" in one.said for one in fake.findings)
    assert not any(text.startswith("Waiting") for text in fake.said)


def test_inputs_that_are_never_told_accuse_nobody():
    fake = Fake(GOOD, lost=None)
    assert guards.opened(fake, WAIT_S)
    assert {one.ok for one in fake.findings} == {None}
