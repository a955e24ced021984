# SPDX-License-Identifier: Apache-2.0
"""Senders for grbl 1.1 in the manner of four known ones: how they shake hands, read and stop.

Our own code, written after what those programs do: Universal Gcode Sender, CNCjs, Candle and bCNC.
Each reads as strictly as its model, and raises ``NotUnderstoodError`` where that would show a wrong
value, count a wrong answer, or wait for ever. They share what all senders do: status reports five
times a second, and lines ahead of their answers as long as grbl's buffer of 128 bytes holds them.
"""

import re
from collections import deque
from collections.abc import Callable, Iterable
from typing import Protocol

__all__ = ["STYLES", "Bcnc", "Candle", "Cncjs", "NotUnderstoodError", "Sender", "Ugs"]

RECEIVED_AHEAD = 127    # bytes: grbl's buffer, of which one place stays free
POLL_S = 0.2
PATIENCE_S = 30.0       # of the machine's time
HOLD, RESUME, RESET, STATUS = b"!", b"~", b"\x18", b"?"
PLACES = ("G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92")


class NotUnderstoodError(Exception):
    """A line that the model of this sender would not take for what it is."""


class Pipe(Protocol):
    """The way to the controller: ``host.link.port.Port``."""

    def write(self, data: bytes) -> None: ...
    def read(self, timeout_s: float) -> bytes: ...


class Sender:
    """What all of them do. ``clock`` tells the machine's time in seconds."""

    END = "\n"

    def __init__(self, port: Pipe, clock: Callable[[], float]) -> None:
        self.port, self.clock = port, clock
        self.text = ""
        self.polls = True
        self._polled_s = clock()
        self.pending: deque[str] = deque()      # lines sent and not answered
        self.errors: list[tuple[str, str]] = []     # lines that were refused, and by what
        self.alarms: list[str] = []
        self.settings: dict[str, float] = {}
        self.places: dict[str, tuple[float, ...]] = {}
        self.modes: list[str] = []
        self.state, self.place, self.reports = "", (0.0, 0.0, 0.0), 0
        self.greetings = 0

    # ---- what differs

    def connect(self) -> None:
        """Shake hands, and read what the controller has."""
        raise NotImplementedError

    def stop(self) -> None:
        """Break a program off, as by the button; return when the sender takes it for done."""
        raise NotImplementedError

    def take(self, line: str) -> None:
        """Read a line that is no status report."""
        raise NotImplementedError

    def read_report(self, line: str) -> None:
        """Read a status report: ``state``, ``place``."""
        raise NotImplementedError

    # ---- what does not

    def send(self, line: str) -> None:
        """Send a line."""
        self.pending.append(line)
        self.port.write((line + self.END).encode("ascii"))

    def ask(self, line: str) -> bool:
        """Send a line and wait for its answer; whether that was ``ok``."""
        before = len(self.errors)
        self.send(line)
        self.until(lambda: not self.pending, line)
        return len(self.errors) == before

    def stream(self, lines: Iterable[str], stop_at: Callable[[], bool] = lambda: False) -> None:
        """Send lines as long as there is room, until all are answered or ``stop_at()``."""
        for line in lines:
            size = len(line + self.END)
            self.until(lambda size=size: stop_at() or self.ahead() + size <= RECEIVED_AHEAD, line)
            if stop_at():
                return
            self.send(line)
        self.until(lambda: not self.pending or stop_at(), "the answers")

    def ahead(self) -> int:
        """Bytes sent and not answered."""
        return sum(len(line + self.END) for line in self.pending)

    def rest(self) -> None:
        """Wait for two reports of Idle at one place."""
        self.settled("Idle")

    def settled(self, *states: str) -> None:
        """Wait for two reports in a row of one place, in one of some states."""
        seen: list[tuple[float, ...]] = []

        def again() -> bool:
            if self.reports == count[0]:
                return False
            count[0] = self.reports
            seen.append(self.place if self.state in states else ())
            return len(seen) > 1 and seen[-1] == seen[-2] != ()
        count = [self.reports]
        self.until(again, f"{states} at rest")

    def until(self, holds: Callable[[], bool], what: str) -> None:
        """Read until ``holds()``; that the patience ends is an error."""
        end = self.clock() + PATIENCE_S
        while not holds():
            if self.clock() > end:
                raise NotUnderstoodError(f"{what} does not come: {self.state}, {self.pending}, "
                                         f"{self.errors[-3:]}")
            if self.polls and self.clock() - self._polled_s > POLL_S:
                self._polled_s = self.clock()
                self.port.write(STATUS)
            self.text += self.port.read(0.01).decode("ascii")
            *lines, self.text = self.text.split("\r\n")
            for line in filter(None, lines):
                if line.startswith("<"):
                    self.reports += 1
                    self.read_report(line)
                else:
                    self.take(line)

    def answered(self, answer: str) -> None:
        """The oldest line has its answer."""
        if not self.pending:
            raise NotUnderstoodError(f"{answer!r} answers no line")
        line = self.pending.popleft()
        if "error" in answer:
            self.errors.append((line, answer))


