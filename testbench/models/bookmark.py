# SPDX-License-Identifier: Apache-2.0
"""Reference model of the bookmark in the flash memory, from its format (``store/bookmark.h``)."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from zlib import crc32

__all__ = ["MARKS", "Bookmark", "head", "mark", "newest", "sectors"]

SECTOR, PLACE, SPARE = 4096, 16, 4096
HEAD = struct.Struct("<4I6iI")
MARK = struct.Struct("<3I")
FIRST = 48                              # of the marks in a sector
MARKS = (SECTOR - FIRST) // PLACE


@dataclass(frozen=True)
class Bookmark:
    """Where a tape is. ``sequence`` is the number of its sector; ``sector`` its address."""

    sequence: int
    line: int
    digest: int
    homed: bool
    start: tuple[int, int, int]
    zero: tuple[int, int, int]
    sector: int = 0


def head(one: Bookmark) -> bytes:
    """Bytes of a sector's head."""
    body = struct.pack("<4I6i", one.sequence, one.line, one.digest, one.homed, *one.start,
                       *one.zero)
    return body + struct.pack("<I", crc32(body))


def mark(line: int, digest: int) -> bytes:
    """Bytes of a mark."""
    body = struct.pack("<2I", line, digest)
    return body + struct.pack("<I", crc32(body))


def sectors(region, memory_size: int) -> list[int]:
    """Addresses of the ring's sectors: those at the end of each slot that no image reaches.

    ``region`` is that of the journal and of the slots behind it.
    """
    taken = 1 - -(memory_size - SPARE) // SECTOR
    return [region.base + region.size + slot * region.slot + at
            for slot in range(2) for at in range(taken * SECTOR, region.slot, SECTOR)]


def _heads(read, places) -> Iterator[Bookmark]:
    for place in places:
        data = read(place, HEAD.size)
        sequence, line, digest, homed, *rest, check = HEAD.unpack(data)
        if check == crc32(data[:-4]):
            yield Bookmark(sequence, line, digest, bool(homed), tuple(rest[:3]), tuple(rest[3:]),
                           place)


def newest(read, places: list[int]) -> Bookmark | None:
    """The bookmark in force; ``read`` takes an address and a number of bytes."""
    found = max(_heads(read, places), key=lambda one: one.sequence, default=None)
    if found is None:
        return None
    data = read(found.sector, SECTOR)
    for at in range(FIRST, SECTOR, PLACE):
        line, digest, check = MARK.unpack_from(data, at)
        if check == crc32(data[at:at + 8]):
            found = Bookmark(found.sequence, line, digest, found.homed, found.start, found.zero,
                             found.sector)
    return found
