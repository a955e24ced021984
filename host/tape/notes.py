# SPDX-License-Identifier: Apache-2.0
"""Notes on words of a correct program that other controls would read differently.

Each kind of note comes once, for the first line to which it applies.

Ref: least increments as on Fanuc's controls; dwells of grbl 1.1 and LinuxCNC, which count P in
seconds; LinuxCNC, which reads F before it carries out G20 or G21 of the same block.
"""

import re
from collections.abc import Iterator

from host.tape.subprograms import COMMENT
from host.tape.tape import Tape, decode

__all__ = ["notes"]

_WORD = re.compile(r"([A-Z])[ \t]*([+-]?(?:\d+\.?\d*|\.\d+))")
_PLACES = frozenset("XYZIJKR")      # words that are lengths, except in blocks of
_OTHERS = frozenset({4, 10, 36, 37, 38, 39})


def _codes(words: list[tuple[str, str]]) -> set[float]:
    return {float(number) for letter, number in words if letter == "G"}


def _wholes(words: list[tuple[str, str]]) -> list[str]:
    """Lengths without a decimal point to which a point would make a difference."""
    if _codes(words) & _OTHERS:
        return []
    return [letter + number for letter, number in words
            if letter in _PLACES and "." not in number and int(number)]


def notes(tape: Tape) -> Iterator[str]:
    """Sentences on a tape without fault, each with its line."""
    blocks = [(tape.line(block), _WORD.findall(COMMENT.sub(" ", text.upper())))
              for block, text in enumerate(decode(tape.rows)[0].splitlines(), start=1)]
    wholes = [(line, word) for line, words in blocks for word in _wholes(words)]
    if wholes:
        line, word = wholes[0]
        yield (f"line {line}: {word} has no decimal point and counts whole millimetres or inches, "
               f"as {len(wholes)} words do; a control set to least increments takes thousandths.")
    for line, words in blocks:
        waits = dict(words).get("P") if 4 in _codes(words) else None
        if waits:
            yield (f"line {line}: P of G04 counts milliseconds, and waits {waits} ms; grbl and "
                   f"LinuxCNC wait {waits} s. Seconds are written X.")
            break
    unit = 21.0
    for line, words in blocks:
        changed = _codes(words) & {20, 21} - {unit}
        if changed and "F" in dict(words):
            yield (f"line {line}: F counts in the unit of its own block, G{changed.pop():.0f}, "
                   "wherever that stands in it; LinuxCNC reads F before.")
            break
        unit = changed.pop() if changed else unit
