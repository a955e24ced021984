# SPDX-License-Identifier: Apache-2.0
"""The two codes of 8-channel punched tape: the holes of each character.

Track n of the tape is bit n - 1 of a byte; a hole is a one. No row is legal in both codes, so the
first end of block tells the code of a tape.

Ref: ISO 840:1973 (EIA RS-358): seven bits of ISO 646 in tracks 1 to 7, even parity in track 8.
Ref: EIA RS-244-B: odd parity in track 5, end of block in track 8 alone. The 43 codes of letters,
digits, ``/ + - . ,``, space, delete and end of block agree with the paper tape table of the IBM
1620 (as simulated by SIMH); ``( )`` are those of the Yasnac LX3 manual. ER (written ``%`` here),
TAB, upper and lower case and ``&`` follow common usage; their parity is right, but no second
source confirms them.
"""

from dataclasses import dataclass

BLANK = 0x00
CARRIAGE_RETURN = 0x8D  # of ISO 840


@dataclass(frozen=True)
class Code:
    """One tape code.

    ``punch`` gives the byte of a character; ``read`` the character of a byte, ``""`` for a row that
    carries none (carriage return, delete, case shifts). ``parity`` is the number of holes in every
    legal row, modulo 2. ``blank_is_fault`` says that a row without holes inside the data is a fault
    and not a filler.
    """

    name: str
    title: str
    parity: int
    end_of_block: int
    punch: dict[str, int]
    read: dict[int, str]
    blank_is_fault: bool

    @property
    def start(self) -> int:
        """The row that starts and ends a tape, ``%`` in texts."""
        return self.punch["%"]


def odd(byte: int) -> int:
    """Whether a byte has an odd number of ones, as 0 or 1."""
    return byte.bit_count() & 1


def _iso() -> Code:
    legal = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ%:/+-.,() \t=*#$&'@[]!\";<>?"
    even = {char: ord(char) | odd(ord(char)) << 7 for char in legal}
    silent = [BLANK, CARRIAGE_RETURN, 0xFF]  # NUL, CR, DEL
    # Only capitals are punched. Small letters and all of ISO 646 can be read, for comments.
    readable = {ord(char) | odd(ord(char)) << 7: char for char in map(chr, range(32, 127))}
    return Code(name="iso", title="ISO 840", parity=0, end_of_block=0x0A, punch=even,
                read=readable | {even["\t"]: "\t"} | dict.fromkeys(silent, ""),
                blank_is_fault=False)


def _eia() -> Code:
    rows = {
        "0123456789": "20 01 02 13 04 15 16 07 08 19",
        "ABCDEFGHI":  "61 62 73 64 75 76 67 68 79",
        "JKLMNOPQR":  "51 52 43 54 45 46 57 58 49",
        "STUVWXYZ":   "32 23 34 25 26 37 38 29",
        "/+-., \t&":  "31 70 40 6B 3B 10 3E 0E",
        "()%":        "1A 4A 0B",
    }
    punch = {char: byte for chars, codes in rows.items()
             for char, byte in zip(chars, bytes.fromhex(codes), strict=True)}
    silent = [0x7F, 0x7C, 0x7A]  # DEL, UC, LC
    return Code(name="eia", title="EIA RS-244", parity=1, end_of_block=0x80, punch=punch,
                read={byte: char for char, byte in punch.items()} | dict.fromkeys(silent, ""),
                blank_is_fault=True)


ISO = _iso()
EIA = _eia()
CODES = {code.name: code for code in (ISO, EIA)}
