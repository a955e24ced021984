# SPDX-License-Identifier: Apache-2.0
"""The firmware on this computer: its check of tapes, and all of it on a model machine."""

import ctypes
from binascii import crc_hqx
from dataclasses import dataclass

from host.link.compact import Expander
from softcore.image import host_library
from softcore.tables import states
from softcore.tables.events import numbered
from softcore.tables.faults import FAULTS
from testbench.models.arc import Piece
from testbench.native.build import flash_library
from testbench.native.flash import Flash

ITEMS = "RLHEQZ"
REST = 120      # passes of the main loop that take a machine to rest at the end of its path
ACTS = ("none", "dwell", "retraction", "defaults", "jump", "set position", "table",
        "depth series", "planned", "touch")
STOPS = ("none", "program", "optional", "end")
STATES = tuple(state.name for state in states.MOTION)
KINDS = ("none", *(event.name for event in numbered()))
BOUNDS = ("ahead", "behind", "back_limit", "fast_ahead", "fast_behind", "fast_ahead_rate",
          "fast_behind_rate")


class Record(ctypes.Structure):
    """Effect of a block: ``gk_record`` of host.h."""

    _fields_ = [
        ("line", ctypes.c_uint32),
        ("moves", ctypes.c_int32), ("delta", ctypes.c_int32 * 3), ("speed", ctypes.c_uint32),
        ("act", ctypes.c_int32), ("stop", ctypes.c_int32), ("machining", ctypes.c_int32),
        ("condition", ctypes.c_int32), ("s", ctypes.c_int32), ("t", ctypes.c_int32),
        ("m", ctypes.c_int32 * 6), ("fluid_off", ctypes.c_int32),
        ("given", ctypes.c_uint32), ("items", ctypes.c_int64 * 6), ("dwell", ctypes.c_uint64),
        ("jump_period", ctypes.c_uint32), ("jump_distance", ctypes.c_int32),
        ("jump_speed", ctypes.c_uint32), ("jump_high", ctypes.c_uint32),
        ("servo", ctypes.c_int32), ("arc", ctypes.c_int32), ("plane", ctypes.c_int32),
        ("centre", ctypes.c_int32 * 2), ("offset", ctypes.c_int32 * 3), ("skipped", ctypes.c_int32),
        ("via", ctypes.c_int32 * 3),
    ]


class Segment(ctypes.Structure):
    """A segment as written to the gateware: ``gk_segment`` of host.h."""

    _fields_ = [
        ("length", ctypes.c_uint32), ("rate", ctypes.c_uint32), ("highest", ctypes.c_uint32),
        ("delta", ctypes.c_int32 * 3),
        ("arc", ctypes.c_uint32), ("outward", ctypes.c_uint32), ("away", ctypes.c_uint32),
        ("major", ctypes.c_uint32),
        ("minor", ctypes.c_uint32), ("shift", ctypes.c_uint32), ("change", ctypes.c_int32),
        ("start", ctypes.c_int32 * 4), ("end", ctypes.c_int32 * 4),
    ]

    def piece(self) -> Piece:
        """The same, for the model."""
        return Piece(self.length, tuple(self.delta), bool(self.arc), bool(self.outward),
                     self.major, self.minor, self.shift, self.change, tuple(self.start),
                     tuple(self.end))


class Move(ctypes.Structure):
    """A line or an arc: ``path_move`` of move.h."""

    _fields_ = [
        ("delta", ctypes.c_int32 * 3), ("arc", ctypes.c_bool), ("ccw", ctypes.c_bool),
        ("plane", ctypes.c_int32), ("centre", ctypes.c_int32 * 2),
    ]


class Motion(ctypes.Structure):
    """A line or an arc that the machine would make: ``gk_motion`` of host.h."""

    _fields_ = [
        ("line", ctypes.c_uint32), ("delta", ctypes.c_int32 * 3), ("arc", ctypes.c_int32),
        ("plane", ctypes.c_int32), ("centre", ctypes.c_int32 * 2), ("speed", ctypes.c_uint32),
    ]


