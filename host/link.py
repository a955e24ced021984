# SPDX-License-Identifier: Apache-2.0
"""The host's end of the link: line mode and tape mode over any pipe of bytes.

Line mode follows grbl 1.1: a line is answered ``ok`` or ``error:N``; real-time bytes may be sent at
any time between frames. Tape mode carries punched bytes in frames::

    0x02, length n, sequence, n bytes, CRC high, CRC low

with the CRC over length, sequence and bytes. The controller answers 0x06 sequence (taken) or
0x15 sequence (damaged, send again), and nothing while its buffer is full; a frame without answer
is sent again after a time-out, and a sequence number seen twice is taken once. Length 0 begins a
tape, length 0xFF says that no more bytes follow. The frames of a tape are numbered from 0, modulo
256; the one that begins it bears 255, so that no late answer to it is taken for one to the first
bytes. So no byte of a tape can be lost, doubled, or
taken for a real-time byte.

Ref: CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF): check value 0x29B1 for ``123456789``.
"""

import json
from binascii import crc_hqx
from collections.abc import Callable
from typing import Protocol

from host.brief import Expander
from host.errors import UsageError, UserError

FRAME, TAKEN, AGAIN = 0x02, 0x06, 0x15
PAYLOAD = 64
BEGIN, FINISH = 0x00, 0xFF

STATUS, HOLD, RESUME, RESET, RETRACT = b"?", b"!", b"~", b"\x18", b"\x92"

GREETING = "Gapkeeper"
FRAME_TIMEOUT_S = 0.1     # a frame takes 0.7 ms at 1 Mbaud: no room, or noise hit it
ANSWER_TIMEOUT_S = 2.0
UNANSWERED_FRAMES = 20    # then the machine is asked whether it lives
DAMAGED_FRAMES = 10
POLL_S = 0.01             # longest wait before one looks whether it is to go on
LONGEST_LINE = 255        # characters; with its end it fills the controller's 256


class LinkError(UserError):
    """The controller does not answer as agreed."""


class RefusedError(LinkError):
    """The controller refuses a line; ``reason`` is its own sentence."""

    def __init__(self, line: str, reason: str):
        super().__init__(f'the controller refuses "{line}": {reason}')
        self.reason = reason


class BytePipe(Protocol):
    """What the link needs: a serial port, a pseudo-terminal or a simulated machine."""

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""

    def read(self, timeout_s: float) -> bytes:
        """Return what has come; wait for something, at most ``timeout_s`` of the pipe's time."""

    def time_s(self) -> float:
        """Seconds of the pipe's own clock: simulated ones in a simulation."""


def crc(data: bytes) -> int:
    """CRC-16/CCITT-FALSE."""
    return crc_hqx(data, 0xFFFF)


def check_line(line: str) -> None:
    """Check that ``line`` can be sent as one line of line mode.

    Raises
    ------
    UsageError
        If it is empty or too long, or holds a character that is none or a real-time byte.
    """
    wrong = next((char for char in line if not " " <= char <= "~" or char in "?!~"), None)
    if wrong is not None:
        said, char = (json.dumps(text, ensure_ascii=False) for text in (line, wrong))
        raise UsageError(f"the line {said} cannot be entered by hand: {char} is no character of a "
                         "block.")
    if not line.strip():
        raise UsageError("an empty line cannot be entered by hand.")
    if len(line) > LONGEST_LINE:
        raise UsageError(f'the line "{line[:20]}…" cannot be entered by hand: it has {len(line)} '
                         f"characters, and the controller takes {LONGEST_LINE}.")


def frame(length: int, sequence: int, payload: bytes = b"") -> bytes:
    """Bytes of one frame. ``length`` is that of the payload, or ``BEGIN`` or ``FINISH``."""
    body = bytes([length, sequence]) + payload
    return bytes([FRAME]) + body + crc(body).to_bytes(2)


def frames(rows: bytes):
    """Yield the frames of a tape, each with its sequence number."""
    yield 0xFF, frame(BEGIN, 0xFF)
    payloads = [rows[start:start + PAYLOAD] for start in range(0, len(rows), PAYLOAD)]
    for number, payload in enumerate(payloads):
        sequence = number % 256
        yield sequence, frame(len(payload), sequence, payload)
    sequence = len(payloads) % 256
    yield sequence, frame(FINISH, sequence)


