# SPDX-License-Identifier: Apache-2.0
"""Arming the gap oscilloscope over the link, and reading its record, a line at a time.

The lines are those of ``softcore/firmware/app/scope.h``. The owner of the link sends the line that
``Acquisition.line`` returns, and gives every received line to ``hear``. So nothing here waits, and
a run or a panel goes on meanwhile.
"""

import re
from dataclasses import dataclass

from host.errors import UsageError, UserError
from host.link.framing import crc
from host.link.link import LinkError
from host.machines.machine import CONVERTER_V
from host.scope.record import Record

__all__ = ["TRIGGERS", "Acquisition", "Trigger"]

# By the word of the command line: the word of the controller's line, and the meaning.
TRIGGERS = {
    "now": ("NOW", "at once"),
    "short": ("SHORT", "Ss rises"),
    "arc": ("ARC", "a pulse was an arc (dame)"),
    "retraction": ("RETRACTION", "a retraction starts"),
    "open": ("OPEN", "a pulse was open"),
    "ok": ("OK", "a pulse was a good discharge"),
    "shorted": ("SHORTED", "a pulse was shorted"),
    "rise": ("RISE", "the voltage rises to the level"),
    "fall": ("FALL", "the voltage falls below the level"),
}
CROSSES = ("rise", "fall")
BEFORE = 50         # % of the record before the trigger
MOST_BEFORE = 99
POLL_S = 0.1        # between two questions for the state
CHUNK = 256         # entries asked for at once
DAMAGED = 10        # times that a part may arrive damaged

_STATE = re.compile(r"SCOPE:(\w+),(\d+),(\d+),(\d+),(\d+),(\d+)")
_PART = re.compile(r"SCOPE@(\d+):((?:[0-o]{6})+)")
_CHECKED = re.compile(r"\[(SCOPE[:@].*)\*([0-9A-F]{4})\]")


@dataclass(frozen=True)
class Trigger:
    """What the oscilloscope waits for.

    ``word`` is one of ``TRIGGERS``. ``level_v`` is the level of ``rise`` or ``fall`` in V, and None
    for the others. ``before`` is the share of the record before the trigger, in %.

    Raises
    ------
    UsageError
        If a word or a number is not possible.
    """

    word: str = "now"
    level_v: float | None = None
    before: int = BEFORE

    def __post_init__(self) -> None:
        if self.word not in TRIGGERS:
            raise UsageError(f'"{self.word}" is no trigger: {", ".join(TRIGGERS)}.')
        if not 0 <= self.before <= MOST_BEFORE:
            raise UsageError(f"the share before the trigger is 0 to {MOST_BEFORE} %, not "
                             f"{self.before}.")
        if (self.word in CROSSES) != (self.level_v is not None):
            raise UsageError("the triggers rise and fall, and no others, need a level in V.")
        if self.level_v is not None and not 0 <= self.level_v < CONVERTER_V:
            raise UsageError(f"the level is 0 V to below {CONVERTER_V:g} V, not {self.level_v:g}.")

    @classmethod
    def of(cls, text: str, before: int = BEFORE) -> "Trigger":
        """The trigger that a text names: a word of ``TRIGGERS``, ``rise=V`` or ``fall=V``.

        Raises
        ------
        UsageError
            If the text names no trigger.
        """
        word, equals, level = text.partition("=")
        try:
            return cls(word.strip().lower(), float(level) if equals else None, before)
        except ValueError:
            raise UsageError(f'"{level}" is no level: give volts, such as {word}=60.') from None

    @property
    def line(self) -> str:
        """The line that arms the controller's oscilloscope."""
        level = "" if self.level_v is None else f",{int(self.level_v / CONVERTER_V * 4096)}"
        return f"$SCOPE={TRIGGERS[self.word][0]},{self.before}{level}"


