# SPDX-License-Identifier: Apache-2.0
"""What outlives power-off, over a journal in the model of the flash memory: whole or not at all."""

import pytest

from softcore.tables.settings import SETTINGS
from softcore.top import SIMULATED_JOURNAL as REGION
from testbench.firmware import Controller, Memory
from testbench.models import journal
from testbench.native.flash import ERASE_UNITS, SECTOR
from testbench.programs import punched

NUMBER = {one.name: one.number for one in SETTINGS}
SPEED = NUMBER["highest_speed_mm_min"]
QUIET = 900         # passes in which a change is written, without an erase
ERASED = 2000      # with one
SECTORS = REGION.size // SECTOR
RECORD = 2 * 16 + 7 * 44    # bytes of that of seven conditions, in two pages
GREETING = "Grbl 1.1h ['$' for help]"


@pytest.fixture
def memory():
    return Memory()


def booted(memory, region=REGION, **options):
    """Power off and on."""
    memory.cut(1 << 62)
    return Controller(memory=memory, **options)


def listed(machine, *numbers):
    """Values of settings, of a list with ``$$``."""
    rows = dict(row[1:].split("=") for row in machine.line("$$", passes=2000)[:-1])
    return tuple(int(rows[str(number)]) for number in numbers)


def places(machine):
    """Rows of ``$#`` without those of G92 and what follows it in grbl."""
    return [row for row in machine.line("$#", passes=600)[:-1]
            if not row.startswith(("[G92", "[TLO", "[PRB"))]


def kept(memory):
    """The region of the journal."""
    return memory.read(REGION.base, REGION.size)


def enter(machine, *lines, passes=QUIET):
    """Enter lines, and wait until they are written."""
    for line in lines:
        assert machine.line(line)[-1] == "ok", line
    machine.run(passes)


def test_what_is_entered_outlives_power_off(memory):
    machine = booted(memory)
    machine.unlock()
    enter(machine, f"${SPEED}=777", f"${NUMBER['repeats']}=0", "G10 L2 P1 X1.5 Y-2 Z3",
          "G10 L2 P6 Z-0.25", "G00 X0.01", "G28.1", "G10 D3 R0.125", "G92 X7",
          "G10 C701 I2 P30 Q30 K-1", "G10 W2 X9 Y8 Z7 H75", passes=ERASED)
    before = places(machine)
    machine = booted(memory)
    assert machine.lines == [GREETING], "nothing to complain about"
    assert "Alarm" in machine.line("?")[0], "locked as always"
    assert listed(machine, SPEED, NUMBER["repeats"]) == (777, 0)
    assert places(machine) == before
    assert "[G54:1.5000,-2.0000,3.0000]" in before
    assert "[G28:1.5100,0.0000,0.0000]" in before
    assert "[D3:0.1250]" in before
    machine.unlock()
    assert machine.line("G28") == ["ok"], "the place is stored"
    assert machine.line("C701")[-1] == "ok"
    assert machine.power["negative"] == 1
    assert "[G92:0.0000,0.0000,0.0000]" in machine.line("$#", passes=600), "as in grbl"
    found = journal.contents(kept(memory))
    assert dict(zip(found[journal.SETTINGS][::2], found[journal.SETTINGS][1::2], strict=True)) == {
        SPEED: 777, NUMBER["repeats"]: 0}
    assert found[journal.CLASSES][2] == 9 | 8 << 8 | 7 << 16 | 75 << 24
    assert len(found[journal.CONDITIONS]) == 11


def test_the_tables_of_all_screws_outlive_power_off(memory):
    wanted = {one.number: one.highest - one.number % 7 for one in SETTINGS if one.group == "pitch"}
    machine = booted(memory)
    enter(machine, *(f"${number}={value}" for number, value in wanted.items()), passes=ERASED)
    machine = booted(memory)
    assert machine.lines == [GREETING], "nothing to complain about"
    assert listed(machine, *wanted) == tuple(wanted.values())
    found = journal.contents(kept(memory))[journal.SETTINGS]
    assert dict(zip(found[::2], found[1::2], strict=True)) == wanted


def test_a_tapes_conditions_are_not_kept_but_its_offsets_are(memory):
    machine = booted(memory)
    machine.unlock()
    machine.tape(punched(["G10 C702 I2 P30 Q30", "G10 L2 P2 X4", "M02"]))
    machine.run(ERASED)
    machine = booted(memory)
    machine.unlock()
    assert "[G55:4.0000,0.0000,0.0000]" in places(machine)
    assert machine.line("C702")[-1].startswith("error:")


