# SPDX-License-Identifier: Apache-2.0
"""Other firmware over the link, into a slot: the old one or the new one runs."""

import ctypes
import struct

import pytest

from softcore.top import SIMULATED_JOURNAL as REGION
from testbench.firmware import Controller, Memory, library
from testbench.models import firmware_slots as model
from testbench.native.flash import ERASE_UNITS, SECTOR

GREETING = "Grbl 1.1h ['$' for help]"
BUILT_IN = model.image(1, 2, 3)
FIRST = model.image(*range(100, 160))
SECOND = model.image(*range(300, 360))
PLACES = [REGION.base + REGION.size + number * REGION.slot for number in range(2)]
REST = "[MSG:firmware is taken only at rest and disarmed: Ctrl-X first.]"
ORDER = "[MSG:this piece of firmware is not the next one: begin again.]"
PASSES = 160        # an erase and a page


def digest(image):
    return model.words(image)[-1]


BASE = digest(BUILT_IN)


@pytest.fixture
def memory():
    code = library("undefined")
    told = model.words(BUILT_IN)
    code.gk_configured((ctypes.c_uint32 * len(told))(*told), len(told) - 1, told[-1])
    yield Memory()
    code.gk_configured(None, 0, 0)
    code.gk_press_arm(0)


def booted(memory):
    """Power off and on."""
    memory.cut(1 << 62)
    return Controller(memory=memory)


def running(machine):
    """Slot, state and digest, as ``$FIRMWARE`` tells them."""
    told, end = machine.line("$FIRMWARE")
    assert end == "ok"
    slot, state, value, edition, size, room = told.removeprefix("[FIRMWARE:").rstrip("]").split(",")
    assert (edition, size) == ("1", "65536")
    assert int(room) == REGION.slot - SECTOR
    return int(slot), state, int(value)


def ordered(machine, order, payload=b""):
    """The answer to an order."""
    return machine.line(f"$FIRMWARE={order}{model.characters(payload)}",
                        passes=PASSES * (2 if order == "C" else 1))


def pieces(image):
    """Orders that put an image into a slot, and their bytes."""
    yield "B", struct.pack("<2I", len(image), digest(image))
    for at in range(0, len(image), model.CHUNK):
        yield "D", struct.pack("<I", at) + image[at:at + model.CHUNK]
    yield "E", b""


def put(machine, image):
    """Put an image into a slot; return the last answer."""
    for order, payload in pieces(image):
        said = ordered(machine, order, payload)
        if said != ["ok"]:
            return said
    return said


def slots(memory):
    """What the two slots have."""
    return [model.read(memory.read(place, SECTOR + 4096)) for place in PLACES]


def outside(memory):
    """Bytes around the slots."""
    return memory.read(0, PLACES[0]) + memory.read(PLACES[0] + 2 * REGION.slot, 1 << 16)


def test_new_firmware_runs_after_power_off_and_on(memory):
    machine = booted(memory)
    assert running(machine) == (0, "built-in", BASE)
    before = outside(memory)
    assert put(machine, FIRST) == ["ok"]
    assert running(machine) == (0, "built-in", BASE), "until power-off"
    machine = booted(memory)
    assert machine.lines == [GREETING]
    assert running(machine) == (1, "trial", digest(FIRST))
    assert machine.line("$I")[2].startswith("[FIRMWARE:1,trial,")
    assert ordered(machine, "K") == ["ok"]
    assert running(machine) == (1, "kept", digest(FIRST))
    for _ in range(2):
        machine = booted(memory)
        assert machine.lines == [GREETING]
        assert running(machine) == (1, "kept", digest(FIRST))
    assert outside(memory) == before
    assert slots(memory)[0] == model.Slot(1, digest(FIRST), BASE, FIRST, True, True)


def test_slots_take_turns(memory):
    machine = booted(memory)
    for number in range(5):
        image = model.image(number, *range(40))
        assert put(machine, image) == ["ok"]
        machine = booted(memory)
        assert running(machine) == (1 + number % 2, "trial", digest(image))
        assert ordered(machine, "K") == ["ok"]


def test_firmware_that_was_not_confirmed_is_not_started_again(memory):
    machine = booted(memory)
    put(machine, FIRST)
    machine = booted(memory)
    ordered(machine, "K")
    put(machine, SECOND)
    assert running(booted(memory)) == (2, "trial", digest(SECOND))
    for _ in range(2):
        machine = booted(memory)
        assert machine.lines == [GREETING, "[MSG:the firmware in slot 2 was tried and not "
                                           "confirmed: it is not used.]"]
        assert running(machine) == (1, "kept", digest(FIRST))
    assert put(machine, SECOND) == ["ok"]
    assert running(booted(memory)) == (2, "trial", digest(SECOND))


