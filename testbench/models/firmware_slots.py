# SPDX-License-Identifier: Apache-2.0
"""Firmware slots of the flash memory, written and read from their format alone.

The format is in ``softcore/firmware/store/slots.h``.
"""

import struct
from dataclasses import dataclass

from softcore.flash import SECTOR
from softcore.image import image_digest

__all__ = ["CHUNK", "Slot", "characters", "image", "slot", "words"]

MARK, IMAGE_MARK = 0x31464B47, 0x49464B47     # GKF1, GKFI
HEAD, PAGE, CHUNK = 24, 256, 128


@dataclass(frozen=True)
class Slot:
    """What a whole slot has."""

    sequence: int
    digest: int
    base: int
    image: bytes
    tried: bool
    confirmed: bool


def words(data: bytes) -> list[int]:
    """Words of an image."""
    return list(struct.unpack(f"<{len(data) // 4}I", data))


def image(*body: int, mark: int = IMAGE_MARK, edition: int = 1, memory: int = 1 << 16) -> bytes:
    """An image: a jump, what it is, a body and the digest."""
    told = [0x6F, mark, edition, memory, *body]
    return struct.pack(f"<{len(told) + 1}I", *told, image_digest(told))


def head(image: bytes, sequence: int, base: int) -> bytes:
    """The head of a slot with an image."""
    told = [MARK, sequence, len(image), words(image)[-1], base]
    return struct.pack("<6I", *told, image_digest(told))


def slot(image: bytes, *, sequence: int = 1, base: int = 0, tried: bool = False,
         confirmed: bool = False) -> bytes:
    """All bytes of a slot, without its blank end."""
    first = bytearray(b"\xff" * SECTOR)
    first[:HEAD] = head(image, sequence, base)
    first[PAGE] = 0 if tried else 0xFF
    first[2 * PAGE] = 0 if confirmed else 0xFF
    return bytes(first) + image


def read(data: bytes) -> Slot | None:
    """What is in a slot, if it is whole."""
    mark, sequence, length, digest, base, total = struct.unpack("<6I", data[:HEAD])
    if mark != MARK or total != image_digest([mark, sequence, length, digest, base]):
        return None
    held = data[SECTOR:SECTOR + length]
    *body, last = words(held)
    if image_digest(body) != last or last != digest:
        return None
    return Slot(sequence, digest, base, held, data[PAGE] == 0, data[2 * PAGE] == 0)


def characters(data: bytes) -> str:
    """Bytes as they are sent in a line: 6 bits in a character, the highest first, then zeros."""
    bits = "".join(f"{byte:08b}" for byte in data)
    bits += "0" * (-len(bits) % 6)
    values = [int(bits[at:at + 6], 2) for at in range(0, len(bits), 6)]
    return "".join(chr(value + 64) if value < 62 else "=>"[value - 62] for value in values)