def cuts(memory, machine_of, change, states, look):
    """Cut the power at every byte of a change; look at what the next power-on finds.

    ``states`` are the allowed results of ``look``: before the change, and after it. The change must
    be in force once it has been written whole.
    """
    start = kept(memory)
    machine = machine_of(memory)
    before = memory.units
    change(machine)
    total = memory.units - before
    assert look(machine_of(memory)) == states[1]
    found = []
    for units in range(total + 1):
        memory.write(REGION.base, start)
        machine = machine_of(memory)
        memory.cut_after(units)
        change(machine)
        memory.cut_after(-1)
        machine = machine_of(memory)
        assert machine.lines == [GREETING], (units, machine.lines)
        assert "Alarm" in machine.line("?")[0], "locked as always"
        found.append(look(machine))
        assert found[-1] in states, (units, found[-1])
    assert found[0] == states[0]
    assert found[-1] == states[1]
    return total, found


def two_settings(machine):
    return listed(machine, SPEED, NUMBER["repeats"])


def test_a_power_cut_at_every_byte_leaves_the_old_or_the_new(memory):
    """Two settings of one record: both are old, or both new."""
    enter(booted(memory), f"${SPEED}=700", f"${NUMBER['repeats']}=3", passes=ERASED)
    total, _ = cuts(memory, booted,
                    lambda machine: enter(machine, f"${SPEED}=701", f"${NUMBER['repeats']}=4"),
                    [(700, 3), (701, 4)], two_settings)
    assert total == 12 + 16 + 4, "a page, and no more"


@pytest.mark.soak
def test_a_power_cut_at_every_byte_of_a_long_record(memory):
    """A record of two pages, of which the change alters both."""
    two_pages(memory)

    def change(again):
        again.unlock()
        enter(again, *reverse(True))

    total, _ = cuts(memory, booted, change, [(0, 0), (1, 1)], reversed_ones)
    assert total == RECORD


def two_pages(memory):
    """Enter conditions that fill one page of their record and begin another."""
    machine = booted(memory)
    machine.unlock()
    enter(machine, *(f"G10 C{number} I2 P30 Q30" for number in range(701, 708)), passes=ERASED)


def reverse(on):
    """Lines that change the polarity of a condition in each page."""
    return [f"G10 C{number} I2 P30 Q30 K{-1 if on else 1}" for number in (701, 707)]


def reversed_ones(machine):
    """Whether the polarity of these conditions is negative."""
    machine.unlock()
    found = []
    for number in (701, 707):
        assert machine.line(f"C{number}")[-1] == "ok"
        found.append(machine.power["negative"])
    return tuple(found)


def test_a_change_while_a_record_is_written_makes_no_mixture(memory):
    """The power is cut when as many bytes have been written as one whole record has."""
    two_pages(memory)
    start, found = kept(memory), set()
    for passes in range(0, 240, 6):
        memory.write(REGION.base, start)
        machine = booted(memory)
        machine.unlock()
        before = memory.units
        enter(machine, *reverse(True), passes=0)
        for _ in range(QUIET):
            if memory.units != before:
                break
            machine.run(1)
        machine.run(passes)
        machine.send("".join(f"{line}\n" for line in reverse(False)).encode())
        memory.cut_after(max(0, RECORD - (memory.units - before)))
        machine.run(ERASED)
        memory.cut_after(-1)
        found.add(reversed_ones(booted(memory)))
    assert found == {(0, 0), (1, 1)}


def test_a_power_cut_at_every_byte_while_a_new_sector_begins(memory):
    machine = booted(memory)
    enter(machine, f"${SPEED}=500", passes=ERASED)
    for value in range(501, 600):
        if memory.read(REGION.base + SECTOR - journal.PAGE, 1) != b"\xff":
            break
        enter(machine, f"${SPEED}={value}")
    else:
        pytest.fail("the sector never fills")
    old, = listed(booted(memory), SPEED)
    total, found = cuts(memory, booted,
                        lambda again: enter(again, f"${SPEED}=800", passes=ERASED),
                        [old, 800], lambda again: listed(again, SPEED)[0])
    assert total == ERASE_UNITS + 5 * 16 + 4 * (2 + 41 + 4), "records of all kinds, and the opening"
    assert found.count(800) == 1, "in force with its last byte"