def test_arm_held_at_power_on_and_an_order_lead_back(memory):
    machine = booted(memory)
    put(machine, FIRST)
    ordered(booted(memory), "K")
    library("undefined").gk_press_arm(1)
    machine = booted(memory)
    assert machine.lines == [GREETING, "[MSG:the firmware in slot 1 is not used: ARM was held at "
                                       "power-on.]"]
    assert running(machine) == (0, "built-in", BASE)
    library("undefined").gk_press_arm(0)
    machine = booted(memory)
    assert running(machine) == (1, "kept", digest(FIRST))
    assert ordered(machine, "C") == ["ok"]
    assert slots(memory) == [None, None]
    machine = booted(memory)
    assert machine.lines == [GREETING]
    assert running(machine) == (0, "built-in", BASE)


def cuts(memory, before, every=lambda total: range(total + 1)):
    """Cut the power at bytes of a transfer; ``before`` slots have had firmware."""
    start = booted(memory)
    old = (0, "built-in", BASE)
    for number in range(before):
        image = model.image(number, *range(20))
        assert put(start, image) == ["ok"]
        start = booted(memory)
        ordered(start, "K")
        old = (number + 1, "kept", digest(image))
    new = (1 + before % 2, "trial", digest(FIRST))
    begins = [memory.read(place, SECTOR + 4096) for place in PLACES]
    units = memory.units
    assert put(start, FIRST) == ["ok"]
    total = memory.units - units
    assert total == 2 * ERASE_UNITS + len(FIRST) + model.HEAD
    found = []
    for cut in every(total):
        for place, held in zip(PLACES, begins, strict=True):
            memory.write(place, held)
        machine = booted(memory)
        assert running(machine) == old
        memory.cut_after(cut)
        put(machine, FIRST)
        memory.cut_after(-1)
        machine = booted(memory)
        found.append(running(machine))
        assert not machine.library.gk_hangs()
        assert found[-1] in (old, new), cut
    # The power cut in the last byte may have left all of its bits.
    assert found.index(new) >= len(found) - 2, "in force with the last byte of its head"


@pytest.mark.parametrize("before", [0, 1, 2])
def test_a_power_cut_leaves_the_old_or_the_new(memory, before):
    """The built-in firmware, that of a slot, and that of a slot with an older one in the other."""
    cuts(memory, before, lambda total: [*range(0, total - model.HEAD, 37),
                                        *range(total - model.HEAD, total + 1, 6)])


@pytest.mark.soak
@pytest.mark.parametrize("before", [0, 1, 2])
def test_a_power_cut_at_every_byte_leaves_the_old_or_the_new(memory, before):
    cuts(memory, before)


def test_a_cut_while_it_is_marked_as_tried_starts_it_later(memory):
    put(booted(memory), FIRST)
    memory.cut_after(0)
    booted(memory)
    memory.cut_after(-1)
    assert running(booted(memory))[2] == digest(FIRST)


def test_nothing_is_taken_unless_the_machine_is_at_rest_and_disarmed(memory):
    machine = booted(memory)
    orders = list(pieces(FIRST))
    assert ordered(machine, *orders[0]) == ["ok"]
    units = memory.units
    orders += ("K", b""), ("C", b"")

    def refused():
        return all(ordered(machine, order, payload)[0] == REST for order, payload in orders)

    machine.library.gk_moving(1)
    assert refused(), "an axis moves, though the outputs are safe"
    machine.library.gk_moving(0)
    machine.unlock()
    assert refused(), "armed"
    machine.send(b"\x18")
    machine.run()
    machine.library.gk_moving(1)
    assert refused(), "an axis moves"
    assert memory.units == units
    machine.library.gk_moving(0)
    machine.run()
    assert put(machine, FIRST) == ["ok"]


def test_pieces_are_taken_in_their_order_only(memory):
    machine = booted(memory)
    begin, first, second, third, end = pieces(FIRST)
    for order in (first, end):
        assert ordered(machine, *order)[0] == ORDER, "not begun"
    assert ordered(machine, *begin) == ["ok"]
    for order in (second, end, ("D", first[1][:-1]), ("D", b""), ("D", first[1] + b"1")):
        assert ordered(machine, *order)[0] == ORDER
    assert ordered(machine, *first) == ["ok"]
    assert ordered(machine, *first)[0] == ORDER, "twice"
    assert ordered(machine, *end)[0] == ORDER, "too soon"
    assert ordered(machine, *second) == ["ok"]
    assert ordered(machine, *third) == ["ok"]
    assert ordered(machine, *third)[0] == ORDER, "beyond its end"
    assert ordered(machine, *end) == ["ok"]
    assert ordered(machine, *end)[0] == ORDER, "it has ended"
    assert running(booted(memory))[2] == digest(FIRST)


