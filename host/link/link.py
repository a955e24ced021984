# SPDX-License-Identifier: Apache-2.0
"""The host's end of the link: real-time bytes, lines and tape frames over any pipe of bytes.

**Real-time bytes** (``softcore.linkmap``) act at once, whatever came before: the gateware takes
them out of the stream. So they never occur within lines or frames.

**Lines** follow grbl 1.1: each is answered ``ok`` or ``error:N``. A line may have a number and a
check, and those of this host always do; ``host.link.framing`` describes their form. The answer
names the number, ``ok @17`` or ``error:9 @17``. Numbers begin with 0 after every greeting and rise
by 1, modulo 65536. One of the last 64 lines that comes again gets the same answer again, and is not
carried out again. Any other number, a wrong check, and a line in which the receiver saw an error
are refused whole by ``error:108``, with the number if it could be read. This host then sends the
line again, and also if no answer comes. After an alarm it does not: what was ordered before it must
not start a motion afterwards, such as a ``$X`` and a jog that waited for a cable to be plugged in
again. Then an empty line with the same number is sent in its place.

From the first numbered line to the next reset the link is *guarded*: a line without a number is
refused, and the single bytes `~`, 0xB0 and those of the overrides do nothing. So no damaged byte
starts a motion or makes one faster. The lines ``$RESUME`` and ``$RETRACT`` replace `~` and 0xB0.
They work at any time: while a tape runs or is being sent, and ahead of lines that wait.

**Tape frames** carry punched bytes; their form is in ``host.link.framing``. The controller answers
0x06 sequence (taken) or 0x15 sequence (damaged, send again), and nothing while its buffer is full.
A frame without answer is sent again after a time-out, and a sequence number seen twice is taken
once. So, by CRC and sequence, no byte of a tape is lost or doubled. Between the frames of a tape
only numbered lines are accepted.

**A held processor** sends nothing more. After a fault of its memory, or when it has not answered
the watchdog for too long, the gateware takes the line over. It sends one of these about every
second until the controller is switched off and on::

    ALARM:155 memory parity at 0x00012340
    ALARM:155 watchdog: the processor does not answer

It may come in the middle of a line, which must then be ignored.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from host import alarms
from host.errors import ALARM, UserError
from host.link.compact import Expander
from host.link.framing import check_line, frames, numbered
from softcore.linkmap import REALTIME
from softcore.tables.faults import error_line

TAKEN, AGAIN = 0x06, 0x15

_BYTES = {realtime.name: bytes([realtime.byte]) for realtime in REALTIME}
STATUS, HOLD, RESET = (_BYTES[name] for name in ("status", "hold", "reset"))
RESUME, RETRACT = "$RESUME", "$RETRACT"

GREETING = "Grbl "        # grbl's, for its senders; $I identifies the controller
FRAME_TIMEOUT_S = 0.1     # a frame takes 1.4 ms at 1 Mbaud: else no room, or it was damaged
LINE_TIMEOUT_S = 0.3      # then a line is sent again; it may still be under way
ANSWER_TIMEOUT_S = 2.0
UNANSWERED_FRAMES = 20    # then the controller is asked for its status
DAMAGED = 10              # times in a row that a frame or a line may arrive damaged
POLL_S = 0.01             # longest time between two looks at ``stop``
NUMBERS = 1 << 16

GREETS_S = 1.0            # a greeting that comes so soon after a reset is that of the reset
ALARMED = "an alarm came before its answer, and it was not sent again"

_GREETING = re.compile(rf"{GREETING}\S+ \['\$' for help\]$")
_ANSWER = re.compile(r"(ok|error:(\d+))(?: @(\d+))?")
_DAMAGED_LINE = error_line("line")
_HELD = re.compile(r"ALARM:(\d+) (\S.*)")  # from the gateware; the firmware's has no text
_BUSY = {"Run", "Hold", "Home"}     # states in which a line may take its time


class LinkError(UserError):
    """The controller does not answer as the link's rules demand."""


class RefusedError(LinkError):
    """The controller refuses a line.

    ``reason`` is its own sentence, ``code`` the number of its ``error:``, 0 if it gave none.
    """

    def __init__(self, line: str, reason: str, code: int = 0):
        super().__init__(f'the controller refuses "{line}": {reason}')
        self.reason, self.code = reason, code


