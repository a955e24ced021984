# SPDX-License-Identifier: Apache-2.0
"""The firmware in a layout: invented layouts are written, and read back by the map they came from.

``invented`` lays out a memory as the tools do, in rows of each kind, blocks in any order, beside
block RAMs of others. It keeps the place of each bit, and ``contents`` reads by these places alone.
"""

import random
import re
from dataclasses import dataclass

import numpy as np
import pytest

from softcore.contents import placeholder, with_firmware
from softcore.memory import bank_sizes, parities, words_of
from softcore.tools import BuildError

WORDS, PARITY = 2048, 32   # words of a block; the parity as a column beside the 32 of data
# Bytes of a memory, in banks or not, and bits of a row in each of its banks.
MEMORIES = [
    (72 * 1024, False, [1]), (40 * 1024, False, [2]), (24 * 1024, False, [4]),
    (44 * 1024, True, [2, 9, 18]), (80 * 1024, True, [1, 4]), (4096, False, [18]),
    (20 * 1024, True, [2, 9]),  # the first bank fills half of each of its blocks
]
NAMES = [f"{size // 1024} KiB, rows of {' and '.join(map(str, rows))}"
         for size, _, rows in MEMORIES]
SIZE, BANKS, ROWS = MEMORIES[3]


@dataclass(frozen=True)
class Piece:
    """A piece of a column: its first word, and for each word the place of its bit in a block.

    Places count from bit 0 of the block's word 0, nine for each word.
    """

    column: int
    first: int
    block: int
    places: np.ndarray


class Layout:
    """Contents of block RAMs by number (one array of 2048 x 9 bits), and pieces of the memory."""

    def __init__(self):
        self.blocks, self.pieces = {}, []

    def text(self):
        """The layout as nextpnr writes it, with something before, between and after the blocks."""
        parts = [".device LFE5U-25F\n\n.tile R1C1:PLC2\nenum: SLICEA.MODE LOGIC\n\n"]
        for number, bits in self.blocks.items():
            words = bits.reshape(WORDS, 9) @ (1 << np.arange(9))
            lines = "".join(" ".join(f"{word:03x}" for word in words[at:at + 8]) + "\n"
                            for at in range(0, WORDS, 8))
            parts.append(f".bram_init {number}\n{lines}\n")
        return "".join(parts) + ".tile_group MIB_R2C3:EBR0\nword: EBR0.WID 110000000\n"

    def block_of(self, column, word):
        """The number of the block that has a bit of the memory, and the bit's place there."""
        ((number, place),) = ((piece.block, piece.places[word - piece.first])
                              for piece in self.pieces if piece.column == column
                              and piece.first <= word < piece.first + len(piece.places))
        return number, place


def place_of(row, lane, row_bits):
    """Place of a bit of a row in its block, as in ``Piece``: narrow rows leave out each ninth."""
    flat = row * row_bits + lane
    return flat if row_bits in (9, 18) else flat // 8 * 9 + flat % 8


