# SPDX-License-Identifier: Apache-2.0
"""The model of the flash memory, command by command, and what a power cut leaves."""

import pytest

from testbench.firmware import Memory
from testbench.native.flash import ERASE_UNITS, SECTOR

CLOCK_HZ = 2_000_000
PAGE_CLOCKS, SECTOR_CLOCKS = CLOCK_HZ * 4 // 10_000, CLOCK_HZ * 45 // 1000   # 0.4 ms, 45 ms
AT = 0x123000


class Driver:
    """Gives orders to a memory, and counts time."""

    def __init__(self, **options):
        self.memory = Memory(clock_hz=CLOCK_HZ, **options)
        self.clock = 0

    def command(self, *sent):
        """Send bytes in one command; return what came."""
        order, handle = self.memory.library.flash_order, self.memory.handle
        order(handle, self.clock, 1, 0)
        came = bytes(order(handle, self.clock, 2, byte) for byte in sent)
        order(handle, self.clock, 0, 0)
        return came

    def address(self, code, at, data=b""):
        """A command with an address."""
        return self.command(code, at >> 16, at >> 8 & 255, at & 255, *data)[4:]

    def read(self, at, size):
        """Read bytes by command."""
        return self.address(0x03, at, bytes(size))

    def status(self):
        """Busy, and write enabled."""
        return self.command(0x05, 0)[1]

    def write(self, code, at, data=b""):
        """Write enable, then a command."""
        self.command(0x06)
        self.address(code, at, data)


@pytest.fixture
def driver():
    return Driver()


def test_it_tells_who_it_is(driver):
    assert driver.command(0x9F, 0, 0, 0)[1:] == bytes.fromhex("ef4018")


def test_a_program_takes_its_time_needs_an_enable_and_only_clears_bits(driver):
    driver.address(0x02, AT, b"\x0f")
    assert driver.read(AT, 1) == b"\xff", "without an enable"
    driver.command(0x06)
    assert driver.status() == 2
    driver.address(0x02, AT, b"\x0f\xf0")
    assert driver.status() == 3
    driver.clock += PAGE_CLOCKS
    assert driver.status() == 3
    assert driver.read(AT, 2) == b"\xff\xff", "it reads nothing while it is busy"
    driver.clock += 2
    assert driver.status() == 0, "and the enable has gone"
    assert driver.read(AT, 3) == b"\x0f\xf0\xff"
    driver.write(0x02, AT, b"\xfc")
    driver.clock += PAGE_CLOCKS + 2
    assert driver.read(AT, 1) == b"\x0c"


def test_a_program_goes_round_within_its_page(driver):
    driver.write(0x02, AT + 254, bytes([1, 2, 3]))
    driver.clock += PAGE_CLOCKS + 2
    assert driver.read(AT + 254, 3) == b"\x01\x02\xff"
    assert driver.read(AT, 2) == b"\x03\xff"


def test_an_erase_raises_a_sector_and_no_more_whatever_is_asked_meanwhile(driver):
    driver.memory.write(AT - 1, b"\0" * (SECTOR + 2))
    driver.write(0x20, AT + 77)
    assert driver.status() == 3
    driver.write(0x02, AT + 8, b"\0")
    driver.clock += SECTOR_CLOCKS + 2
    assert driver.status() == 0
    assert driver.read(AT - 1, SECTOR + 2) == b"\0" + b"\xff" * SECTOR + b"\0"
    assert driver.memory.erasures(AT // SECTOR) == 1


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_a_cut_program_leaves_a_beginning(driver, share):
    data = bytes(range(1, 201))
    driver.write(0x02, AT, data)
    driver.clock += int(share * PAGE_CLOCKS)
    driver.memory.cut(driver.clock)
    left = driver.read(AT, 200)
    whole = next(at for at in range(201) if left[:at + 1] != data[:at + 1])
    assert abs(whole - 200 * share) <= 2
    assert left[whole] | data[whole] == left[whole], "some of the bits"
    assert left[whole + 1:] == b"\xff" * (199 - whole)
    assert driver.status() == 0


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_cut_erase_leaves_bits_either_way(driver, share):
    driver.memory.write(AT, bytes(SECTOR))
    driver.write(0x20, AT)
    driver.clock += int(share * SECTOR_CLOCKS)
    driver.memory.cut(driver.clock)
    risen = sum(byte.bit_count() for byte in driver.read(AT, SECTOR)) / (8 * SECTOR)
    assert abs(risen - share) < 0.02


def test_a_cut_can_be_set_by_units(driver):
    driver.memory.cut_after(ERASE_UNITS + 2)
    driver.write(0x20, AT)
    driver.clock += SECTOR_CLOCKS + 2
    assert driver.status() == 0
    driver.write(0x02, AT, bytes(5))
    assert driver.status() == 0xFF, "without power nothing answers"
    driver.memory.cut(driver.clock)
    left = driver.read(AT, 5)
    assert (left[:2], left[3:]) == (bytes(2), b"\xff\xff")
    assert driver.memory.units == ERASE_UNITS + 2