class HeldError(LinkError):
    """The controller's processor is held; the text says why."""

    status = ALARM


def held_by(line: str) -> tuple[int, str] | None:
    """Code and sentence of the alarm if a line says that the processor is held, else None."""
    told = _HELD.fullmatch(line)
    if told is None:
        return None
    return int(told[1]), (f"{told[2]}: the processor is held until the controller is switched off "
                          "and on.")


def is_cut(line: str) -> bool:
    """Whether a line begins with a bracket and has lost its end."""
    return line.startswith("[") and not line.endswith("]")


def fields_of(report: str) -> dict[str, str]:
    """Fields of a status report by name.

    The state is ``state``; a number behind it, such as the 0 of Hold:0, is ``substate``.
    """
    state, *fields = report.strip("<>").split("|")
    state, _, substate = state.partition(":")
    return {"state": state} | ({"substate": substate} if substate else {}) | dict(
        field.partition(":")[::2] for field in fields)


class BytePipe(Protocol):
    """The pipe that a link needs: a serial port, a pseudo-terminal or a simulated machine."""

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that have come; wait at most ``timeout_s`` of pipe time for one."""

    def time_s(self) -> float:
        """Seconds of the pipe's own clock: simulated ones in a simulation."""


@dataclass
class Sent:
    """A line that has been sent: ``answer`` is None until the controller gives one.

    The answer is ``ok``, ``error:N``, ``ALARMED``, or that the controller has started anew.
    """

    number: int
    text: str
    first_s: float              # when it was sent first,
    last_s: float               # and last
    awaited: bool               # somebody waits for the answer
    damaged: int = 0            # times it was refused as damaged
    stale: bool = False         # an alarm came since then: it is not sent again,
    emptied: bool = False       # but an empty line in its place
    answer: str | None = None

    def again(self) -> bytes:
        """Bytes with which it is sent again."""
        if self.stale and not self.emptied:
            self.emptied, self.damaged = True, 0
        return numbered(self.number, "" if self.emptied else self.text)