class Scope(ctypes.Structure):
    """The oscilloscope of the model machine: ``gk_scope`` of host.h."""

    _fields_ = [
        *((name, ctypes.c_uint32) for name in (
            "depth", "source", "classes", "level", "after", "recording", "count", "time")),
        ("entries", ctypes.c_uint64 * 64),
    ]


@dataclass(frozen=True)
class Fault:
    """A fault that the firmware found. ``line`` and ``column`` are 0 if it has none."""

    code: int
    line: int
    column: int
    sentence: str

    @property
    def name(self) -> str:
        """Its name in the table of faults."""
        return next(fault.name for fault in FAULTS if fault.number == self.code)


def library(sanitize: str = "undefined") -> ctypes.CDLL:
    """Load the firmware; undefined behaviour that the sanitizer detects ends the process."""
    loaded = ctypes.CDLL(str(host_library(sanitize)))
    loaded.gk_check_forget()
    return loaded


class Checker:
    """Reader, words and their meaning, without motion."""

    RECORDS = 400

    def __init__(self, sanitize: str = "undefined"):
        self.library = library(sanitize)
        self._records = (Record * self.RECORDS)()
        self._motions = (Motion * self.RECORDS)()
        self._sentence = ctypes.create_string_buffer(256)

    def enter(self, line: str) -> str:
        """Enter a line by hand; return why the firmware refuses it, or an empty string."""
        refused = self.library.gk_check_line(line.encode(), self._sentence, 256)
        return self._sentence.value.decode() if refused else ""

    def forget(self) -> None:
        """Undo all lines entered by hand."""
        self.library.gk_check_forget()

    def check(self, tape: bytes, *, tv: bool = False) -> list[Record] | Fault:
        """Blocks of a tape, or its first fault."""
        place = (ctypes.c_uint32 * 3)()
        blocks = self.library.gk_check_records(bytes(tape), len(tape), tv, self._records,
                                               self.RECORDS, place, self._sentence, 256)
        if blocks < 0:
            return Fault(*place, self._sentence.value.decode())
        return self._records[:blocks]

    def motions(self, tape: bytes) -> list[Motion] | Fault:
        """Motions of the machine on a tape, with the wire offset; or the first fault."""
        place = (ctypes.c_uint32 * 3)()
        count = self.library.gk_check_motions(bytes(tape), len(tape), self._motions, self.RECORDS,
                                              place, self._sentence, 256)
        if count < 0:
            return Fault(*place, self._sentence.value.decode())
        return self._motions[:count]


class Arc:
    """An arc, cut into pieces by the firmware. The library holds only the last one.

    ``directions`` are the tangents at its start and end, 2**-15; ``steps`` is the number of calls
    that were needed to prepare it.
    """

    def __init__(self, move: Move, sanitize: str = "undefined"):
        self._library = library(sanitize)
        numbers, directions = (ctypes.c_uint32 * 4)(), (ctypes.c_int32 * 3 * 2)()
        self._library.gk_arc(move.delta, move.ccw, move.plane, move.centre, numbers, directions)
        self.pieces, self.length, self.radius, self.steps = numbers
        self.directions = [tuple(direction) for direction in directions]

    def piece(self, index: int) -> tuple[int, Piece]:
        """Path pulses before a piece, and the piece."""
        words = Segment()
        start = self._library.gk_arc_piece(index, ctypes.byref(words))
        return start, words.piece()


class Memory(Flash):
    """A flash memory of its own, for ``Controller``."""

    def __init__(self, *, seed: int = 1, clock_hz: int = 2_000_000):
        code = ctypes.CDLL(str(flash_library()))
        super().__init__(code, 0)
        self.handle = code.flash_create(seed, clock_hz)

    def __del__(self):
        self.library.flash_free(self.handle)


