# SPDX-License-Identifier: Apache-2.0
"""The lines of ``gapkeeper firmware``: bytes as characters, and the whole image in its order."""

import struct

import pytest

from host import firmware
from host.link.framing import check_line, numbered
from testbench.models import firmware_slots as model


@pytest.mark.parametrize("length", range(9))
def test_characters_are_those_of_the_format(rng, length):
    for _ in range(50):
        data = rng.randbytes(length)
        assert firmware.characters(data) == model.characters(data)


def test_every_line_can_be_sent_and_all_of_the_image_comes_in_order(rng):
    image = model.image(*(rng.randrange(1 << 32) for _ in range(1000)))
    begin, *pieces, end = firmware.orders(image)
    told = struct.pack("<2I", len(image), model.words(image)[-1])
    assert begin == "$FIRMWARE=B" + model.characters(told)
    assert end == "$FIRMWARE=E"
    assert pieces == ["$FIRMWARE=D" + model.characters(struct.pack("<I", at)
                                                        + image[at:at + model.CHUNK])
                      for at in range(0, len(image), model.CHUNK)]
    for line in (begin, *pieces, end):
        check_line(line)
        assert len(numbered(65_535, line)) <= 255


def test_what_a_controller_tells_is_read():
    told = firmware.Firmware.of("[FIRMWARE:2,trial,305419896,7,184320,323584]")
    assert told == firmware.Firmware(2, "trial", 0x12345678, 7, 184_320, 323_584)
    assert told.name == "12345678 (in slot 2, on trial)"
    assert firmware.Firmware.of("[FIRMWARE:0,built-in,1,7,184320,0]").name == (
        "00000001 (of the bitstream)")
