# SPDX-License-Identifier: Apache-2.0
"""A client that does anything: lines, halves of lines, real-time bytes, leaving and coming back.

It talks over a real TCP connection to the code that serves a live controller, in lockstep: the
machine runs only while the client waits, so that a seed always gives the same run. The following
must always hold. Every complete line gets one answer, in order, on the connection that sent it. The
axes stay between the places that lines have asked for; when all is answered, they stand at the
place of the last accepted line, and go on standing. After the end of a jog by a byte they stand
between the places that the jogs asked for. There is no discharge. Nothing takes longer than
``PATIENCE_S``.
"""

import random
import re
import socket
from dataclasses import dataclass, field

from host.link.serve import Tcp
from host.run.live import Live

__all__ = ["Stray", "StrayedError"]

PATIENCE_S = 10.0       # of the machine's time, in which all requests must be done
SILENCE_S = 0.7         # a motion of 0.3 mm in three axes takes 0.52 s at F60
STEP_S = 2e-3
READ_S = 0.02           # until the firmware has read what waits: longer than any of its steps
PULSES_PER_MM = 10_000
BUFFER = 255            # characters that the controller takes, as `$I` says
REACH = 3000            # pulses: lines ask for places from 0 to this
ANSWER = re.compile(r"(ok|error:\d+)( @\d+)?")
STATE = re.compile(r"<(\w+(?::\d)?)\|")
ENDS_A_JOG = (b"!", b"\x84", b"\x85")
RESET, HOLD, RESUME, STATUS = b"\x18", b"!", b"~", b"?"
# Real-time bytes that ask for no motion of their own; 0xb0 (retract) has nothing to retract along.
BYTES = [bytes([byte]) for byte in (0x84, 0x85, *range(0x90, 0xA2), 0xB0)]
QUIET = ["", "   ", "$", "$$", "$G", "$#", "$I", "$N", "$X", "$L", "(nothing)", "; nothing", "G21",
         "G90", "G94", "G17 G40 G49", "G54", "M08", "M09", "G04 P5", "G4 X.01", "%", "T1", "C130"]
WRONG = ["G43 Z1", "X", "G00 X", "G01 X1..2", "M03", "$HX", "$J=G91 X1", "$J=G53 X300 F100",
         "$J=G00 X.1 F600", "$9999=1", "G00 X#1",
         "G38.2 F5", "G99999", "hello", "G00 X1 X2", "$C", "M98 P1", "G28 X1", "(open", "=",
         "G00 X\u00c4", "@1 G00 X1*0000", "@x", "G01 X0.1 F99999999", "X" * 300]


class StrayedError(AssertionError):
    """The controller broke a rule."""


@dataclass
class _Sent:
    """A whole line without an answer; ``target`` if it asks for a motion: place by axis."""

    text: str
    target: dict[int, int] = field(default_factory=dict)

    @property
    def jogs(self):
        """Whether it is a jog."""
        return bool(self.target) and self.text.startswith("$J=")


