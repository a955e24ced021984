# SPDX-License-Identifier: Apache-2.0
"""Model of the controller's end of the link, written from the protocol and not from the firmware.

It takes lines and frames, and gives the bytes that a controller would send. Time is counted, not
waited for, so the host's time-outs can be tested in no time.
"""

from collections import deque

GREETING = "Gapkeeper 0.1 ['$' for help]"


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE, bit by bit as it is defined."""
    value = 0xFFFF
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ (0x1021 if value & 0x8000 else 0)) & 0xFFFF
    return value


class Controller:
    """Line and tape mode, with a tape buffer of ``room`` bytes that ``drain`` empties.

    ``script`` is called as ``script(controller, line)`` for every line of line mode and may return
    an answer other than ``ok``; ``on_finish(controller)`` when a tape has come whole.
    """

    def __init__(self, *, room=256, script=None, on_finish=None):
        self.room, self.script, self.on_finish = room, script, on_finish
        self.tape = bytearray()    # all bytes taken of the tape that runs
        self.buffered = 0
        self.finished = False
        self.lines, self.realtime = [], []
        self.offset = "0.0000,0.0000,0.0000"  # of the program's frame, for status reports
        self.out = deque()
        self._in = bytearray()
        self._last = None
        self.say(GREETING)

    def say(self, line):
        self.out.extend(line.encode() + b"\r\n")

    def drain(self, count):
        self.buffered = max(0, self.buffered - count)

    def feed(self, data):
        self._in += data
        while self._in and self._step():
            pass

    def _step(self):
        first = self._in[0]
        if first == 0x02:
            return self._frame()
        if first in b"?!~\x18\x92":
            self._in.pop(0)
            self.realtime.append(first)
            if first == ord("?"):
                self.say("<Idle|MPos:0.000,0.000,0.000|"
                         f"WCO:{self.offset}>")
            return True
        end = self._in.find(b"\n")
        if end < 0:
            return False
        line = bytes(self._in[:end]).decode()
        del self._in[:end + 1]
        self.lines.append(line)
        self.say((self.script and self.script(self, line)) or "ok")
        return True

    def _frame(self):
        if len(self._in) < 2:
            return False
        length = self._in[1]
        count = 0 if length in (0, 0xFF) else length
        if len(self._in) < count + 5:
            return False
        taken = bytes(self._in[:count + 5])
        del self._in[:count + 5]
        sequence, payload = taken[2], taken[3:-2]
        if count > 64 or crc16(taken[1:-2]) != int.from_bytes(taken[-2:]):
            self.out.extend([0x15, sequence])
        elif sequence == self._last and length != 0:
            self.out.extend([0x06, sequence])
        elif length != 0 and sequence != (0 if self._last is None else (self._last + 1) % 256):
            self.out.extend([0x15, sequence])
        elif self.buffered + count <= self.room:
            self._accept(length, sequence, payload)
            self.out.extend([0x06, sequence])
        return True

    def _accept(self, length, sequence, payload):
        self._last = sequence if length else None
        if length == 0:
            self.tape.clear()
            self.buffered, self.finished = 0, False
        elif length == 0xFF:
            self.finished = True
            if self.on_finish:
                self.on_finish(self)
        else:
            self.tape += payload
            self.buffered += len(payload)


class Pipe:
    """A pipe to a controller; every read takes a millisecond, in which ``per_ms`` bytes drain.

    ``noise(direction, data)`` may damage what goes ``"out"`` to the controller or comes ``"in"``.
    """

    STEP_S = 0.001

    def __init__(self, controller, *, per_ms=16, noise=None):
        self.controller, self.per_ms = controller, per_ms
        self.noise = noise or (lambda direction, data: data)
        self.now = 0.0

    def write(self, data):
        self.controller.feed(self.noise("out", bytes(data)))

    def read(self, timeout_s):
        self.now += min(timeout_s, self.STEP_S)
        self.controller.drain(self.per_ms)
        data = bytes(self.controller.out)
        self.controller.out.clear()
        return self.noise("in", data)

    def time_s(self):
        return self.now
