# SPDX-License-Identifier: Apache-2.0
"""Subprograms: the host writes them out, since the controller takes one block after another.

``M98 P2000 L3`` carries out the subprogram O2000 three times, and so does ``M98 P32000``; M99 is
its end. Subprograms stand behind the end word (M02 or M30) of the program, in the same file, and
may call others. As calls are written out, a retraction goes back through them as through any block.

Ref: calls and returns as on most controls since Fanuc's series 6.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from host.errors import TapeError

__all__ = ["COMMENT", "ends_program", "written_out"]

COMMENT = re.compile(r"\([^)]*\)?|;.*")
_SKIPPED = re.compile(r"(?:[ \t]|\(\))*/")
_END_WORD = re.compile(r"M[ \t]*0*(?:2|30)(?:\.0*)?(?![\d.])")
_CALL = re.compile(r"M[ \t]*0*98(?:\.0*)?(?![\d.])")
_RETURN = re.compile(r"M[ \t]*0*99(?:\.0*)?(?![\d.])")
_NAME = re.compile(r"[O:][ \t]*([0-9]{1,8})(?![\d.])")
_WHICH, _TIMES = (re.compile(rf"{letter}[ \t]*([0-9]{{1,8}})(?![\d.])") for letter in "PL")
_OTHER_END = re.compile(r"M[ \t]*0*(?:0|1|2|30|99)(?:\.0*)?(?![\d.])")

DEEPEST = 8             # calls inside each other
MOST = 1_000_000        # blocks of a program that is written out, and passes of subprograms
MOST_TIMES = 9999       # of one call


def ends_program(block: str) -> bool:
    """Whether a block holds the end word M02 or M30, outside comments and not skippable.

    For every block that the controller accepts this agrees with softcore/firmware/interp/block.c.
    """
    block = COMMENT.sub("()", block.upper())  # a comment still separates letter and number
    return not _SKIPPED.match(block) and bool(_END_WORD.search(block))


def _words(line: str) -> str:
    """A block with spaces for its comments, so that every word keeps its column."""
    return COMMENT.sub(lambda found: " " * len(found[0]), line.upper())


def _without(line: str, *found: re.Match[str] | None) -> str:
    """A block with spaces for some words."""
    for word in found:
        if word:
            line = line[:word.start()] + " " * len(word[0]) + line[word.end():]
    return line.rstrip()


@dataclass
class _Program:
    """Lines of a text with their numbers, and the starts of its subprograms."""

    lines: Sequence[str]
    first: int                              # number of the first line in its source
    subprograms: dict[int, int] = field(default_factory=dict)
    blocks: list[tuple[int, str]] = field(default_factory=list)
    passes: int = 0

    def fault(self, index: int, reason: str, column: int = 0) -> TapeError:
        return TapeError(reason, index + self.first, column, of_text=True)

    def find(self, end: int) -> None:
        """Note the subprograms behind the main program's end."""
        for index in range(end + 1, len(self.lines)):
            if name := _NAME.search(_words(self.lines[index])):
                number = int(name[1])
                if number in self.subprograms:
                    raise self.fault(index, f"the subprogram O{number} stands twice, first in line "
                                     f"{self.subprograms[number] + self.first}.", name.start() + 1)
                self.subprograms[number] = index

    def put(self, index: int, text: str) -> None:
        if len(self.blocks) == MOST:
            raise self.fault(index, f"written out, the program has more than {MOST:,} blocks or "
                             "calls.")
        self.blocks.append((index, text))

    def call(self, index: int, words: str, running: tuple[int, ...]) -> None:
        """Carry out the call of a block, as many times as it says."""
        call = _CALL.search(words)
        assert call
        which, times = (found.search(words, call.end()) for found in (_WHICH, _TIMES))
        column = call.start() + 1
        if words.lstrip().startswith("/"):
            raise self.fault(index, "a call (M98) cannot be skipped by /: whether it is carried "
                             "out is known only at the machine.", column)
        if _OTHER_END.search(words):
            raise self.fault(index, "a block with a call (M98) neither stops nor ends the program, "
                             "nor does it return.", column)
        if not which:
            raise self.fault(index, "M98 needs the number of its subprogram behind it, P and a "
                             "whole number of at most 8 digits.", column)
        if times and int(times[1]) > MOST_TIMES:
            raise self.fault(index, f"a call (M98) is repeated at most {MOST_TIMES} times, by L.",
                             times.start() + 1)
        number, repeats = self.called(index, which, times)
        if number in running:
            raise self.fault(index, f"the subprogram O{number} calls itself.", column)
        if len(running) == DEEPEST:
            raise self.fault(index, f"more than {DEEPEST} calls stand inside each other.", column)
        rest = _without(words, call, which, times)
        if re.search(r"[PL]", rest):
            raise self.fault(index, "a block with a call (M98) has no other P or L.", column)
        if rest.strip():
            self.put(index, rest)
        for _ in range(repeats):
            self.run(self.subprograms[number], number, (*running, number))

    def called(self, index: int, which: re.Match[str],
               times: re.Match[str] | None) -> tuple[int, int]:
        """Number of the subprogram that a call names, and how often it is to run.

        Without L, digits before the last four of P may be the number of repeats, as on Fanuc's.
        """
        number, repeats = int(which[1]), int(times[1]) if times else 1
        before, last = divmod(number, 10_000)
        if before and not times and last in self.subprograms:
            if number in self.subprograms:
                raise self.fault(index, f"P{which[1]} may be O{number}, or O{last:04d} {before} "
                                 "times; say which by L.", which.start() + 1)
            return last, before
        if number not in self.subprograms:
            raise self.fault(index, f"there is no subprogram O{number} behind the program's end "
                             "(M02 or M30); repeats are given by L.", which.start() + 1)
        return number, repeats

    def run(self, begin: int, number: int, running: tuple[int, ...]) -> None:
        """One pass of a subprogram."""
        self.passes += 1
        if self.passes > MOST:
            raise self.fault(begin, f"written out, the program has more than {MOST:,} blocks or "
                             "calls.")
        for index in range(begin, len(self.lines)):
            line = self.lines[index]
            words = _words(line)
            name = _NAME.search(words)
            if name and index > begin:
                break
            if _CALL.search(words):
                self.call(index, words, running)
                continue
            back = _RETURN.search(words)
            if back and words.lstrip().startswith("/"):
                raise self.fault(index, "M99 cannot be skipped by /.", back.start() + 1)
            if back and _WHICH.search(words):
                raise self.fault(index, "M99 P is not in this version; M99 returns behind its "
                                 "call.", back.start() + 1)
            if ends_program(line):
                raise self.fault(index, f"the end word stands in the subprogram O{number}; M99 "
                                 "ends it.")
            rest = _without(line, name, back)
            if rest.strip() or not (name or back):
                self.put(index, rest)
            if back:
                return
        raise self.fault(begin, f"the subprogram O{number} has no end (M99).")


def written_out(lines: Sequence[str], first: int) -> list[tuple[int, str]]:
    """Blocks of a program in the order of execution, each with its index in ``lines``.

    A program without calls stays unchanged, text behind its end included.

    Parameters
    ----------
    lines : sequence of str
        Blocks of the text.
    first : int
        Line of the first of them, for errors.

    Raises
    ------
    TapeError
        If a call leads nowhere, or a subprogram does not end.
    """
    if not any(_CALL.search(_words(line)) for line in lines):
        return list(enumerate(lines))
    program = _Program(lines, first)
    end = next((index for index, line in enumerate(lines) if ends_program(line)), len(lines))
    program.find(end)
    for index in range(min(end + 1, len(lines))):
        words = _words(lines[index])
        if _CALL.search(words):
            program.call(index, words, ())
        else:
            program.put(index, lines[index])
    return program.blocks