def test_the_old_sector_stays_while_the_new_one_is_begun_again(memory):
    """Changes that never end, in a region of two sectors: the new one fills before it is whole."""
    library = Controller().library
    first = REGION.base // SECTOR
    try:
        library.gk_flash_region(first, 2)
        two_pages(memory)
        machine = booted(memory)
        machine.unlock()
        for value in range(501, 600):
            if memory.read(REGION.base + SECTOR - journal.PAGE, 1) != b"\xff":
                break
            enter(machine, f"${SPEED}={value}")
        machine.line(f"${SPEED}=800")
        while memory.erasures(first + 1) < 1:
            machine.run(10)
        for turn in range(400):
            machine.send("".join(f"{line}\n" for line in reverse(turn % 2)).encode())
            machine.run(40)
            if memory.erasures(first + 1) > 2:
                break
        assert memory.erasures(first) == 1, "it is not touched"
        assert memory.erasures(first + 1) > 2, "it has been begun again"
        assert listed(booted(memory), SPEED) == (value - 1,)
    finally:
        library.gk_flash_region(first, SECTORS)


def test_the_machine_that_a_cut_left_writes_again(memory):
    """After a cut at any byte the next change is kept, and the one before does not come back."""
    enter(booted(memory), f"${SPEED}=700", passes=ERASED)
    start = kept(memory)
    for units in range(0, 33, 4):
        memory.write(REGION.base, start)
        machine = booted(memory)
        memory.cut_after(units)
        enter(machine, f"${SPEED}=701")
        memory.cut_after(-1)
        enter(booted(memory), f"${SPEED}=702")
        assert listed(booted(memory), SPEED) == (702,), units


def test_nothing_is_written_while_the_machine_moves_or_discharges(memory):
    machine = booted(memory)
    machine.unlock()
    machine.library.gk_moving(1)
    enter(machine, f"${NUMBER['optional_stop']}=1", passes=ERASED)
    assert memory.units == 0
    machine.library.gk_moving(0)
    machine.run(ERASED)
    assert memory.units > 0
    units = memory.units
    enter(machine, "C100", "M03", f"${NUMBER['optional_stop']}=0")
    assert memory.units == units
    enter(machine, "M05")
    assert memory.units > units


def test_a_write_that_was_interrupted_goes_on(memory):
    """The machine begins to move in the middle of a page; at rest the page is finished."""
    machine = booted(memory)
    enter(machine, f"${SPEED}=700", passes=ERASED)
    for passes in range(480, 640, 8):
        value = 701 + passes
        assert machine.line(f"${SPEED}={value}", passes=passes) == ["ok"]
        machine.library.gk_moving(1)
        machine.run(2000)
        machine.library.gk_moving(0)
        machine.run(QUIET)
        assert journal.contents(kept(memory))[journal.SETTINGS] == [SPEED, value], passes


def test_an_equal_value_is_not_written(memory):
    machine = booted(memory)
    enter(machine, f"${SPEED}=700", passes=ERASED)
    units = memory.units
    enter(machine, f"${SPEED}=700", f"${SPEED}=701", f"${SPEED}=700")
    machine.unlock()
    machine.tape(punched(["G04 P1", "M02"]))
    machine.run(QUIET)
    assert memory.units == units
    enter(booted(memory), f"${SPEED}=700")
    assert memory.units == units


def test_wear_is_spread_over_the_region_and_nothing_else_is_touched(memory):
    machine = booted(memory)
    changes = 12 * SECTORS
    enter(machine, f"${SPEED}=500", passes=ERASED)
    for index in range(changes):
        enter(machine, f"${SPEED}={501 + index}", passes=ERASED)
    first = REGION.base // SECTOR
    erased = [memory.erasures(first + index) for index in range(SECTORS)]
    assert max(erased) - min(erased) <= 1
    assert sum(erased) <= 1 + changes / 11 + 1, "4 of 15 pages are for all kinds"
    assert sum(memory.erasures(index) for index in range(4096)) == sum(erased)
    assert listed(booted(memory), SPEED) == (500 + changes,)