class Link:
    """One controller at the other end of ``pipe``.

    ``on_line`` is called with every line that is no answer to a command: events (in full, see
    ``host.brief``), messages, alarms, status reports, greetings; in the order in which they came,
    from within the call that waited.
    """

    def __init__(self, pipe: BytePipe, on_line: Callable[[str], None]):
        self.pipe = pipe
        self.on_line = on_line
        self._line = bytearray()
        self._full = Expander()
        self._mark = 0        # TAKEN or AGAIN, if its sequence number has not come yet
        self._marks = []      # answers to frames, oldest first
        self._answers = None  # answers to a command, while one waits for them
        self._report = None   # last status report, without its brackets

    def poll(self, timeout_s: float) -> None:
        """Take what has come, waiting at most ``timeout_s`` for something."""
        for byte in self.pipe.read(timeout_s):
            self._take(byte)

    def realtime(self, byte: bytes) -> None:
        """Send one real-time byte."""
        self.pipe.write(byte)

    def await_greeting(self, timeout_s: float = ANSWER_TIMEOUT_S) -> None:
        """Wait until the controller says who it is.

        Raises
        ------
        LinkError
            If it does not in time.
        """
        greeted = []
        inner, self.on_line = self.on_line, greeted.append
        try:
            self._wait(lambda: any(line.startswith(GREETING) for line in greeted), timeout_s,
                       "the controller does not start: no greeting came over the link.")
        finally:
            self.on_line = inner

    def command(self, line: str) -> None:
        """Send a line and wait for its answer, as long as the controller is at it.

        Raises
        ------
        RefusedError
            If the controller refuses the line.
        LinkError
            If it does not answer.
        """
        self._answers = []
        said = []
        inner, self.on_line = self.on_line, lambda text: (said.append(text), inner(text))
        try:
            self.pipe.write(line.encode("ascii", "replace") + b"\n")
            while not self._answers:
                self._await_answer(line)
            answer = self._answers[0]
        finally:
            self._answers, self.on_line = None, inner
        if answer != "ok":
            why = next((text[5:-1] for text in reversed(said) if text.startswith("[MSG:")), answer)
            raise RefusedError(line, why)

    def _await_answer(self, line):
        try:
            self._wait(lambda: self._answers, ANSWER_TIMEOUT_S,
                       f'the controller does not answer to "{line}".')
        except LinkError:
            if self.status()["state"] != "Run":
                raise

    def send_tape(self, rows: bytes, stop: Callable[[], bool]) -> bool:
        """Send a tape, frame by frame, while ``on_line`` gets what the machine says meanwhile.

        Returns whether all of it was taken; not so if ``stop()`` became true before. It is asked
        every ``POLL_S``, or more often.

        Raises
        ------
        LinkError
            If frames keep arriving damaged or the machine falls silent.
        """
        self._marks.clear()
        return all(self._send_frame(sequence, data, stop) for sequence, data in frames(rows))

    def _send_frame(self, sequence, data, stop):
        silent = damaged = 0
        while True:
            self.pipe.write(data)
            mark = self._await_mark(sequence, stop)
            if stop():
                return False
            if mark == TAKEN:
                return True
            if mark == AGAIN:
                damaged += 1
                if damaged == DAMAGED_FRAMES:
                    raise LinkError(f"the link is bad: a frame of the tape arrived damaged "
                                    f"{damaged} times in a row.")
            else:
                silent += 1
                if silent % UNANSWERED_FRAMES == 0:
                    self.status()

    def _await_mark(self, sequence, stop):
        end = self.pipe.time_s() + FRAME_TIMEOUT_S
        while True:
            while self._marks:
                mark, number = self._marks.pop(0)
                if number == sequence or mark == AGAIN:
                    return mark
            left = end - self.pipe.time_s()
            if left <= 0 or stop():
                return None
            self.poll(min(left, POLL_S))

    def status(self) -> dict[str, str]:
        """Ask for a status report; return its fields by name, the state as ``state``.

        Raises
        ------
        LinkError
            If none comes in time.
        """
        self._report = None
        self.realtime(STATUS)
        self._wait(lambda: self._report is not None, ANSWER_TIMEOUT_S,
                   "the controller has fallen silent.")
        state, *fields = self._report.split("|")
        return {"state": state} | dict(field.partition(":")[::2] for field in fields)

    def _wait(self, condition, timeout_s, complaint):
        end = self.pipe.time_s() + timeout_s
        while not condition():
            left = end - self.pipe.time_s()
            if left <= 0:
                raise LinkError(complaint)
            self.poll(left)

    def _take(self, byte):
        if self._mark:
            self._marks.append((self._mark, byte))
            self._mark = 0
        elif byte in (TAKEN, AGAIN):
            self._mark = byte  # neither occurs in a line
        elif byte == 0x0A:
            line = self._line.decode("ascii", "replace").strip()
            self._line.clear()
            if line:
                self._dispatch(self._full(line))
        else:
            self._line.append(byte)

    def _dispatch(self, line):
        if line.startswith("<"):
            self._report = line.strip("<>")
        if self._answers is not None and (line == "ok" or line.startswith("error:")):
            self._answers.append(line)
        else:
            self.on_line(line)