class Link:
    """One controller at the other end of ``pipe``.

    ``on_line`` is called with every line that is not the answer to a command: events (in full, see
    ``host.link.compact``), messages, alarms, status reports, greetings. The calls come in the order
    of the lines, from within the call that waits. ``on_line`` may call ``press``, and nothing else
    of the link.
    """

    def __init__(self, pipe: BytePipe, on_line: Callable[[str], None]):
        self.pipe = pipe
        self.on_line = on_line
        self._line = bytearray()
        self._full = Expander()
        self._mark = 0        # TAKEN or AGAIN while its sequence number is still to come
        self._marks: list[tuple[int, int]] = []  # answers to frames, oldest first
        self._late = False    # an answer came after its frame had been sent again
        self._number = 0      # of the next line
        self._open: list[Sent] = []  # lines without an answer, oldest first
        self._again = False   # they are to be sent again
        self._report = ""     # last status report, without its brackets
        self._held: str | None = None  # why the processor is held
        self._reset_s = -math.inf   # when this link has sent a reset

    def poll(self, timeout_s: float) -> None:
        """Take the bytes that have come, waiting at most ``timeout_s`` for one.

        Raises
        ------
        LinkError
            If a line that nobody waits for is not answered, or keeps arriving damaged.
        """
        for byte in self.pipe.read(timeout_s):
            self._take(byte)
        self._tend()

    def realtime(self, byte: bytes) -> None:
        """Send one real-time byte. After ``RESET`` no line from before it is sent again."""
        if byte == RESET:
            self._forget()
            self._reset_s = self.pipe.time_s()
        self.pipe.write(byte)

    def press(self, button: bytes | str) -> None:
        """Do what an operator's button does: send ``HOLD``, ``RESUME``, ``RETRACT`` or ``RESET``.

        This waits for nothing. If a line was sent, every ``poll`` looks after it until its answer.
        """
        if isinstance(button, bytes):
            self.realtime(button)
        else:
            self._post(button, awaited=False)

    def await_greeting(self, timeout_s: float = ANSWER_TIMEOUT_S) -> None:
        """Wait for the controller's greeting.

        Raises
        ------
        LinkError
            If it does not in time.
        """
        greeted: list[str] = []
        inner, self.on_line = self.on_line, greeted.append
        try:
            self._wait(lambda: any(line.startswith(GREETING) for line in greeted), timeout_s,
                       "the controller does not start: no greeting came over the link.")
        finally:
            self.on_line = inner

    def command(self, line: str, within_s: float = ANSWER_TIMEOUT_S) -> None:
        """Send a line and wait for its answer for as long as the controller works on it.

        At rest that is ``within_s`` at most, from the last line that it said.

        Raises
        ------
        UsageError
            If the text cannot be a line.
        RefusedError
            If the controller refuses the line.
        HeldError
            If its processor is held. Every method that waits raises this.
        LinkError
            If it does not answer, or starts anew.
        """
        said, inner = list[str](), self.on_line

        def hear(text: str) -> None:
            said.append(text)
            inner(text)

        self.on_line = hear
        sent = None
        try:
            sent = self._post(line, awaited=True)
            while sent.answer is None:
                self._await_answer(sent, within_s, said)
        finally:
            self.on_line = inner
            if sent in self._open:
                self._open.remove(sent)
        if sent.answer != "ok":
            answer = _ANSWER.fullmatch(sent.answer)
            known = alarms.refusal(int(answer[2])) if answer else ""
            why = next((text[5:-1] for text in reversed(said) if text.startswith("[MSG:")), known)
            raise RefusedError(line, why or sent.answer, int(answer[2]) if answer else 0)

    def send_line(self, line: str) -> Sent:
        """Send a line; every ``poll`` looks after it until it is answered, however long that takes.

        Raises
        ------
        UsageError
            If the text cannot be a line.
        """
        return self._post(line, awaited=True)

    def _post(self, line: str, *, awaited: bool) -> Sent:
        check_line(line)
        now = self.pipe.time_s()
        sent = Sent(self._number, line, now, now, awaited)
        self._number = (self._number + 1) % NUMBERS
        self._open.append(sent)
        self.pipe.write(numbered(sent.number, line))
        return sent

    def _await_answer(self, sent: Sent, within_s: float, said: list[str]) -> None:
        heard = len(said)
        if (not self._came(lambda: sent.answer is not None, within_s) and len(said) == heard
                and self.status()["state"] not in _BUSY and sent.answer is None):
            raise LinkError(f'the controller does not answer to "{sent.text}".')

    def _tend(self) -> None:
        """Send lines again that were damaged, or have had no answer for some time."""
        now = self.pipe.time_s()
        for sent in self._open:
            if not sent.awaited and now - sent.first_s > ANSWER_TIMEOUT_S:
                self._open.remove(sent)
                raise LinkError(f'the controller does not answer to "{sent.text}".')
            self._again = self._again or now - sent.last_s > LINE_TIMEOUT_S
        if self._again and self._open:
            # The first byte ends a damaged line: the damage may have hit its end.
            self.pipe.write(b"\n" + b"".join(sent.again() for sent in self._open))
            for sent in self._open:
                sent.last_s = now
        self._again = False

    def _answered(self, code: str, number: int | None) -> None:
        """Take an answer to one of this link's lines; None if its number could not be read."""
        sent = next((one for one in self._open if one.number == number), None)
        if code != _DAMAGED_LINE:
            if sent is not None:
                sent.answer = ALARMED if sent.emptied else code
                self._open.remove(sent)
            return
        # A line that follows a damaged one is out of sequence, and refused as well.
        self._again = True
        for one in ([sent] if sent is not None else self._open[:1]):
            one.damaged += 1
            if one.damaged == DAMAGED:
                self._open.remove(one)
                if one.emptied:     # it had been taken: the number is another line's
                    one.answer = ALARMED
                    return
                raise LinkError(f'the link is bad: "{one.text}" arrived damaged {DAMAGED} times.')

    def send_tape(self, rows: bytes, stop: Callable[[], bool]) -> bool:
        """Send a tape, frame by frame, while ``on_line`` gets the lines that come meanwhile.

        Returns whether all of it was taken; False if ``stop()`` became true before. ``stop`` is
        called at least every ``POLL_S``.

        Raises
        ------
        LinkError
            If frames keep arriving damaged or the machine falls silent.
        """
        self._marks.clear()
        self._late = False
        return all(self._send_frame(sequence, data, stop) for sequence, data in frames(rows))

    def _send_frame(self, sequence: int, data: bytes, stop: Callable[[], bool]) -> bool:
        silent = damaged = 0
        while True:
            self.pipe.write(data)
            mark = self._await_mark(sequence, stop, FRAME_TIMEOUT_S)
            silent += mark is None
            if mark is None and (self._late or silent % UNANSWERED_FRAMES == 0) and not stop():
                # However slow the machine is, its report follows the answer to the frame.
                self.status()
                mark = self._await_mark(sequence, stop, 0)
            if stop():
                return False
            if mark == TAKEN:
                return True
            damaged += mark == AGAIN
            if damaged == DAMAGED:
                raise LinkError("the link is bad: a frame of the tape arrived damaged "
                                f"{damaged} times in a row.")

    def _await_mark(self, sequence: int, stop: Callable[[], bool], within_s: float) -> int | None:
        end = self.pipe.time_s() + within_s
        while True:
            while self._marks:
                mark, number = self._marks.pop(0)
                if number == sequence or mark == AGAIN:
                    return mark
                self._late = True
            left = end - self.pipe.time_s()
            if left <= 0 or stop():
                return None
            self._need_processor()
            self.poll(min(left, POLL_S))

    def status(self) -> dict[str, str]:
        """Ask for a status report; return its fields by name, the state as ``state``.

        Raises
        ------
        LinkError
            If none comes in time.
        """
        self._report = ""
        end = self.pipe.time_s() + ANSWER_TIMEOUT_S
        while not self._report:
            if self.pipe.time_s() >= end:
                raise LinkError("the controller has fallen silent.")
            self.realtime(STATUS)  # again: a byte may get lost
            self._came(lambda: bool(self._report), LINE_TIMEOUT_S)
        return fields_of(self._report)

    def _came(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Poll until a condition holds; return whether it did in time."""
        end = self.pipe.time_s() + timeout_s
        while not condition():
            left = end - self.pipe.time_s()
            if left <= 0:
                return False
            self._need_processor()
            self.poll(min(left, LINE_TIMEOUT_S) if self._open else left)
        return True

    def _need_processor(self) -> None:
        if self._held is not None:
            raise HeldError(self._held)

    def _wait(self, condition: Callable[[], bool], timeout_s: float, complaint: str) -> None:
        if not self._came(condition, timeout_s):
            raise LinkError(complaint)

    def _take(self, byte: int) -> None:
        if self._mark:
            self._marks.append((self._mark, byte))
            self._mark = 0
        elif byte in (TAKEN, AGAIN):
            self._mark = byte  # neither occurs in a line
        elif byte == 0x0A:
            line, self._line = self._line.decode("ascii", "replace").strip(), bytearray()
            # Before it, what was on the wire when the power went, and noise.
            if greeting := _GREETING.search(line):
                line = greeting[0]
            if line:
                self._dispatch(self._full(line))
        else:
            self._line.append(byte)

    def _dispatch(self, line: str) -> None:
        if held := held_by(line):
            self._open.clear()
            self._held = held[1]
        elif line.startswith("<"):
            if line.endswith(">"):
                self._report = line.strip("<>")
        elif is_cut(line):
            return
        elif line.startswith("ALARM:"):
            for sent in self._open:
                sent.stale = True
        elif line.startswith(GREETING):
            self._started()
        elif answer := _ANSWER.fullmatch(line):
            code, _, number = answer.groups()
            if number is not None or (code == _DAMAGED_LINE and self._open):
                self._answered(code, None if number is None else int(number))
                return
        self.on_line(line)

    def _started(self) -> None:
        """The controller has started. If a reset was the cause, what came after it counts."""
        self._held = None
        if self.pipe.time_s() - self._reset_s > GREETS_S:
            self._forget()

    def _forget(self) -> None:
        """A controller that starts has forgotten all lines, and numbers them anew."""
        self._number = 0
        for sent in self._open:
            sent.answer = "the controller has started anew"
        self._open.clear()
