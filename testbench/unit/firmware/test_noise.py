# SPDX-License-Identifier: Apache-2.0
"""Host and firmware over a bad cable: everything sent is carried out once, in order, or refused.

The cable bends, loses, doubles and breaks one byte in a thousand on its way to the controller.
After every line and every tape the test compares the machine's motions with the lines sent.
"""

from collections import Counter

import pytest

from host.errors import UserError
from host.link.link import HOLD, RESUME, Link, LinkError
from host.run.events import Scale, is_event, parse
from softcore.tables.settings import assign
from testbench.cable import Cable
from testbench.programs import punched

EVERY = 1000
RESET, RESUMES, RETRACTS, STATUS, HOLDS = 0x18, 0x7E, 0xB0, 0x3F, 0x21
MOVING = (RESUMES, RETRACTS)


class RestartError(UserError):
    """The controller has been reset: damage turned a byte into Ctrl-X."""


class Operator:
    """Sends lines and tapes, holds and resumes, and tracks the machine's expected place."""

    def __init__(self, cable, rng):
        self.cable, self.rng = cable, rng
        self.link = Link(cable, self._hear)
        self.scale = Scale(cable.CLOCK_HZ, 10_000)
        self.named = Counter()      # what was told of refused lines
        self.done = Counter()
        self.blocks = []            # as events told of them
        self.ended = self.greeted = self.holds = False
        self.place = [0, 0, 0]
        self.counts = Counter()     # what the controller told of the link since power-on
        self.link.await_greeting()
        self._begin()

    def _begin(self):
        self.greeted = False
        self._enter("$X")
        self._enter("$POSITION=HERE")
        self._enter("G91 G21 G94")
        self.place = list(self.cable.axes)

    def _hear(self, line):
        if line.startswith("Grbl "):
            self.greeted = True
        elif line.startswith("[MSG:") and "refused" in line:
            self.named["line" if "is refused" in line else "crowd"] += 1
        elif line.startswith("<Hold:") and not self.holds:
            # A byte was bent into a hold: the operator sees that, and goes on.
            self.done["resumed"] += 1
            self.link.press(RESUME)
        elif line.startswith("[LNK:"):
            self.counts = {name: int(count) for name, count in (
                part.split(" ") for part in line[5:-1].split(","))}
        elif is_event(line):
            event = parse(line, self.scale)
            if event["event"] == "block":
                self.blocks.append(event["text"])
            elif event["event"] == "program_end":
                self.ended = True
            else:
                assert event["event"] in ("program_start", "alarm", "retraction_start",
                                          "retraction_set"), line

    def _enter(self, line):
        """Send a line; check that it was carried out, and nothing else."""
        self.link.command(line)

    def _settle(self):
        """Wait until the machine has done its motion, and check its place."""
        end = self.cable.time_s() + 5
        while list(self.cable.axes) != self.place:
            assert self.cable.time_s() < end, (self.cable.axes, self.place)
            self.link.poll(0.05)
            if self.cable.time_s() > end - 4.8:
                self.link.status()  # it may be on hold

    # ---- what an operator does

    def line(self):
        """A line that moves, sets or asks."""
        axis = self.rng.randrange(3)
        way = self.rng.randrange(-5000, 5000) or 1
        kind = self.rng.randrange(5)
        if kind < 3:
            line = f"G00 {'XYZ'[axis]}{way / 10_000:.4f}"
            line += f" ({self.rng.randrange(10 ** self.rng.randrange(20))})"
        elif kind == 3:
            line, way = assign("servo_window", self.rng.randrange(1, 200)), 0
        else:
            line, way = self.rng.choice(("$I", "G04 P1", "G91 G94", "$L")), 0
        before = list(self.place)
        self.place[axis] += way
        try:
            self._enter(line)
            self._settle()
        except LinkError:
            # Reset, before it was begun or on the way: no further than it was to go.
            assert self.greeted, line
            for stands, was, is_to_be in zip(self.cable.axes, before, self.place, strict=True):
                assert min(was, is_to_be) <= stands <= max(was, is_to_be), line
            raise RestartError from None
        self.done["line"] += 1

    def tape(self):
        """A tape: every block gives its event, once and in order; the machine is at the end."""
        ways = [[self.rng.randrange(-300, 300) for _ in range(3)]
                for _ in range(self.rng.randrange(1, 40))]
        texts = [f"N{number} G00 " + " ".join(
            f"{letter}{step / 10_000:.4f}" for letter, step in zip("XYZ", way, strict=True))
            for number, way in enumerate(ways, start=1)]
        blocks = ["G91 G21 G94", *texts, "M02"]
        self.blocks.clear()
        self.ended = False
        before = list(self.place)
        for way in ways:
            self.place = [at + step for at, step in zip(self.place, way, strict=True)]
        try:
            whole = self.link.send_tape(punched(blocks), lambda: self.greeted)
            end = self.cable.time_s() + 5
            while whole and not self.ended and not self.greeted:
                assert self.cable.time_s() < end, "the tape does not end"
                self.link.poll(0.05)
                if self.cable.time_s() > end - 4.8:
                    self.link.status()
        except LinkError:
            assert self.greeted
        if self.greeted:
            # What was done of it is its beginning.
            assert self.blocks == blocks[:len(self.blocks)]
            way = [before]
            for step in ways:
                way.append([at + one for at, one in zip(way[-1], step, strict=True)])
            assert any(all(min(a, b) <= at <= max(a, b) for at, a, b in zip(
                self.cable.axes, one, other, strict=True))
                for one, other in zip(way, [*way[1:], way[-1]], strict=True))
            raise RestartError
        assert self.blocks == blocks
        self._settle()
        self.done["tape"] += 1

    def hold(self):
        """A move on hold: it goes on by an order only, whatever else is sent."""
        self.cable.library.gk_speed(2)
        axis, way = self.rng.randrange(3), self.rng.choice((-2000, 2000))
        before = list(self.place)
        self.place[axis] += way
        try:
            self._enter(f"G00 {'XYZ'[axis]}{way / 10_000:.4f}")
            self.holds = True
            while self.link.status()["state"] != "Hold" and not self.greeted:
                self.link.press(HOLD)  # the byte may be hit
            if self.greeted:
                raise LinkError("reset")
            held = self.cable.axes
            for _ in range(self.rng.randrange(30)):
                self._enter(self.rng.choice(("$I", "$L", assign("servo_window", 9), "$#")))
                assert self.cable.axes == held, "it moves"
            if self.rng.random() < 0.5:
                for byte in (b"~", b"\xb0") * 3:  # in vain: the link is guarded
                    self.link.realtime(byte)
                    self.done["vain"] += 1
                    self.link.poll(0.01)
                assert self.cable.axes == held, "it moves"
            self.holds = False
            self._enter("$RESUME")
            self.cable.library.gk_speed(1 << 30)
            self._settle()
        except LinkError:
            assert self.greeted
            low, high = sorted((before[axis], self.place[axis]))
            assert low <= self.cable.axes[axis] <= high
            raise RestartError from None
        finally:
            self.holds = False
            self.cable.library.gk_speed(1 << 30)
        self.done["hold"] += 1

    def restart(self):
        """A damaged byte has reset the controller: the operator begins anew."""
        self.done["restart"] += 1
        while True:
            try:
                if not self.greeted:
                    self.link.await_greeting()
                self._begin()
                return
            except LinkError:
                assert self.greeted

    def work(self, characters):
        """Go on until ``characters`` characters have been sent."""
        while self.cable.sent < characters:
            try:
                self.rng.choice((*[self.line] * 4, self.tape, self.hold))()
                if self.greeted:
                    raise RestartError
            except RestartError:
                self.restart()