class Stray:
    """The client and the controller to which it talks.

    ``machine`` is a simulated one, as for ``Live``, with ``positions()`` as commanded and
    ``discharges()``; ``tremble`` is the greatest distance of an axis at rest from its place.
    """

    def __init__(self, machine, seed, *, tremble=0):
        self.machine, self.rng, self.tremble = machine, random.Random(seed), tremble
        self.said, self.log = [], []
        self.line = Tcp("127.0.0.1", 0, self.said.append)
        self.live = Live(machine, self.line, self.said.append, clock=machine.time_s,
                         sleep=lambda seconds: None)
        self.address = ("127.0.0.1", int(self.line.url.rpartition(":")[2]))
        self.socket = None
        self.actions = self.lines = self.answers = self.moves = self.resets = self.visits = 0
        self.jogs = self.ended = 0
        self.pending, self.text, self.greeted, self.state = [], "", False, ""
        self.place = [0, 0, 0]
        self.jogged = []        # places from the first jog since the axes rested, and that before
        self.cut = False        # such a jog may have been ended on its way
        self.heard = False      # there was an answer since the last reset
        self.known = True       # the axes come to rest at `place`
        self.lost = False       # a reset was sent, so that pending lines may get no answer
        self._come()
        self._greet()
        for line in ("$X", "$POSITION=HERE"):
            self._line(line)
        self.settle()

    def close(self):
        self.socket.close()
        self.line.close()

    # ---- what it does

    def act(self):
        """One action at random."""
        self.actions += 1
        kind = self.rng.choices((self._a_line, self._several, self._in_pieces, self._a_byte,
                                 self._pause, self.settle, self._jog, self._leave, self._leave_half,
                                 self._leave_frame, self._reset),
                                (30, 8, 10, 24, 14, 6, 12, 3, 2, 1, 2))[0]
        self.log = [*self.log[-40:], kind.__name__]
        kind()

    def _a_line(self):
        kind = self.rng.random()
        if kind < 0.35:
            self._move()
        else:
            self._line(self.rng.choice(QUIET if kind < 0.75 else WRONG))

    def _several(self):
        """Several lines, as a sender that counts characters may have under way."""
        for _ in range(self.rng.randint(2, 8)):
            if sum(len(one.text) + 2 for one in self.pending) > 100:
                break
            self._a_line()

    def _in_pieces(self):
        """A line typed slowly, with real-time bytes in it."""
        text = self.rng.choice(QUIET)
        at = self.rng.randint(0, len(text))
        self._send(text[:at].encode())
        self._a_byte()
        self._wait(self.rng.random() * 0.02)
        self._line(text[at:], whole=text)

    def _move(self):
        axes = self.rng.sample(range(3), self.rng.randint(1, 2))
        target = {axis: self.rng.randrange(REACH) for axis in axes}
        words = "".join(f" {'XYZ'[axis]}{at / PULSES_PER_MM:.4f}" for axis, at in target.items())
        self.moves += 1
        self._line(f"G21 G90 G94 {self.rng.choice(('G00', 'G01 F600', 'G1F60'))}{words}",
                   target=target)

    def _jog(self):
        """A few jogs, and often a byte that ends them."""
        for _ in range(self.rng.randint(1, 4)):
            axis, at = self.rng.randrange(3), self.rng.randrange(REACH)
            self.jogs += 1
            self._line(f"$J=G90 G21 {'XYZ'[axis]}{at / PULSES_PER_MM:.4f} F600", target={axis: at})
        self._wait(self.rng.random() ** 2 * 0.05)
        if self.rng.random() < 0.6:
            self._press(self.rng.choice(ENDS_A_JOG))

    def _a_byte(self):
        self._press(self.rng.choice((STATUS, STATUS, HOLD, RESUME, RESUME, self.rng.choice(BYTES))))

    def _press(self, byte):
        """Send a real-time byte. Its effect on the jogs is not known: they may have ended."""
        if byte in ENDS_A_JOG and (self.jogged or any(one.jogs for one in self.pending)):
            self.cut = True
        self._send(byte)

    def _pause(self):
        self._wait(self.rng.random() ** 3 * 0.1)

    def _reset(self):
        self.resets += 1
        self._send(RESET)
        self._greet()

    def _greet(self):
        """Wait for the greeting behind a reset or at power-on, and unlock."""
        self.greeted, self.lost = False, True
        if self.resets or self.visits > 1:
            self.known = False
        self._until(lambda: self.greeted, "the greeting")
        self.pending, self.lost = [], False

    def _leave(self):
        self.socket.close()
        self._wait(self.rng.random() * 0.02, silent=True)
        self._come()

    def _leave_half(self):
        """Half of a line with a motion: its target is unknown."""
        text = f"G91 G01 F600 X{self.rng.randint(1, 9)}"
        self._send(text[:self.rng.randint(-3, 0) or None].encode())
        self._leave()

    def _leave_frame(self):
        self._send(bytes([0x02, 5, 1, 0x41, 0x42])[:self.rng.randint(1, 5)])
        self._leave()

    def _come(self):
        """Connect again, without knowledge of the lines before."""
        self.visits += 1
        self.socket = socket.create_connection(self.address)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.setblocking(False)
        self.text, self.ending = "", self.rng.choice(("\n", "\n", "\r\n", "\r"))
        if self.visits > 1:
            self._asked_by_nobody()

    def _is_silent(self):
        """Whether no answer comes for longer than the longest motion takes."""
        self.heard = False
        self._come_to_rest()
        self._wait(SILENCE_S)
        return not self.heard

    def _asked_by_nobody(self):
        """Wait until pending lines are carried out; nobody gets their answers."""
        self.known = self.known and not any(one.target for one in self.pending)
        self.pending, self.lost = [], True
        if self.rng.random() < 0.5:
            self._send(self.ending.encode())    # senders begin so, to end a line that may be open
        self._until(self._is_silent, "silence")
        self.lost = False
        self.settle()

    # ---- bytes and lines

    def _send(self, data):
        self.socket.sendall(data)

    def _line(self, text, *, whole=None, target=None):
        if len(text) > BUFFER:
            # No buffer takes it at once: nothing may wait there, nor its end come with its begin.
            if self.pending:
                self.settle()
            self._send(text[:BUFFER // 2].encode())
            self._wait(READ_S)
            text, whole = text[BUFFER // 2:], whole or text
        self.lines += 1
        self.pending.append(_Sent(text if whole is None else whole, target or {}))
        self._send((text + self.ending).encode())
        if sum(len(one.text) + 2 for one in self.pending) > 100:
            self.settle()

    def _hear(self):
        try:
            data = self.socket.recv(65536)
        except BlockingIOError:
            return
        if not data:
            raise self._strayed("the connection was closed")
        self.text += data.decode("latin-1")
        *lines, self.text = self.text.split("\n")
        for line in map(str.strip, lines):
            if ANSWER.fullmatch(line):
                self._answered(line)
            elif line.startswith("Grbl"):
                self.greeted, self.pending = True, []
            elif found := STATE.match(line):
                self.state = found[1]

    def _answered(self, line):
        self.heard = True
        if self.lost:
            return
        if not self.pending:
            raise self._strayed(f"{line!r} answers no line")
        self.answers += 1
        one = self.pending.pop(0)
        if line == "ok":
            self.jogged = self.jogged or [tuple(self.place)] * one.jogs
            for axis, at in one.target.items():
                self.place[axis] = at
            self.jogged += [tuple(self.place)] * bool(self.jogged)

    def _wait(self, seconds, *, silent=False):
        end = self.machine.time_s() + seconds
        while self.machine.time_s() < end:
            self.live.step(STEP_S)
            if not silent:
                self._hear()
            self._look()

    def _until(self, done, what):
        end = self.machine.time_s() + PATIENCE_S
        while not done():
            if self.machine.time_s() > end:
                raise self._strayed(f"{what} does not come")
            self._wait(STEP_S)

    # ---- what must hold

    def _look(self):
        for axis, at in self.machine.positions().items():
            if not -self.tremble <= at <= REACH + self.tremble:
                raise self._strayed(f"{axis} is at {at}, where no line has sent it")
        if any(self.machine.discharges().values()):
            raise self._strayed("it discharges")

    def _come_to_rest(self):
        def at_rest():
            self.state = ""
            self._send(RESUME + STATUS)
            self._until(lambda: self.state, "a status report")
            return not self.pending and self.state in ("Idle", "Alarm")

        # The first report may be of before the last line: it was on its way.
        self._until(lambda: at_rest() and at_rest(), f"rest with {len(self.pending)} answers")
        self._wait(0.1)

    def settle(self):
        """Wait for all answers and for rest; check the answers and the places of the axes."""
        self._come_to_rest()
        there = list(self.machine.positions().values())
        if self.known and self.cut and self.jogged:
            self._ended_between(there)
        if self.known and any(abs(a - b) > self.tremble
                              for a, b in zip(there, self.place, strict=True)):
            raise self._strayed(f"the axes rest at {there}, not at {self.place}")
        self.jogged, self.cut = [], False
        self._wait(0.02)
        now = list(self.machine.positions().values())
        if any(abs(a - b) > 2 * self.tremble for a, b in zip(there, now, strict=True)):
            raise self._strayed(f"the axes rested at {there} and moved to {now}")
        if self.state == "Alarm":
            self._unlock()
        if not self.known:
            self.place, self.known = list(self.machine.positions().values()), True

    def _ended_between(self, there):
        """Jogs may have ended on their way: within the box of their places, nowhere else."""
        for axis, at in enumerate(there):
            low, *_, high = sorted(place[axis] for place in self.jogged)
            if not low - self.tremble <= at <= high + self.tremble:
                raise self._strayed(f"the lines led axis {axis} from {low} to {high}, not to {at}")
        self.ended += there != self.place
        self.place = there

    def _unlock(self):
        for line in ("$X", "$POSITION=HERE"):
            self.lines += 1
            self.pending.append(_Sent(line))
            self._send((line + self.ending).encode())
        self._until(lambda: not self.pending, "the answer to an unlock")

    def _strayed(self, what):
        asked = [one.text for one in self.pending]
        return StrayedError(f"action {self.actions} at {self.machine.time_s():.4f} s: {what}; "
                            f"asked {asked}, state {self.state}, last {self.log}")
