# SPDX-License-Identifier: Apache-2.0
"""Model of the controller's end of the link, written from the protocol and not from the firmware.

It takes lines and frames, and gives the bytes that a controller would send. Its time is a counter,
so that the host's time-outs can be tested without waiting.
"""

from collections import deque

GREETING = "Grbl 1.1h ['$' for help]"


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE, bit by bit as it is defined."""
    value = 0xFFFF
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ (0x1021 if value & 0x8000 else 0)) & 0xFFFF
    return value


def unstuffed(data: bytes) -> bytes:
    """Contents of the stuffed bytes between the start and the end of a frame."""
    found, flip = bytearray(), 0
    for byte in data:
        if byte == 0x10:
            flip = 0x40
        else:
            found.append(byte ^ flip)
            flip = 0
    return bytes(found)


KNOWN = 64        # numbered lines whose answers come again
STALLED_MS = 20   # without a byte a frame has stopped half-way


class Controller:
    """Line and tape mode, with a tape buffer of ``room`` bytes that ``drain`` empties.

    ``script`` is called as ``script(controller, line)`` for every line of line mode and may return
    an answer other than ``ok``, or ``""`` if there is none yet; ``on_finish(controller)`` is called
    when a whole tape has come.
    """

    def __init__(self, *, room=256, script=None, on_finish=None):
        self.room, self.script, self.on_finish = room, script, on_finish
        self.tape = bytearray()    # all bytes taken of the tape that runs
        self.buffered = 0
        self.finished = False
        self.lines, self.realtime = [], []
        self.number = 0                    # of the next line
        self.last, self.answer = b"", None  # the last one, and its answer
        self.earlier = {}                  # lines before it, and their answers
        self.guarded = False
        self.offset = "0.0000,0.0000,0.0000"  # of the program's frame, for status reports
        self.held = False
        self.out = deque()
        self._in = bytearray()
        self._last = None
        self._quiet_ms = 0                 # since the last byte
        self.say(GREETING)

    def say(self, line):
        self.out.extend(line.encode() + b"\r\n")

    def hold(self, place, cut=b""):
        """The memory reads wrong at ``place``, in the middle of a line: nothing else comes."""
        self.held = True
        self.out.extend(cut + b"\r\nALARM:155 memory parity at 0x%08X\r\n" % place)

    def drain(self, count):
        """Let a millisecond pass: ``count`` bytes of the tape are read, a half frame given up."""
        self.buffered = max(0, self.buffered - count)
        self._quiet_ms += 1
        if self._quiet_ms > STALLED_MS and self._in[:1] == b"\x02":
            self._in.clear()

    def feed(self, data):
        """Take bytes; real-time ones before all others."""
        if self.held:
            return
        self._quiet_ms = 0
        for byte in data:
            if byte in b"?!~\x18\xb0":
                self._realtime(byte)
            else:
                self._in.append(byte)
        while self._in and self._step():
            pass

    def _realtime(self, byte):
        self.realtime.append(byte)
        if byte == ord("?"):
            self.say(f"<Idle|MPos:0.000,0.000,0.000|WCO:{self.offset}>")
        elif byte == 0x18:
            self._in.clear()
            self.number, self.answer, self.guarded = 0, None, False
            self.earlier.clear()
            self.say(GREETING)

    def _step(self):
        if self._in[0] == 0x02:
            return self._frame()
        ends = [at for at in (self._in.find(b"\n"), self._in.find(b"\x02")) if at >= 0]
        if not ends:
            return False
        line = bytes(self._in[:min(ends)])
        cut = self._in[min(ends)] == 0x02
        del self._in[:min(ends) + (not cut)]
        if line:
            self._line(line, cut)
        return True

    def _line(self, line, cut):
        if not line.startswith(b"@"):
            if cut or self.guarded:
                self.say("error:108")
            else:
                self._obey(line.decode(), "")
            return
        text, star, check = line.rpartition(b"*")
        number, space, command = text[1:].partition(b" ")
        if cut or not (star and space and number.isdigit() and len(check) == 4
                       and b"%04X" % crc16(text) == check):
            self.say("error:108")
        elif self.answer is not None and line == self.last:
            if self.answer:
                self.say(self.answer)
        elif line in self.earlier:
            if self.earlier[line]:
                self.say(self.earlier[line])
        elif int(number) != self.number:
            self.say(f"error:108 @{int(number)}")
        else:
            self.guarded = True
            self.number = (self.number + 1) % 65536
            self.earlier[self.last] = self.answer
            while len(self.earlier) > KNOWN - 1:
                del self.earlier[next(iter(self.earlier))]
            self.last = line
            self._obey(command.decode(), f" @{int(number)}")

    def _obey(self, line, suffix):
        self.lines.append(line)
        answer = self.script(self, line) if self.script else None
        answer = "ok" if answer is None else answer
        self.answer = answer and answer + suffix
        if answer:
            self.say(self.answer)

    def _frame(self):
        ends = [at for at in (self._in.find(b"\x02", 1), self._in.find(b"\x03")) if at >= 0]
        if not ends:
            return False
        body, whole = unstuffed(self._in[1:min(ends)]), self._in[min(ends)] == 0x03
        del self._in[:min(ends) + whole]
        if not whole:
            return True  # the next one has begun
        length, sequence = (*body, 0, 0)[:2]
        count = 0 if length in (0, 0xFF) else length
        if count > 64 or len(body) != count + 4 or crc16(body[:-2]) != int.from_bytes(body[-2:]):
            self.out.extend([0x15, sequence])
        elif sequence == self._last and length != 0:
            self.out.extend([0x06, sequence])
        elif length != 0 and sequence != (0 if self._last is None else (self._last + 1) % 256):
            self.out.extend([0x15, sequence])
        elif self.buffered + count <= self.room:
            self._accept(length, sequence, body[2:-2])
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
