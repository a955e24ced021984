# SPDX-License-Identifier: Apache-2.0
"""The journal on the whole machine: firmware, gateware and the pins of the flash memory."""

import pytest

from softcore.tables.settings import SETTINGS
from softcore.top import SIMULATED_JOURNAL as REGION
from testbench.cosim.terminal import Terminal
from testbench.models import journal

SPEED = {one.name: one.number for one in SETTINGS}["highest_speed_mm_min"]
WRITTEN_S = 0.6     # quiet for a quarter of a second, an erase, some pages


def greeting(session):
    """Lines of the first quarter of a second."""
    said = b""
    end = session.cycle + session.clock_hz // 4
    while session.cycle < end:
        said += session.receive(min(20_000, end - session.cycle))
    return said.decode().split("\r\n")[:-1]


def asked(session, line):
    """What the controller sends to a line."""
    session.send(line.encode() + b"\n")
    said = b""
    end = session.cycle + session.clock_hz
    while not said.endswith(b"ok\r\n") and session.cycle < end:
        said += session.receive(min(20_000, end - session.cycle))
    return said.decode().split("\r\n")[:-1]


def speed(session):
    """The setting that the tests change, as ``$$`` lists it."""
    return next(int(line.split("=")[1]) for line in asked(session, "$$")
                if line.startswith(f"${SPEED}="))


def test_a_setting_an_offset_and_a_place_outlive_power_off(on):
    session = on()
    terminal = Terminal(session)
    for line in (f"${SPEED}=777", "G10 L2 P2 X1.5", "G28.1", "G10 C701 I2 P30 Q30"):
        terminal.enter(line)
    terminal.run(WRITTEN_S)
    terminal.watched_well()
    flash = session.power_off()
    assert journal.contents(flash)[journal.SETTINGS] == [SPEED, 777]
    session = on(flash)
    assert greeting(session) == ["Grbl 1.1h ['$' for help]"], "nothing to complain about"
    assert speed(session) == 777
    assert session.probe("safety_status_safe"), "locked as always"
    assert "[G55:1.5000,0.0000,0.0000]" in asked(session, "$#")
    terminal = Terminal(on(flash))
    terminal.enter("C701")
    terminal.enter("G28")


def test_writing_waits_while_the_machine_moves(on):
    session = on()
    terminal = Terminal(session)
    terminal.enter(f"${SPEED}=777")
    terminal.enter("G91")
    terminal.enter("G01 Z1 F60")    # so slow that the ramp itself is at rest
    for _ in range(4):
        terminal.run(0.2)
        assert session.flash.units == 0
    terminal.run(1.5)
    assert session.positions()["z"] == session.get("pulses_per_mm")
    assert session.flash.units > 0
    terminal.watched_well()


def test_without_a_memory_it_is_told_and_all_works(on):
    session = on()
    session.set("force.flash_absent", 1)
    assert greeting(session) == [
        "Grbl 1.1h ['$' for help]",
        "[MSG:no flash memory answers (identity 16777215): power-off clears settings and offsets.]"]
    assert asked(session, f"${SPEED}=777") == ["ok"]
    assert speed(session) == 777


def random_cuts(on, rng, count):
    """Cut the power in random clocks while a setting and an offset are written."""
    session = on()
    greeting(session)
    for value in range(500, 500 + rng.randrange(1, 9)):
        old = value
        assert asked(session, f"${SPEED}={value}") == ["ok"]
        session.run(round(WRITTEN_S * session.clock_hz))
    flash = session.power_off()
    places = journal.contents(flash)[journal.PLACES]
    left = []
    for _ in range(count):
        session = on(flash, seed=rng.randrange(1 << 32))
        greeting(session)
        new = rng.randrange(600, 900)
        assert asked(session, f"${SPEED}={new}") == ["ok"]
        at = rng.randrange(round(0.2 * session.clock_hz), round(0.4 * session.clock_hz))
        session.run(at)
        flash = session.power_off()
        session.close()
        session = on(flash)
        assert greeting(session) == ["Grbl 1.1h ['$' for help]"]
        found = speed(session)
        assert found in (old, new)
        assert session.probe("safety_status_safe")
        left.append(found == new)
        session.close()
        assert journal.contents(flash)[journal.PLACES] == places
        old = found
    return left


def test_a_power_cut_in_a_random_clock_leaves_the_old_or_the_new(on, rng):
    random_cuts(on, rng, 3)


@pytest.mark.soak
def test_a_thousand_power_cuts(on, rng):
    left = random_cuts(on, rng, 1000)
    assert 100 < sum(left) < 900, "cuts before and after the record"


def test_the_region_is_all_that_is_written(on):
    session = on()
    greeting(session)
    asked(session, f"${SPEED}=777")
    session.run(round(WRITTEN_S * session.clock_hz))
    first = REGION.base // journal.SECTOR
    assert session.flash.erasures(first) == 1
    assert sum(session.flash.erasures(sector) for sector in range(4096)) == 1