@pytest.mark.parametrize(("line", "says"), [
    ("$FIRMWARE=", "$FIRMWARE takes =B, =D, =E, =K or =C"),
    ("$FIRMWARE=X", "$FIRMWARE takes =B, =D, =E, =K or =C"),
    ("$FIRMWAREB", "$FIRMWARE takes =B, =D, =E, =K or =C"),
    ("$FIRMWARE=B", "this piece of firmware is not the next one: begin again"),
])
def test_a_wrong_line_is_told(memory, line, says):
    assert booted(memory).line(line)[0] == f"[MSG:{says}.]"


@pytest.mark.parametrize("length", [0, 16, 22, REGION.slot - SECTOR + 4, 65536 - 4096 + 4, 1 << 31])
def test_a_length_that_cannot_be_is_refused(memory, length):
    machine = booted(memory)
    units = memory.units
    assert ordered(machine, "B", struct.pack("<2I", length, 1))[0] == (
        "[MSG:the firmware is too long, or cut short.]")
    assert memory.units == units


@pytest.mark.parametrize("image", [
    model.image(5, mark=0), model.image(5, edition=2), model.image(5, memory=1 << 15)],
    ids=["mark", "edition", "memory"])
def test_firmware_of_another_controller_is_neither_taken_nor_started(memory, image):
    machine = booted(memory)
    assert put(machine, image)[0] == "[MSG:the firmware is made for another controller.]"
    memory.write(PLACES[0], model.slot(image, base=BASE, confirmed=True))
    assert running(booted(memory)) == (0, "built-in", BASE)


def test_firmware_for_another_built_in_one_is_not_started(memory):
    """The gateware was loaded anew, with other firmware: then that runs."""
    memory.write(PLACES[0], model.slot(FIRST, base=BASE ^ 1, confirmed=True))
    assert running(booted(memory)) == (0, "built-in", BASE)
    memory.write(PLACES[0], model.slot(FIRST, base=BASE, confirmed=True))
    assert running(booted(memory)) == (1, "kept", digest(FIRST)), "the model's slot is a good one"


def test_every_wrong_byte_is_found_before_the_start(memory):
    put(booted(memory), FIRST)
    whole = memory.read(PLACES[0], SECTOR + len(FIRST))
    for at in [*range(model.HEAD), *range(SECTOR, SECTOR + len(FIRST), 5)]:
        memory.write(PLACES[0], whole)
        memory.write(PLACES[0] + at, bytes([whole[at] ^ 1 << at % 8]))
        machine = booted(memory)
        assert not machine.library.gk_hangs()
        if at >= SECTOR + 16:
            assert machine.lines == [GREETING, "[MSG:the firmware in slot 1 is damaged: it is not "
                                               "used.]"]
        assert running(machine) == (0, "built-in", BASE), at


def test_a_memory_that_does_not_keep_it_is_told_and_the_old_stays(memory):
    machine = booted(memory)
    *orders, end = pieces(FIRST)
    for order in orders:
        assert ordered(machine, *order) == ["ok"]
    memory.write(PLACES[0] + SECTOR + 100, b"\0")
    assert ordered(machine, *end)[0] == ("[MSG:the flash memory does not hold what was sent: the "
                                         "old firmware stays.]")
    assert slots(memory) == [None, None]


def test_a_wrong_digest_is_told(memory):
    machine = booted(memory)
    (order, begin), *others, end = pieces(FIRST)
    assert ordered(machine, order, begin[:4] + bytes(4)) == ["ok"]
    for one in others:
        assert ordered(machine, *one) == ["ok"]
    assert "does not hold what was sent" in ordered(machine, *end)[0]


def test_a_reset_gives_up_and_the_next_beginning_works(memory):
    for count in range(1, 6):
        machine = booted(memory)
        orders = list(pieces(FIRST))
        for order, payload in orders[:count]:
            machine.send(f"$FIRMWARE={order}{model.characters(payload)}\n".encode())
            machine.run(5)
        machine.send(b"\x18")
        machine.run(PASSES)
        assert ordered(machine, *orders[-1])[0] == ORDER
        assert put(machine, FIRST) == ["ok"]
        ordered(machine, "C")


def test_without_a_memory_it_is_told(memory):
    machine = Controller(memory=memory)
    try:
        machine.library.gk_flash_region(0xE00, 0)
        machine = booted(memory)
        for order in ("C", "B"):
            assert ordered(machine, order, struct.pack("<2I", 64, 1))[0] == (
                "[MSG:no flash memory with room for firmware answers.]")
    finally:
        machine.library.gk_flash_region(0xE00, 16)


def test_the_journal_and_the_slots_do_not_disturb_each_other(memory):
    machine = booted(memory)
    for number, (order, payload) in enumerate(pieces(FIRST)):
        assert machine.line(f"$405={500 + number}") == ["ok"], "waits to be written"
        assert machine.line(f"$FIRMWARE={order}{model.characters(payload)}", passes=2500) == ["ok"]
    machine = booted(memory)
    assert running(machine)[2] == digest(FIRST)
    assert f"$405={500 + number}" in machine.line("$$", passes=2000)