@pytest.mark.parametrize("characters", [
    50_000, pytest.param(1_000_000, marks=pytest.mark.soak)])
def test_nothing_is_carried_out_but_what_was_sent(rng, characters):
    cable = Cable(rng, EVERY)
    operator = Operator(cable, rng)
    operator.work(characters)
    cable.every, cable._next = 0, 1 << 60
    operator.link.command("$L")
    found, became = operator.counts, cable.became
    # So many were to be harmed, and enough of everything was done.
    assert 0.5 * characters / EVERY < cable.hits.total() < 1.6 * characters / EVERY
    assert min(operator.done[kind] for kind in ("line", "tape", "hold")) > characters / 50_000
    # Every refused line was told of, and every byte that would have moved the machine counted; but
    # what a reset found waiting it made to be forgotten.
    resets = became[RESET]
    assert 0 < operator.named["line"] <= found["refused"] <= operator.named["line"] + resets
    assert not operator.named["crowd"]
    assert found["faulty"] <= cable.hits["unstopped"] <= found["faulty"] + resets
    moving = sum(became[byte] for byte in MOVING)
    assert operator.done["vain"] <= found["ignored"] + resets
    assert found["ignored"] <= operator.done["vain"] + moving
    assert operator.done["restart"] <= resets <= 1.2 * operator.done["restart"]