def _found(pattern: str, line: str) -> re.Match[str]:
    found = re.search(pattern, line)
    if not found:
        raise NotUnderstoodError(line)
    return found


def _numbers(text: str, count: int) -> tuple[float, ...]:
    try:
        numbers = tuple(float(number) for number in text.split(","))
    except ValueError as error:
        raise NotUnderstoodError(text) from error
    if len(numbers) != count:
        raise NotUnderstoodError(text)
    return numbers


class Ugs(Sender):
    """In the manner of Universal Gcode Sender: never resets on connecting, unless it must."""

    NUMBER = r"(-?\d*\.?\d*)"
    STATES = ("jog", "run", "hold", "door", "home", "idle", "alarm", "check", "sleep")

    def __init__(self, port, clock):
        super().__init__(port, clock)
        self.version, self.options = "", ""

    def connect(self):
        self.until(lambda: self.reports, "a report")
        if self.state.startswith(("Hold", "Alarm")) and not self.ask(""):
            raise NotUnderstoodError("it does not answer a blank line, and would be reset")
        for line in ("$I", "$$", "$G"):
            if not self.ask(line):
                raise NotUnderstoodError(line)
        if self.version != "1.1h" or "$13" not in self.settings or not self.modes:
            raise NotUnderstoodError(f"{self.version}, {self.modes}, {self.settings}")

    def stop(self):
        self.port.write(HOLD)
        self.settled("Hold:0", "Hold:1")
        before = self.greetings
        self.port.write(RESET)
        self.until(lambda: self.greetings > before, "the greeting")
        self.until(lambda: self.state in ("Idle", "Alarm"), "Idle")

    def take(self, line):
        if line.startswith(("ok", "error")):
            self.answered(line)
        elif line.startswith("ALARM"):
            self.alarms.append(_found(r"^ALARM:(\d+)$", line)[1])
        elif line.startswith("Grbl "):
            self.greetings += bool(_found(r"\d*\.\d*", line))
            self.pending.clear()
            self.state = ""
        elif line.startswith("[VER:"):
            self.version = _found(r"^\[VER:[vV]?(\d+\.\d+[a-zA-Z]?).*]$", line)[1]
        elif line.startswith("[OPT:"):
            self.options = _found(r"^\[OPT:([A-Z]*),", line)[1]
        elif line.startswith("[GC:"):
            self.modes = line[4:-1].split()
        elif line.startswith("[PRB:"):
            _found(r"^\[PRB:(-?\d*\.\d*),(-?\d*\.\d*),(-?\d*\.\d*):\d?]$", line)
        elif found := re.fullmatch(r"(\$\d+)=(.+)", line):
            self.settings[found[1]] = float(found[2])

    def read_report(self, line):
        _found(r"^<[a-zA-Z:0-9]+[|]+.*>$", line)
        state, *fields = line[1:-1].split("|")
        if state.partition(":")[0].lower() not in self.STATES:
            raise NotUnderstoodError(line)
        place = _found(r"(?<=MPos:)" + ",".join([self.NUMBER] * 3), line)
        self.place = tuple(map(float, place.groups()))
        _found(r"(?<=WCO:)" + ",".join([self.NUMBER] * 3), line)
        for field in fields:
            if field.startswith("Ov:") and not re.fullmatch(r"\d+,\d+,\d+", field[3:]):
                raise NotUnderstoodError(line)
            if field.startswith("FS:"):
                _numbers(field[3:], 2)
        self.state = state


