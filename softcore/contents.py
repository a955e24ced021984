# SPDX-License-Identifier: Apache-2.0
"""The firmware, put into a finished layout: contents of the block RAMs that hold the memory.

A layout is made with ``placeholder`` as its memory's image: it looks like noise, so that each
piece of the memory is known by its content wherever the tools have put it. ``with_firmware`` then
writes the firmware and its parities there.

The layout is nextpnr's text file, the input of ecppack. In it each block RAM has a block of 2048
words of 9 bits. A block RAM of the ECP5 has rows of 1, 2, 4, 9 or 18 bits: 9 bits are a whole word,
18 are two, and narrower rows fill the lower 8 bits of the words, from bit 0.

Ref: Lattice FPGA-TN-02204, ECP5 memory usage guide; Project Trellis, ``.bram_init``.
"""

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softcore.memory import bank_sizes, parities
from softcore.tools import BuildError

__all__ = ["placeholder", "with_firmware"]

Bits = NDArray[np.uint8]

SEED = b"the firmware comes after the layout"
BLOCK = re.compile(r"^\.bram_init (\d+)\n((?:[0-9a-f]+[ \n])*)", re.M)
WORDS, WORD_BITS, LINE = 2048, 9, 8  # of a block: words, their bits, words of a line
ROWS = (1, 2, 4, 9, 18)              # bits


@dataclass(frozen=True)
class _Column:
    """One bit of the memory's words, or their parity, in one bank.

    Members
    -------
    name : str
        What it is, for messages.
    first : int
        The bank's first word.
    bits : array (words,)
        Its contents.
    """

    name: str
    first: int
    bits: Bits


@dataclass(frozen=True)
class _Found:
    """Where a piece of a column is: the block's index, bits of its rows, and which of them.

    ``start`` is the piece's first word in its column. It has a bit in each row of the block, or
    fewer at the end of the column.
    """

    block: int
    row_bits: int
    lane: int
    column: int
    start: int

    @property
    def rows(self) -> int:
        """Number of the block's rows."""
        return _depth(self.row_bits)


def placeholder(size: int) -> bytes:
    """Image of ``size`` bytes for the memory of a layout: noise, always the same."""
    return hashlib.shake_256(SEED).digest(size)


def with_firmware(layout: str, image: bytes, *, size: int, banks: bool = False) -> str:
    """Text of a layout with the firmware in the place of ``placeholder(size)``.

    Nothing else of the text changes.

    Parameters
    ----------
    layout : str
        Text of the layout, whose memory is ``softcore.memory.BlockRam`` with the placeholder.
    image : bytes
        The firmware, little-endian. The remainder of the memory is zero.
    size, banks : int, bool
        Of the memory, as in ``BlockRam``.

    Raises
    ------
    BuildError
        If the image is larger than the memory, if a piece of the memory is not in the layout or
        there twice, or if a block has another form.
    """
    if len(image) > size:
        raise BuildError(f"the firmware image has {len(image)} bytes, the memory {size}.")
    blocks = [_read(match) for match in BLOCK.finditer(layout)]
    old = _columns(placeholder(size), banks)
    new = _columns(image + bytes(size - len(image)), banks)
    found = list(_search(blocks, old))
    _require_each_once(found, old)
    for one in found:
        rows = _rows(blocks[one.block], one.row_bits)
        rows[:, one.lane] = _piece(new[one.column].bits, one.start, one.rows)
        blocks[one.block][:, :_used(one.row_bits)] = rows.reshape(WORDS, -1)
    texts = iter(blocks)
    return BLOCK.sub(lambda match: f".bram_init {match[1]}\n{_text(next(texts))}", layout)


def _columns(image: bytes, banks: bool) -> list[_Column]:
    """All columns of a memory that an image fills, bank by bank: 32 of data, and the parity."""
    data = np.unpackbits(np.frombuffer(image, np.uint8).reshape(-1, 4), axis=1, bitorder="little")
    depth = len(data)
    return [*(_Column(f"bit {bit}", first, data[first:first + count, bit])
              for first, count in (bank_sizes(depth) if banks else [(0, depth)])
              for bit in range(32)),
            _Column("the parity", 0, np.array(parities(image), np.uint8))]


def _piece(bits: Bits, start: int, rows: int) -> Bits:
    """One piece of a column, filled up with zeros to as many bits as a block has rows."""
    piece = bits[start:start + rows]
    return np.pad(piece, (0, rows - len(piece)))


def _search(blocks: list[Bits], columns: list[_Column]) -> Iterator[_Found]:
    """Yield each piece of a column that is in a block, whatever rows the block has."""
    for row_bits in ROWS:
        count = _depth(row_bits)
        places = {_piece(column.bits, start, count).tobytes(): (index, start)
                  for index, column in enumerate(columns)
                  for start in range(0, len(column.bits), count)}
        for number, block in enumerate(blocks):
            for lane, bits in enumerate(_rows(block, row_bits).T):
                if place := places.get(bits.tobytes()):
                    yield _Found(number, row_bits, lane, *place)


def _require_each_once(found: list[_Found], columns: list[_Column]) -> None:
    times: list[NDArray[Any]] = [np.zeros(len(column.bits), int) for column in columns]
    for one in found:
        times[one.column][one.start:one.start + one.rows] += 1
    for column, counted in zip(columns, times, strict=True):
        wrong = np.flatnonzero(counted != 1)
        if len(wrong):
            # The first run of words that have the same fault.
            first = wrong[0]
            same = np.flatnonzero(counted[first:] != counted[first])
            last = first + (same[0] if len(same) else len(counted) - first) - 1
            what = (f"{column.name} of the memory's words {column.first + first} to "
                    f"{column.first + last}")
            raise BuildError(f"the layout has {what} in two places." if counted[first] else
                             f"no block RAM of the layout has {what}.")


def _read(match: re.Match[str]) -> Bits:
    """Bits of one block: an array of 2048 words x 9 bits, from bit 0."""
    words = np.array([int(word, 16) for word in match[2].split()], np.int64)
    if len(words) != WORDS or words.max() >> WORD_BITS:
        raise BuildError(f"block RAM {match[1]} of the layout is not {WORDS} words of {WORD_BITS} "
                         "bits.")
    return (words[:, None] >> np.arange(WORD_BITS) & 1).astype(np.uint8)


def _text(block: Bits) -> str:
    words = [f"{word:03x}" for word in (block.astype(int) << np.arange(WORD_BITS)).sum(axis=1)]
    return "".join(" ".join(words[at:at + LINE]) + "\n" for at in range(0, WORDS, LINE))


def _used(row_bits: int) -> int:
    """Bits of a word that rows of some bits are in: the ninth only if the rows have one too."""
    return WORD_BITS if row_bits % WORD_BITS == 0 else 8


def _depth(row_bits: int) -> int:
    """Rows of a block."""
    return WORDS * _used(row_bits) // row_bits


def _rows(block: Bits, row_bits: int) -> Bits:
    """Contents of a block as rows: a copy, an array of rows x bits."""
    return block[:, :_used(row_bits)].copy().reshape(-1, row_bits)