def invented(image, size, banks, rows):
    """A layout of a memory that holds an image: rows of ``rows[bank]`` bits in each bank."""
    random_ = random.Random(1)
    layout = Layout()
    words = words_of(image + bytes(size - len(image)))
    groups = []  # of columns that share blocks: first word, words, columns, bits of a row
    for (first, count), row_bits in zip(bank_sizes(size // 4) if banks else [(0, size // 4)],
                                        rows, strict=True):
        columns = random_.sample(range(32), 32)
        share = row_bits // 9 * 8 or row_bits   # rows of 9 and 18 hold bytes, without ninth bits
        groups += [(first, count, columns[at:at + share], row_bits) for at in range(0, 32, share)]
    groups.append((0, len(words), [PARITY], 1))
    blocks = []
    for first, count, columns, row_bits in groups:
        depth = WORDS * (9 if row_bits in (9, 18) else 8) // row_bits
        blocks += [(start, min(depth, first + count - start), columns, row_bits)
                   for start in range(first, first + count, depth)]
    random_.shuffle(blocks)
    for number, (first, count, columns, row_bits) in enumerate(blocks, 3):
        layout.blocks[number] = np.zeros(WORDS * 9, int)
        lanes = [lane for lane in range(row_bits) if lane % 9 != 8]
        for column, lane in zip(columns, lanes, strict=True):
            piece = Piece(column, first, number, place_of(np.arange(count), lane, row_bits))
            layout.pieces.append(piece)
            layout.blocks[number][piece.places] = [
                word.bit_count() & 1 if column == PARITY else word >> column & 1
                for word in words[first:first + count]]
    layout.blocks[1] = np.zeros(WORDS * 9, int)
    layout.blocks[500] = np.random.default_rng(1).integers(0, 2, WORDS * 9)
    return layout


def contents(layout, text):
    """Words and parities of the memory in a text, by the places of the layout."""
    blocks = {}
    for number, words in re.findall(r"^\.bram_init (\d+)\n((?:[0-9a-f]{3}(?: |\n))+)", text, re.M):
        blocks[int(number)] = [*map(int, "".join(f"{int(word, 16):09b}"[::-1]
                                                 for word in words.split()))]
    depth = max(piece.first + len(piece.places) for piece in layout.pieces)
    found, parity = [0] * depth, [None] * depth
    for piece in layout.pieces:
        for word, place in enumerate(piece.places.tolist(), piece.first):
            if piece.column == PARITY:
                parity[word] = blocks[piece.block][place]
            else:
                found[word] |= blocks[piece.block][place] << piece.column
    return found, parity


def replaced(layout, image, *, size, banks):
    """Text of a layout with the firmware in it, which must not be refused."""
    try:
        return with_firmware(layout.text(), image, size=size, banks=banks)
    except BuildError as error:
        return pytest.fail(str(error))


def firmware(length, seed=2):
    return random.Random(seed).randbytes(length)


@pytest.mark.parametrize(("size", "banks", "rows"), MEMORIES, ids=NAMES)
def test_the_firmware_is_where_the_placeholder_was(size, banks, rows):
    """Words and parities are the firmware's; the rest is as if it had been there from the start."""
    image = firmware(size * 2 // 3 - 1)
    layout = invented(placeholder(size), size, banks, rows)
    assert contents(layout, layout.text()) == (words_of(placeholder(size)),
                                               parities(placeholder(size)))
    text = replaced(layout, image, size=size, banks=banks)
    whole = image + bytes(size - len(image))
    assert contents(layout, text) == (words_of(whole), parities(whole))
    assert text == invented(image, size, banks, rows).text()


@pytest.mark.parametrize("image", [b"", b"\xff", firmware(SIZE)], ids=["none", "a byte", "full"])
def test_any_length_up_to_the_memory(image):
    layout = invented(placeholder(SIZE), SIZE, BANKS, ROWS)
    whole = image + bytes(SIZE - len(image))
    text = replaced(layout, image, size=SIZE, banks=BANKS)
    assert contents(layout, text) == (words_of(whole), parities(whole))


def test_the_placeholder_is_always_the_same_noise():
    """Every column and its parity have as many ones as zeros, within 5 %."""
    size = 64 * 1024
    image = placeholder(size)
    assert image == placeholder(size)
    assert len(image) == size
    words = words_of(image)
    ones = [*(sum(word >> bit & 1 for word in words) for bit in range(32)), sum(parities(image))]
    assert all(0.45 < count / len(words) < 0.55 for count in ones)


def refusal(text, image=b"", size=SIZE, banks=BANKS):
    with pytest.raises(BuildError) as found:
        with_firmware(text, image, size=size, banks=banks)
    return str(found.value)


@pytest.mark.parametrize(("column", "word", "what"), [
    (PARITY, 0, "the parity of the memory's words 0 to 11263"),
    # Rows of 2 bits in the first bank, 9 in the second and 18 in the last.
    (7, 8191, "bit 7 of the memory's words 0 to 8191"),
    (7, 8192, "bit 7 of the memory's words 8192 to 10239"),
    (7, 11263, "bit 7 of the memory's words 10240 to 11263"),
])
def test_a_block_that_is_missing_or_there_twice_is_named(column, word, what):
    """All bits of a block are missing with it; the first of them is named."""
    layout = invented(placeholder(SIZE), SIZE, BANKS, ROWS)
    number, _ = layout.block_of(column, word)
    first = min(piece.column for piece in layout.pieces if piece.block == number)
    what = what.replace("bit 7 ", f"bit {first} ")
    layout.blocks[600] = layout.blocks[number]
    assert refusal(layout.text()) == f"the layout has {what} in two places."
    del layout.blocks[600], layout.blocks[number]
    assert refusal(layout.text()) == f"no block RAM of the layout has {what}."


def test_a_piece_of_a_column_is_named_by_its_words():
    size, banks, rows = 80 * 1024, True, [1, 4]
    layout = invented(placeholder(size), size, banks, rows)
    del layout.blocks[layout.block_of(PARITY, 16384)[0]]
    assert refusal(layout.text(), size=size, banks=banks) == (
        "no block RAM of the layout has the parity of the memory's words 16384 to 20479.")


def test_one_wrong_bit_is_a_missing_block():
    """A column is only taken for found if all its bits are those of the placeholder."""
    layout = invented(placeholder(SIZE), SIZE, BANKS, ROWS)
    number, place = layout.block_of(PARITY, 11263)
    layout.blocks[number][place] ^= 1
    assert refusal(layout.text()) == (
        "no block RAM of the layout has the parity of the memory's words 0 to 11263.")


def test_a_layout_with_another_memory_is_refused():
    assert refusal("").startswith("no block RAM of the layout has bit 0 of the memory's words 0 to")
    layout = invented(firmware(SIZE), SIZE, BANKS, ROWS)
    assert refusal(layout.text()).startswith("no block RAM of the layout has bit 0 of ")


def test_an_image_that_is_too_large_is_refused():
    """By one byte; that a full memory is not refused is tested above."""
    layout = invented(placeholder(SIZE), SIZE, BANKS, ROWS)
    assert refusal(layout.text(), bytes(SIZE + 1)) == (
        "the firmware image has 45057 bytes, the memory 45056.")


@pytest.mark.parametrize("change", [
    lambda words: words.replace("000 000 000 000 000 000 000 000\n", "", 1),
    lambda words: words.replace("000 000 ", "000 200 ", 1),
], ids=["a line less", "ten bits"])
def test_a_block_of_another_form_is_refused(change):
    before, head, words = invented(placeholder(SIZE), SIZE, BANKS, ROWS).text().partition(
        ".bram_init 1\n")
    changed = before + head + change(words)
    assert change(words) != words
    assert refusal(changed) == "block RAM 1 of the layout is not 2048 words of 9 bits."