class Cncjs(Sender):
    """In the manner of CNCjs: nothing before a greeting; ``$G`` twice a second, also in a program.

    The ``ok`` behind a ``[GC:`` is that of ``$G``, any other one of the program.
    """

    MODES_S = 0.5

    def __init__(self, port, clock):
        super().__init__(port, clock)
        self.polls = False
        self.asked, self.modes_told, self._asked_s = False, False, 0.0
        self.room = 128 - 8

    def connect(self):
        self.port.write(RESET)      # its button; a board of grbl's is reset by opening the port
        self.until(lambda: self.greetings, "the greeting")
        self.polls = True
        if not self.ask("$$") or self.settings.get("$13") != 0:
            raise NotUnderstoodError(str(self.settings))
        self.until(lambda: self.reports, "a report")

    def ahead(self):
        return RECEIVED_AHEAD - self.room + super().ahead()

    def until(self, holds, what):
        def also():
            if self.polls and not self.asked and self.clock() - self._asked_s > self.MODES_S:
                self.asked, self._asked_s = True, self.clock()
                self.port.write(b"$G\n")
            return holds()
        super().until(also, what)

    def stop(self):
        self.port.write(HOLD)
        end = self.clock() + 0.5
        self.until(lambda: self.clock() > end, "half a second")
        before = self.greetings
        self.port.write(RESET)
        self.until(lambda: self.greetings > before, "the greeting")
        self.state = ""
        self.until(lambda: self.state, "a report")

    def take(self, line):
        if re.match(r"^ok$", line) or re.match(r"^error:\s*(.+)$", line):
            if self.modes_told:
                self.asked = self.modes_told = False
            else:
                self.answered(line)
        elif found := re.match(r"^ALARM:\s*(.+)$", line):
            self.alarms.append(found[1])
        elif re.match(r"^\[(?:GC:)", line):
            words = _found(r"^\[(?:GC:)?((?:[GMTFS]\d+(?:\.\d*)?\s+)+(?:[GMTFS]\d+(?:\.\d*)?))\]$",
                           line)
            self.modes = words[1].split()
            self.modes_told = True
        elif found := re.match(r"^\[(G5[4-9]|G28|G30|G92):(.+)\]$", line):
            self.places[found[1]] = _numbers(found[2], 3)
        elif found := re.match(r"^(\$[^=]+)=([^ ]*)\s*(.*)", line):
            self.settings[found[1]] = float(found[2])
        elif re.match(r"^[a-zA-Z0-9]+\s+(?:\d+\.){1,2}\d+[a-zA-Z0-9\-.]*[^\[]*\[[^\]]+\].*", line):
            self.greetings += 1
            self.pending.clear()
            self.asked = self.modes_told = False

    def read_report(self, line):
        state, *found = re.findall(r"([a-zA-Z]+(?::[0-9.\-]+(?:,[0-9.\-]+){0,5})?)", line)
        fields = dict(field.split(":") for field in found if ":" in field)
        self.place = _numbers(fields["MPos"], 3)
        _numbers(fields["WCO"], 3)
        _numbers(fields["FS"], 2)
        _numbers(fields["Ov"], 3)
        blocks, room = _numbers(fields["Bf"], 2)
        if not self.pending and not self.asked and blocks:
            self.room = max(self.room, int(room) - 8)
        self.state = state


