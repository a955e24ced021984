# SPDX-License-Identifier: Apache-2.0
"""Tape codec: part programs as text (``.nc``) and as punched bytes (``.ptp``).

A punched tape is: leader, start (``%`` or ER) and end of block, blocks, end (``%`` or ER), trailer.
Texts are in upper case, as both codes have one case only; small letters are punched as capitals.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from host.errors import TapeError, UsageError
from host.tape.codes import BLANK, CARRIAGE_RETURN, CODES, EIA, ISO, Code, odd
from host.tape.subprograms import COMMENT, ends_program, written_out

# A word, and anything behind it: a line that begins otherwise is not part of a program.
_BLOCK = re.compile(r"\s*(?:/\s*)?[A-Za-z:]\s*[+-]?(?:\d|\.\d)")
# Start of one of LinuxCNC's O-words, up to the word without a number.
_O_WORD = re.compile(r"\s*(?:/\s*)?(?:N\s*\d+\s*)?(?=[O:]\s*<|[O:]\s*\d+\s*[A-Z]\s*[^\s\d.+-])"
                     r"(?:[O:]\s*\d+\s*)?")
_EXPRESSION = re.compile(r"[][#=]")
_PLACE = re.compile(r"^Block (\d+)(?: \(N\d+\))?")  # start of the controller's sentences
_LINE_END = re.compile(r"\r\n|\r|\n")    # not the other line ends of Unicode
FEED_ROWS = 60  # blank rows before and behind: six inches, enough to thread the tape by hand


@dataclass(frozen=True)
class Tape:
    """Punched bytes and their source.

    ``lines`` are the line numbers of the source from which the blocks were punched, in the order of
    the tape. It is empty for a tape that was read: there the number of a block is that of its line.
    """

    rows: bytes
    code: Code
    lines: tuple[int, ...] = field(default=(), compare=False)

    def line(self, block: int) -> int:
        """Line of the source of a block; the start of the tape is block 1."""
        return self.lines[block - 1] if 0 < block <= len(self.lines) else block

    def told(self, sentence: str) -> str:
        """A sentence of the controller on a block of this tape, with the source line added."""
        if not self.lines:
            return sentence
        return _PLACE.sub(lambda found: f"{found[0]}, line {self.line(int(found[1]))}", sentence)


def _punchable(line: str, code: Code, *, kept: bool) -> str:
    """A line in capitals; in comments a space replaces each character that the code lacks.

    The start of a comment is never replaced: without it the comment would be words of the program.
    In a line that is not ``kept``, behind the end word, characters are replaced everywhere.
    """
    if not kept:
        return "".join(char.upper() if char.upper() in code.punch and char != "%" else " "
                       for char in line)
    line = "".join(char.upper() if char.isascii() else char for char in line)
    return COMMENT.sub(lambda found: found[0][0] + "".join(
        char if char in code.punch and char != "%" else " " for char in found[0][1:]), line)


def _without_code(line: str, column: int, code: Code) -> tuple[str, int]:
    """Why a character cannot be punched, and where.

    If it is a part of what another control has, that is named, in the words of
    softcore/firmware/interp/block.c.
    """
    read = COMMENT.sub(lambda found: " " * len(found[0]), line)[:column]
    if found := _O_WORD.match(read):
        return ("O-words (sub, call, if, while and so on) are not in this version; write the moves "
                "out."), found.end() + 1
    if found := _EXPRESSION.search(read):
        return ("variables and expressions (# [ ] =) are not in this version; write the number.",
                found.start() + 1)
    char = line[column - 1]
    shown = f'"{char}"' if char.isprintable() else f"character U+{ord(char):04X}"
    return f"{code.title} tape has no code for {shown}.", column


def _stands_alone(line: str) -> bool:
    return line.strip() == "%"


def _begin(lines: Sequence[str]) -> int:
    """Index of the program's first line: behind the ``%`` that starts it, if there is one.

    Lines before that are leader, which no machine reads.

    Raises
    ------
    TapeError
        If the leader may be blocks of a program, or more than a ``%`` starts it.
    """
    first = next((n for n, line in enumerate(lines) if line.strip()), len(lines))
    if first == len(lines):
        raise TapeError("the text is empty: there is nothing to punch.", 1, of_text=True)
    if lines[first].strip().startswith("%") and not _stands_alone(lines[first]):
        raise TapeError("% must stand alone on its line; a name of the program is written O and a "
                        "number, on the next.", first + 1, lines[first].index("%") + 2,
                        of_text=True)
    start = next((n for n, line in enumerate(lines) if _stands_alone(line)), None)
    if start is None or any(ends_program(line) for line in lines[first:start]):
        return first
    if not any(line.strip() for line in lines[start + 1:]):
        return first
    for number, line in enumerate(lines[first:start], start=first + 1):
        if _BLOCK.match(COMMENT.sub("", line)):
            raise TapeError("a block stands before the % that starts the program; what precedes "
                            "that is not carried out, so take the block out, or put it behind.",
                            number, of_text=True)
    return start + 1


def encode(text: str, code: Code = ISO) -> Tape:
    """Punch a text.

    Leader, trailer, and the ``%`` at the start and at the end are added if the text lacks them. The
    end word is not added: only the author knows that the program ends there. Text before the first
    ``%`` and behind the second is not part of the program. In comments a space replaces each
    character that the code lacks. Calls are written out: see ``host.tape.subprograms``.

    Raises
    ------
    TapeError
        If the code has no row for a character, or a ``%`` stands inside the program.
    """
    lines = _LINE_END.split(text)
    first = _begin(lines)
    lines = lines[first:]
    while lines and not lines[-1].strip():
        lines.pop()
    end = next((n for n, line in enumerate(lines) if _stands_alone(line)), len(lines))
    over = next((n + 1 for n, line in enumerate(lines[:end]) if ends_program(line)), end)
    # Behind the end word only subprograms matter.
    lines = [_punchable(line, code, kept=n < over) for n, line in enumerate(lines[:end])]

    rows = bytearray([BLANK] * FEED_ROWS + [code.start, code.end_of_block])
    numbers = [first or 1]      # line of the start; else line 1 follows
    for index, line in written_out(lines, first + 1):
        number = first + 1 + index
        for column, char in enumerate(line, start=1):
            if char == "%":
                raise TapeError("% starts and ends a tape and cannot stand inside the program.",
                                number, column, of_text=True)
            if char not in code.punch:
                reason, place = _without_code(line, column, code)
                raise TapeError(reason, number, place, of_text=True)
            rows.append(code.punch[char])
        rows.append(code.end_of_block)
        numbers.append(number)
    rows += bytes([code.start, code.end_of_block]) + bytes([BLANK] * FEED_ROWS)
    return Tape(bytes(rows), code, (*numbers, numbers[-1] + 1))


def recognise(rows: bytes) -> tuple[Code, int]:
    """Find the start of a tape; return its code and the index of the start row.

    The start is the first ``%`` or ER right before an end of block of its code (in ISO code a
    carriage return may come between). Rows before it are leader. The leader may hold any pattern
    except a block of characters: that would be a program whose start is damaged or missing.

    Raises
    ------
    TapeError
        If the tape has no start; the character is the last one read.
    """
    begin, read = 0, len(rows)  # start of the present block; rows to read before giving up
    for index, row in enumerate(rows):
        code = next((c for c in (ISO, EIA) if row == c.end_of_block), None)
        if code is None:
            continue
        start = index - 1
        if code is ISO and start >= begin and rows[start] == CARRIAGE_RETURN:
            start -= 1
        if start >= begin and rows[start] == code.start:
            return code, start
        block = rows[begin:index].replace(bytes([BLANK]), b"")
        # Two rows or more: one may be a character by chance.
        if len(block) >= 2 and all(row in code.read for row in block):
            read = index + 1
            break
        begin = index + 1
    raise TapeError("there is no start code (% or ER, then end of block) before the data.", 1, read)


def _read_row(code: Code, row: int, block: int, character: int) -> str:
    if odd(row) != code.parity:
        raise TapeError(f"parity error (TH) in the byte {row:02X}.", block, character)
    if row not in code.read:
        raise TapeError(f"the byte {row:02X} is not a character of the {code.name.upper()} code.",
                        block, character)
    return code.read[row]


def decode(rows: bytes) -> tuple[str, Code]:
    """Read punched bytes; return the text, with ``%`` at its start and end, and the code.

    Every row from the start to the end of block of the end word is checked; the rows before and
    after are leader and trailer.

    Raises
    ------
    TapeError
        If the tape is damaged, has a wrong code, or stops; with block and character. The sentences
        are those of the controller's own reader, softcore/firmware/interp/reader.c.
    """
    code, start = recognise(rows)
    lines, line, block, character = [], "", 1, 0
    for row in rows[start:]:
        character += 1
        if row == code.end_of_block:
            lines.append(line)
            if ends_program(line):
                break
            line, block, character = "", block + 1, 0
        elif row == BLANK and code.blank_is_fault:
            raise TapeError("blank tape inside the program.", block, character)
        else:
            char = _read_row(code, row, block, character)
            if char == "%" and block > 1:
                raise TapeError("the program ends without its end word (M02 or M30).", block,
                                character)
            line += char
    else:
        raise TapeError("the tape ends before the end word (M02 or M30).", block, character + 1)
    lines[0] = "%"
    return "\n".join([*lines, "%", ""]), code


def is_punched(path: Path) -> bool:
    """Whether a file holds punched rows, by its name; any other is a text."""
    return path.suffix.lower() == ".ptp"


def load(path: Path) -> Tape:
    """Tape of a file: punched rows unchanged, or a text punched in ISO code."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror}.") from error
    if is_punched(path):
        # A tape with a damaged start is still a tape: the controller's own reader will refuse it.
        code = next((c for row in data for c in CODES.values() if row == c.end_of_block), ISO)
        return Tape(data, code)
    return encode(text_of(path, data))


def text_of(path: Path, data: bytes) -> str:
    """Text of a part program's bytes, without a byte order mark."""
    if b"\0" in data:
        before = _LINE_END.split(data[:data.index(0)].decode("latin-1"))
        raise TapeError(f"a byte of {path.name} is zero, so that it is no text (UTF-16?); save it "
                        "as UTF-8. Punched tapes have the ending .ptp.", len(before),
                        len(before[-1]) + 1, of_text=True)
    try:
        return data.decode().removeprefix("\ufeff")
    except UnicodeDecodeError:
        return data.decode("latin-1")   # any byte is a character; only comments may have such