@pytest.mark.parametrize(("region", "says"), [
    ((0xE00, 0), "[MSG:no flash memory answers (identity 0): power-off clears settings and "
                 "offsets.]"),
    ((0xFF8, 16), "[MSG:no flash memory answers (identity 15679512): power-off clears settings and "
                  "offsets.]"),
])
def test_without_a_memory_it_is_told_once_and_all_works(memory, region, says):
    machine = Controller()
    try:
        machine.library.gk_flash_region(*region)
        machine = booted(memory)
        assert machine.lines == [GREETING, says]
        machine.send(b"\x18")
        assert machine.run() == [GREETING], "once"
        enter(machine, f"${SPEED}=700", passes=ERASED)
        assert listed(machine, SPEED) == (700,)
        assert memory.units == 0
    finally:
        machine.library.gk_flash_region(0xE00, 16)


UNREADABLE = ("[MSG:the journal in flash memory cannot be read: settings, offsets, conditions and "
              "fluid classes are as built.]")


def test_an_unreadable_journal_is_told_and_the_next_change_heals_it(memory, rng):
    memory.write(REGION.base, rng.randbytes(REGION.size))
    machine = booted(memory)
    assert machine.lines == [GREETING, UNREADABLE]
    assert listed(machine, SPEED) == listed(Controller(), SPEED)
    machine = booted(memory)
    enter(machine, f"${SPEED}=700", passes=ERASED)
    machine = booted(memory)
    assert machine.lines == [GREETING]
    assert listed(machine, SPEED) == (700,)


def test_a_kind_that_is_missing_is_told(memory):
    memory.write(REGION.base, journal.sector({journal.SETTINGS: [SPEED, 700]}))
    machine = booted(memory)
    assert machine.lines == [GREETING, UNREADABLE]
    assert listed(machine, SPEED) == (700,)


def records(**given):
    """Records of every kind, as built unless given."""
    usual = {"settings": [], "places": [0] * 41, "conditions": [],
             "classes": [3 | 6 << 8 | 14 << 16 | 100 << 24, 5 | 5 << 8 | 18 << 16 | 99 << 24,
                         8 | 3 << 8 | 22 << 16 | 98 << 24, 13 | 2 << 8 | 28 << 16 | 75 << 24]}
    return dict(zip(journal.KINDS, (usual | given).values(), strict=True))


def row(number=701, milli_ip=2000, negative=0, from_ignition=0, on=30, off=30, rest=30, open_v=80,
        percent=75, arc=20, short=12, step=50, reference=0, drop=0, counting=0, wait=0):
    """Words of a condition."""
    return [number, milli_ip | negative << 16 | from_ignition << 24, on | off << 16,
            rest | open_v << 16, percent | arc << 8 | short << 16, step << 16, reference, drop,
            counting, wait << 16, 0]


def test_the_models_records_are_read(memory):
    memory.write(REGION.base, journal.sector(records(
        settings=[SPEED, 700], places=[10_000, *[0] * 40], conditions=row())))
    machine = booted(memory)
    assert machine.lines == [GREETING]
    assert listed(machine, SPEED) == (700,)
    assert "[G54:1.0000,0.0000,0.0000]" in places(machine)
    machine.unlock()
    assert machine.line("C701")[-1] == "ok"


TRAVEL = 4 * 2**28
BAD = {
    "a setting above its range": dict(settings=[SPEED, 1 << 31]),
    "no such setting": dict(settings=[399, 1]),
    "a work offset too far": dict(places=[TRAVEL + 1, *[0] * 40]),
    "a work offset too low": dict(places=[2**32 - TRAVEL - 1, *[0] * 40]),
    "a wire offset below 0": dict(places=[*[0] * 25, 2**32 - 1, *[0] * 15]),
    "no truth value": dict(places=[*[0] * 40, 2 << 16]),
    "too few places": dict(places=[0] * 40),
    "a share below half": dict(classes=[49 << 24, *records()[journal.CLASSES][1:]]),
    "a share above all": dict(classes=[101 << 24, *records()[journal.CLASSES][1:]]),
    "no on-time": dict(conditions=row(on=0)), "too long": dict(conditions=row(on=2001)),
    "no off-time": dict(conditions=row(off=0)), "rest": dict(conditions=row(rest=20_001)),
    "half a step of current": dict(conditions=row(milli_ip=2500)),
    "more current than there is": dict(conditions=row(milli_ip=21_000)),
    "no polarity": dict(conditions=row(negative=2)),
    "no beginning": dict(conditions=row(from_ignition=3)),
    "a capacitor with a wait": dict(conditions=row(from_ignition=2, wait=5)),
    "pulse and wait too long": dict(conditions=row(from_ignition=1, on=1500, wait=501)),
    "a wait from the gate": dict(conditions=row(wait=5)),
    "an open voltage between": dict(conditions=row(open_v=90)),
    "an open voltage too high": dict(conditions=row(open_v=320)),
    "an open level too low": dict(conditions=row(percent=50)),
    "an arc level of its own": dict(conditions=row(arc=10)),
    "a short level of its own": dict(conditions=row(short=0)),
    "no step": dict(conditions=row(step=0)),
    "a reference above all": dict(conditions=row(reference=80_000)),
    "a drop above all": dict(conditions=row(drop=40_000)),
    "no way to count": dict(conditions=row(counting=7)),
}