class Candle(Sender):
    """In the manner of Candle: what has "ok" or "error" anywhere in it ends the oldest line."""

    END = "\r"
    STATES = ("Idle", "Alarm", "Run", "Home", "Hold:0", "Hold:1", "Queue", "Check", "Jog", "Sleep")
    FLOATING = ("Reset to continue", "'$H'|'$X' to unlock", "Check Door")

    def __init__(self, port, clock):
        super().__init__(port, clock)
        self.resetting = False
        self.response = ""

    def connect(self):
        self._reset()
        for line, count in (("$$", 3), ("$#", len(PLACES))):
            if not self.ask(line):
                raise NotUnderstoodError(line)
            if len(self.settings if line == "$$" else self.places) < count:
                raise NotUnderstoodError(self.response)
        self.until(lambda: self.reports, "a report")

    def _reset(self):
        before, self.resetting = self.greetings, True
        self.port.write(RESET)
        self.until(lambda: self.greetings > before, "the greeting")

    def stop(self):
        restored = [word for word in self.modes if word.startswith("G")]
        self.port.write(HOLD)
        self.settled("Hold:0", "Hold:1")
        self._reset()
        self.state = ""
        self.until(lambda: self.state == "Idle", "Idle")
        if not self.ask(" ".join(restored) or "G90"):
            raise NotUnderstoodError(f"the state is not restored: {restored}")

    def take(self, line):
        if re.match(r"^GRBL\s\d\.\d.", line.upper()):
            self.greetings, self.resetting = self.greetings + 1, False
            self.pending.clear()
            return
        if self.resetting or any(text in line for text in self.FLOATING):
            return
        if line.startswith("ALARM:"):
            self.alarms.append(line[6:])
        if not self.pending:
            return
        if "ok" in line or "error" in line:
            self.response += line
            self._end(self.response)
            self.response = ""
        else:
            self.response += line + "; "

    def _end(self, response):
        line = self.pending[0]
        if line == "$$":
            self.settings = {f"${number}": float(value) for number, value in
                             re.findall(r"\$(\d+)=([^;]+); ", response)}
        elif line == "$#":
            for place in re.findall(r"\[(G5[4-9]|G28|G30|G92|PRB):([\d.\-]+),([\d.\-]+),([\d.\-]+)",
                                    response):
                self.places[place[0]] = tuple(map(float, place[1:]))
        elif line == "$G":
            self.modes = _found(r"\[GC:([^\]]*)\]", response)[1].split()
        if not re.search(r"(?:^|; )(?:ok|error:\d+)$", response):
            raise NotUnderstoodError(f"{response!r} ends {line!r}")
        self.answered(response)

    def read_report(self, line):
        state = _found(r"<([^,^>^|]*)", line)[1]
        if state not in self.STATES:
            raise NotUnderstoodError(line)
        triple = r":([^,]*),([^,]*),([^,^>^|]*)"
        self.place = tuple(map(float, _found("MPos" + triple, line).groups()))
        for name in ("WCO", "Ov"):
            _numbers(",".join(_found(name + triple, line).groups()), 3)
        _numbers(",".join(_found(r"FS:([^,]*),([^,^|^>]*)", line).groups()), 2)
        burns = re.search(r"A:([^,^>^|]+)", line)
        if burns and set(burns[1]) - set("SCFM"):
            raise NotUnderstoodError(line)
        self.state = state


class Bcnc(Sender):
    """In the manner of bCNC: splits every line in brackets at colons and commas."""

    def connect(self):
        self.port.write(b"%" + RESUME + b"\n\n\n")
        self.pending.extend(["%", "", ""])
        self.until(lambda: not self.pending, "the answers")
        for line in ("$$", "$#", "$G"):
            if not self.ask(line):
                raise NotUnderstoodError(line)
        if set(self.places) < set(PLACES) or not self.modes or self.settings["$32"]:
            raise NotUnderstoodError(f"{self.places}, {self.modes}")
        self.until(lambda: self.reports, "a report")

    def stop(self):
        self.port.write(HOLD)
        end = self.clock() + 1
        self.until(lambda: self.clock() > end, "a second")
        restored = " ".join(word for word in self.modes if word.startswith("G"))
        before = self.greetings
        self.port.write(RESET)
        self.until(lambda: self.greetings > before, "the greeting")
        if not self.ask(restored):
            raise NotUnderstoodError(f"the state is not restored: {restored}")
        self.ask("G43.1Z0.0000")    # whether there is an offset or not
        self.ask("$G")
        self.state = ""
        self.until(lambda: self.state, "a report")

    def take(self, line):
        if line.startswith("["):
            name, *values = re.split("[:,]", line[1:-1])
            if name in PLACES:
                self.places[name] = _numbers(",".join(values), 3)
            elif name == "GC":
                self.modes = values[0].split()
                for word in self.modes:
                    float(word[1:])
        elif "error:" in line:
            self.answered(line)
        elif "ALARM:" in line:
            self.alarms.append(line[6:])
        elif "ok" in line:
            self.answered(line)
        elif line.startswith("$"):
            number, value = _found(r"^\$(\d+)=(\d*\.?\d*) *\(?.*", line).groups()
            self.settings[f"${number}"] = float(value)
        elif line.startswith("Grbl"):
            if line.split()[1][0] != "1":
                raise NotUnderstoodError(line)
            self.greetings += 1
            self.pending.clear()

    def read_report(self, line):
        state, *fields = line[1:-1].split("|")
        for field in fields:
            name, *values = re.split("[:,]", field)
            if name in ("MPos", "WCO"):
                place = _numbers(",".join(values), 3)
                self.place = place if name == "MPos" else self.place
            elif name in ("FS", "Bf"):
                _numbers(",".join(values), 2)
            elif name == "Ov":
                _numbers(",".join(values), 3)
            elif name == "Pn" and "S" in values[0]:
                raise NotUnderstoodError("it would begin the program")
        self.state = state


STYLES = (Ugs, Cncjs, Candle, Bcnc)