class Acquisition:
    """One record: arms the oscilloscope, waits for the trigger, and reads the record.

    ``state`` is the oscilloscope's: ``idle``, ``armed``, ``triggered`` or ``full``; ``record`` is
    None until the record has been read. One line may be under way at a time: after ``line`` has
    given one, ``answered`` must be called before the next. With ``most``, only so many entries are
    read, the oldest; the trigger's must be among them.
    """

    def __init__(self, trigger: Trigger, most: int | None = None) -> None:
        self.trigger = trigger
        self.most = most
        self.state = "idle"
        self.depth = self.count = 0
        self.record: Record | None = None
        self._armed = False
        self._asked_s = 0.0
        self._order = ""                    # FORCE or STOP, still to be sent
        self._numbers = 0, 0, 0             # the trigger's entry, its clock, the clock's frequency
        self._words: dict[int, int] = {}
        self._failed = 0
        self._under_way = ""

    def force(self) -> None:
        """Trigger now."""
        self._order = "$SCOPE=FORCE"

    def line(self, now_s: float) -> str | None:
        """The line to be sent now, or None."""
        if self.record is not None or self._under_way:
            return None
        if not self._armed:
            line = self.trigger.line
        elif self._order:
            line, self._order = self._order, ""
        elif self.state == "full":
            first = self._first_missing()
            line = f"$SCOPE=READ,{first},{min(CHUNK, self.count - first)}"
        elif now_s - self._asked_s >= POLL_S:
            line, self._asked_s = "$SCOPE", now_s
        else:
            return None
        self._under_way = line
        return line

    def hear(self, line: str) -> bool:
        """Take a line of the controller; return whether it belongs to the oscilloscope."""
        if not line.startswith("[SCOPE"):
            return False
        checked = _CHECKED.fullmatch(line)
        if checked is None or f"{crc(checked[1].encode()):04X}" != checked[2]:
            return True     # damaged: its entries are asked for again
        if (state := _STATE.fullmatch(checked[1])) and self._armed and self.state != "full":
            self.state = state[1]
            self.depth, self.count, *numbers = map(int, state.groups()[1:])
            self._numbers = numbers[0], numbers[1], numbers[2]
            if self.most is not None:
                self.count = min(self.count, self.most)
        elif part := _PART.fullmatch(checked[1]):
            first, digits = int(part[1]), part[2]
            for at in range(0, len(digits), 6):
                self._words[first + at // 6] = sum(
                    ord(digit) - ord("0") << 6 * (5 - k)
                    for k, digit in enumerate(digits[at:at + 6]))
        return True

    def waits_for(self, line: str) -> bool:
        """Whether the answer to this line is still to come."""
        return bool(line) and self._under_way == line

    def answered(self, answer: str, message: str = "") -> None:
        """Take the answer to the last line: ``ok``, or an error with the controller's sentence.

        Raises
        ------
        UserError
            If the controller refuses it, or the record cannot be read.
        """
        line, self._under_way = self._under_way, ""
        if answer != "ok":
            raise UserError(f'the controller refuses "{line}": {message or answer}')
        if line == self.trigger.line and not self._armed:
            self._armed = True
            self.state = "armed"
        elif line == "$SCOPE" and self.state == "idle":
            raise UserError("the oscilloscope was stopped before its record was full.")
        elif line.startswith("$SCOPE=READ"):
            self._read(int(line.split(",")[1]))

    def _first_missing(self) -> int:
        return next(at for at in range(self.count) if at not in self._words)

    def _read(self, first: int) -> None:
        if len(self._words) == self.count:
            trigger, cycle, clock_hz = self._numbers
            words = [self._words[at] for at in range(self.count)]
            self.record = Record.of(words, clock_hz=clock_hz, trigger=trigger, cycle=cycle)
        elif self._first_missing() < min(first + CHUNK, self.count):
            self._failed += 1
            if self._failed == DAMAGED:
                raise LinkError("the record of the oscilloscope arrives damaged again and again.")