class Controller:
    """The whole firmware on the model machine of ``hal_host.c``.

    A pass of the main loop counts 1000 clocks. ``memory`` is its flash memory; without one there is
    one that is blank at the start. Lines that came are in ``lines``; acknowledgements of frames in
    ``marks``.
    """

    def __init__(self, *, clock_hz=2_000_000, pulses_per_mm=10_000, jump_axis=2,
                 sanitize="undefined", memory: Memory | None = None):
        self.library = library(sanitize)
        self.clock_hz = clock_hz
        self.memory = memory
        order = memory and ctypes.cast(memory.library.flash_order, ctypes.c_void_p)
        self.library.gk_flash(order, ctypes.c_void_p(memory and memory.handle))
        self.lines, self.marks = [], []
        self._open = bytearray()
        self._full = Expander()
        self.library.gk_boot(clock_hz, pulses_per_mm, jump_axis)
        self.run(100)

    def run(self, passes: int = 200) -> list[str]:
        """Run the main loop; return the lines that came meanwhile."""
        self.library.gk_pass(passes)
        buffer = ctypes.create_string_buffer(65536)
        count = self.library.gk_receive(buffer, len(buffer))
        came = self._take(buffer.raw[:count])
        self.lines += came
        return came

    def _take(self, data):
        came = []
        for byte in data:
            mark = self._open[:1] and self._open[0] in (0x06, 0x15)
            self._open.append(byte)
            if mark:
                self.marks.append(tuple(self._open))
                self._open.clear()
            elif self._open.endswith(b"\r\n"):
                came.append(self._full(self._open[:-2].decode("ascii")))
                self._open.clear()
        return came

    def send(self, data: bytes) -> None:
        """Send bytes to the firmware."""
        self.library.gk_send(bytes(data), len(data))

    def line(self, text: str, passes: int = 400) -> list[str]:
        """Send a line, or the byte ``?``; return the lines of the next passes."""
        self.send(text.encode() + b"\n" * (text != "?"))
        return self.run(passes)

    def reported_state(self) -> str:
        """State in the status report, such as ``Idle``."""
        (report,) = (line for line in self.line("?", 30) if line.startswith("<"))
        return report[1:report.index("|")]

    def unlock(self) -> None:
        """Get ready for programs: rest, unlock, arm by hand, and accept the counted position."""
        self.run(self.clock_hz // 25_000)   # 40 ms
        assert self.line("$X")[-1] == "ok"
        self.library.gk_arm()
        assert self.line("$POSITION=HERE") == ["ok"]

    def tape(self, rows: bytes, *, passes: int = 20_000) -> list[str]:
        """Send a tape as fast as it is taken, and run it; return the lines that came."""
        count = len(self.lines)
        self.frame(0, 0)
        sequence = 0
        for start in range(0, len(rows), 64):
            sequence = (sequence + 1) % 256
            payload = rows[start:start + 64]
            self.frame(len(payload), sequence, payload)
        self.frame(0xFF, (sequence + 1) % 256)
        self.run(passes)
        return self.lines[count:]

    @staticmethod
    def framed(length: int, sequence: int, payload: bytes = b"") -> bytes:
        """Bytes of a frame."""
        body = bytes([length, sequence]) + payload
        body += crc_hqx(body, 0xFFFF).to_bytes(2)
        return b"\x02" + b"".join(
            bytes([0x10, byte ^ 0x40]) if byte in b"\x02\x03\x10\x18!?~" or 0x80 <= byte < 0xC0
            else bytes([byte]) for byte in body) + b"\x03"

    @staticmethod
    def numbered(number: int, text: str) -> bytes:
        """Bytes of a line with its number and check."""
        line = f"@{number} {text}".encode("ascii")
        return line + b"*%04X\n" % crc_hqx(line, 0xFFFF)

    def frame(self, length: int, sequence: int, payload: bytes = b"") -> None:
        """Send a frame until it is acknowledged."""
        for _ in range(200):
            self.marks.clear()
            self.send(self.framed(length, sequence, payload))
            for _ in range(20):
                self.run(40)
                if (0x06, sequence) in self.marks:
                    return
        raise TimeoutError(f"frame {sequence} was never acknowledged")

    def event(self, kind: str, detail: int, first: int = 0, second: int = 0) -> None:
        """Report an event of the gateware, with the machine's place."""
        self.library.gk_event(KINDS.index(kind), detail, first, second)

    def state(self, name: str) -> None:
        """Set the state of the retraction."""
        self.library.gk_state(STATES.index(name))

    def bound(self, name: str) -> int:
        """Bound that the firmware has written, a path coordinate."""
        return self.library.gk_bound(BOUNDS.index(name))

    def slot(self, number: int) -> Segment:
        """Words that the firmware has written into a slot."""
        words = Segment()
        self.library.gk_slot(number, ctypes.byref(words))
        return words

    @property
    def axes(self) -> tuple[int, ...]:
        """Commanded positions, pulses."""
        return tuple(self.library.gk_axis(axis) for axis in range(3))

    @property
    def flags(self) -> set[str]:
        """Names of the outputs that are on."""
        names = ("run", "hold", "discharge", "data", "safe", "held")
        return {name for bit, name in enumerate(names) if self.library.gk_flags() >> bit & 1}

    @property
    def data(self) -> dict[str, int]:
        """Retraction data in force, in the gateware's units."""
        words = (ctypes.c_uint32 * 10)()
        self.library.gk_data(words)
        names = ("rate", "limit", "high_rate", "low_rate", "changeover", "low_lead",
                 "jump_distance", "jump_rate", "jump_high_rate", "jump_period")
        return dict(zip(names, words, strict=True))

    @property
    def power(self) -> dict[str, int]:
        """Orders to the power supply: clocks, IP, steps of voltage."""
        words = (ctypes.c_uint32 * 7)()
        self.library.gk_power_read(words)
        names = ("on", "wait", "off", "rest", "level", "voltage", "negative")
        return dict(zip(names, words, strict=True))

    @property
    def gap(self) -> dict[str, object]:
        """Settings of the gap: references in 1/1024, presets, servo in clocks and pulses.

        ``counting`` is mode, window and weight; ``delay_least`` is in clocks.
        """
        words = (ctypes.c_uint32 * 19)()
        self.library.gk_gap_read(words)
        names = ("servo", "period", "step", "convert", "lag_time")
        return {"reference": tuple(words[:3]), "presets": tuple(words[3:6]),
                **dict(zip(names, words[6:11], strict=True)), "counting": tuple(words[11:14]),
                "criteria": words[14], "delay_least": words[15], "short_mean": words[16],
                "short_mean_time": words[17], "short_current": words[18]}

    @property
    def scope(self) -> Scope:
        """The oscilloscope, as the firmware has set it."""
        words = Scope()
        self.library.gk_scope_read(ctypes.byref(words))
        return words

    @scope.setter
    def scope(self, words: Scope) -> None:
        self.library.gk_scope_write(ctypes.byref(words))

    @property
    def feed_mode(self) -> dict[str, int]:
        """Words of the feed mode that the firmware has written: see ``hal_feed_mode``."""
        words = (ctypes.c_uint32 * 14)()
        self.library.gk_feed_mode_read(words)
        names = ("mode", "measure", "unit", "window", "no_load", "voltage", "drop", "least",
                 "lowest", "highest", "gain", "fastest", "shares", "share")
        return dict(zip(names, words, strict=True))


def events(lines: list[str], *names: str) -> list[list[str]]:
    """Arguments of the event lines of some names (all, if none is given), each with its name."""
    found = []
    for line in lines:
        if line.startswith("[E:"):
            name, *rest = line[3:-1].split(",", 6)
            if not names or name in names:
                found.append([name, *(rest[5].split(",") if len(rest) > 5 else [])])
    return found