@pytest.mark.parametrize("given", BAD.values(), ids=BAD)
def test_what_is_out_of_range_is_as_built_and_told(memory, given):
    memory.write(REGION.base, journal.sector(records(**given)))
    machine = booted(memory)
    assert machine.lines == [GREETING, "[MSG:out of range in the journal, so as built: 1 settings, "
                                       "offsets or conditions.]"]
    built = Controller()
    assert listed(machine, SPEED) == listed(built, SPEED)
    machine = booted(memory)
    assert [row for row in places(machine) if "D" in row] == []
    machine.unlock()
    assert machine.line("C701")[-1].startswith("error:")


def test_a_guard_that_is_masked_is_told_after_power_on(memory):
    fluid = NUMBER["fluid_required"]
    enter(booted(memory), f"${fluid}=0", passes=ERASED)
    machine = booted(memory)
    assert listed(machine, fluid) == (0,)
    assert "|Off:" in machine.line("?")[0]


@pytest.mark.parametrize(("line", "settings", "offsets", "conditions"), [
    ("$RST=$", False, True, True), ("$RST=#", True, False, True),
    ("$RST=*", False, False, False), ("$rst=*", False, False, False)])
def test_rst_takes_back_what_grbl_does_and_keeps_that(memory, line, settings, offsets, conditions):
    machine = booted(memory)
    machine.unlock()
    enter(machine, f"${SPEED}=700", "G10 L2 P2 X4", "G28.1", "G10 C701 I2 P30 Q30", passes=ERASED)
    initial, = listed(Controller(), SPEED)
    machine = booted(memory)
    machine.unlock()
    assert machine.line(line) == ["[MSG:Restoring defaults]", "ok"]
    lost = machine.line("G00 X0.1")[-1].startswith("error:")
    assert lost is not settings, "drives may count otherwise with other settings"
    assert machine.line("$POSITION=HERE") == ["ok"]
    machine.run(ERASED)
    for _ in range(2):
        assert listed(machine, SPEED) == (700 if settings else initial,)
        assert ("[G55:4.0000,0.0000,0.0000]" in places(machine)) is offsets
        assert (machine.line("G28")[-1] == "ok") is offsets
        assert (machine.line("C701")[-1] == "ok") is conditions
        machine = booted(memory)
        machine.unlock()


def test_rst_waits_for_rest_and_says_what_it_takes(memory):
    machine = booted(memory)
    machine.unlock()
    machine.library.gk_moving(1)
    assert machine.line("$RST=*")[0] == ("[MSG:$RST has to wait until the machine stands and no "
                                         "program runs.]")
    machine.library.gk_moving(0)
    for wrong in ("$RST=", "$RST=$$", "$RST=1"):
        assert machine.line(wrong)[0] == ("[MSG:$RST takes $ (settings), # (offsets and places) or "
                                          "* (all).]")


def test_a_page_that_does_not_read_back_is_left_and_after_four_it_is_told(memory):
    """Bits that are low where the firmware finds an empty page: a worn sector."""
    enter(booted(memory), f"${SPEED}=700", passes=ERASED)
    worn = range(5, 7)
    for number in worn:
        memory.write(REGION.base + number * journal.PAGE + 12, b"\0\0")
    machine = booted(memory)
    enter(machine, f"${SPEED}=701", passes=ERASED)
    machine = booted(memory)
    assert machine.lines == [GREETING]
    assert listed(machine, SPEED) == (701,)
    for number in range(8, 16):
        memory.write(REGION.base + number * journal.PAGE + 12, b"\0\0")
    machine = booted(memory)
    assert machine.line(f"${SPEED}=702") == ["ok"]
    assert machine.run(ERASED) == ["[MSG:the flash memory does not keep what is written: power-off "
                                   "clears it.]"]
    assert listed(booted(memory), SPEED) == (701,)
