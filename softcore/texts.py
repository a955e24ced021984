# SPDX-License-Identifier: Apache-2.0
"""Sentences of the firmware, stored in half their bytes.

In a stored text a byte from 0x80 on stands for a pair of others, each a character or again such a
byte. ``text_vprint`` in ``base/text.c`` writes the characters, from a table of those that each byte
stands for in the end. The pairs are those that occur most often in all sentences, found one after
the other: byte pair encoding, P. Gage, "A New Algorithm for Data Compression", The C Users Journal
12 (2), 1994.

The sources keep their sentences as they are: ``stored`` changes the copy that is compiled.
``python -m softcore.texts`` finds the pairs anew, after many sentences have changed.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path

from softcore.tables.pairs import PAIRS

__all__ = ["FIRST", "PARTS", "expanded", "packed", "sentences", "sources", "stored", "trained"]

FIRST = 0x80                # the first byte that stands for a pair
MOST = 0x100 - FIRST        # pairs
SHORTEST = 8                # characters of a text that is worth it
TABLE = Path(__file__).parent / "tables" / "pairs.py"
FIRMWARE = Path(__file__).parent / "firmware"
APART = "hal", "pc"         # rooms without sentences for a person, or not on the target
# Comments, names, character constants and other signs are skipped; a string may be a sentence.
TOKENS = re.compile(r'//[^\n]*|/\*.*?\*/|(?P<text>"(?:[^"\\\n]|\\.)*")|\'(?:[^\'\\\n]|\\.)+\''
                    r"|(?P<word>[A-Za-z_]\w*)|.", re.DOTALL)
SPEC = re.compile(r"(%.)")  # of text_vprint: one letter, never a part of a pair
ESCAPES = {'\\"': '"', "\\\\": "\\", "\\n": "\n", "\\r": "\r"}


def sources(folder: Path = FIRMWARE) -> list[Path]:
    """Sources and headers of the firmware whose sentences are stored packed."""
    return sorted(path for path in folder.rglob("*.[ch]")
                  if path.relative_to(folder).parts[0] not in APART)


def _is_sentence(literal: str) -> bool:
    """Whether a string of the source is a text for a person: it has a space, and some length."""
    return " " in literal and len(literal) - 2 >= SHORTEST


def _places(source: str) -> Iterable[re.Match[str]]:
    """Sentences of a C source, without those that only the compiler reads."""
    last = ""
    reads = False       # the compiler, in a static assertion
    for token in TOKENS.finditer(source):
        if token["word"]:
            last = token["word"]
        elif token.group() == "(":
            reads = reads or last == "_Static_assert"
        elif token.group() == ";":
            reads = False
        elif token["text"] and not reads and _is_sentence(token["text"]):
            yield token


def _characters(literal: str) -> str:
    return re.sub(r"\\.", lambda found: ESCAPES[found.group()], literal[1:-1])


def sentences(source: str) -> list[str]:
    """Sentences of a C source, in its order.

    Raises
    ------
    KeyError
        If one has an escape sequence that is not known here.
    """
    return [_characters(token["text"]) for token in _places(source)]


def packed(text: str, pairs: Sequence[tuple[int, int]] = PAIRS) -> bytes:
    """Bytes of a stored text.

    Raises
    ------
    UnicodeEncodeError
        If it has a character outside of ASCII.
    """
    made = bytearray()
    for part in SPEC.split(text):
        codes = list(part.encode("ascii"))
        if not SPEC.fullmatch(part):
            for number, pair in enumerate(pairs):
                codes = _joined(codes, pair, FIRST + number)
        made += bytes(codes)
    return bytes(made)


def expanded(data: bytes, pairs: Sequence[tuple[int, int]] = PAIRS) -> str:
    """The text that stored bytes stand for."""
    def one(code: int) -> str:
        if code < FIRST:
            return chr(code)
        return "".join(one(half) for half in pairs[code - FIRST])
    return "".join(map(one, data))


PARTS = tuple(expanded(bytes([FIRST + number])) for number in range(len(PAIRS)))


def stored(source: str) -> str:
    """A C source with its sentences packed, on the same lines."""
    made, end = [], 0
    for token in _places(source):
        made += [source[end:token.start()], _literal(packed(_characters(token["text"])))]
        end = token.end()
    return "".join([*made, source[end:]])


def _literal(data: bytes) -> str:
    """As a string of C. Octal escapes have three digits, whatever comes behind them."""
    return '"' + "".join(chr(byte) if 0x20 <= byte < FIRST and chr(byte) not in '"\\'
                         else f"\\{byte:03o}" for byte in data) + '"'


def _joined(codes: list[int], pair: tuple[int, int], code: int) -> list[int]:
    """A list in which a code takes the place of each such pair, from the left."""
    made, at = [], 0
    while at < len(codes):
        if tuple(codes[at:at + 2]) == pair:
            made.append(code)
            at += 2
        else:
            made.append(codes[at])
            at += 1
    return made


def trained(texts: Iterable[str]) -> list[tuple[int, int]]:
    """The pairs for some texts, at most 128: each time the one that occurs most often."""
    parts = [list(part.encode("ascii")) for text in set(texts) for part in SPEC.split(text)
             if part and not SPEC.fullmatch(part)]
    pairs: list[tuple[int, int]] = []
    while len(pairs) < MOST and (counts := Counter(
            pair for part in parts for pair in pairwise(part))):
        best = min(counts, key=lambda pair: (-counts[pair], pair))
        parts = [_joined(part, best, FIRST + len(pairs)) for part in parts]
        pairs.append(best)
    return pairs


def main() -> None:
    """Find the pairs anew, and write their table."""
    pairs = trained(text for path in sources() for text in sentences(path.read_text()))
    rows = [", ".join(map(str, pairs[at:at + 8])) for at in range(0, len(pairs), 8)]
    TABLE.write_text('# SPDX-License-Identifier: Apache-2.0\n"""Pairs of the stored texts, found '
                     'by `python -m softcore.texts`; see there."""\n\n__all__ = ["PAIRS"]\n\n'
                     "PAIRS: tuple[tuple[int, int], ...] = (\n    "
                     + ",\n    ".join(rows) + ",\n)\n")


if __name__ == "__main__":
    main()
