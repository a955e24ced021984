# SPDX-License-Identifier: Apache-2.0
"""Firmware of a slot on the whole machine: loader, gateware, flash memory, and the line."""

import io
import struct

import pytest
from rich.console import Console

from host import firmware as command
from host.errors import UserError
from host.link.link import Link
from softcore.flash import SECTOR
from softcore.image import image_digest, target_image
from softcore.soc import MEMORY_SIZE
from softcore.texts import packed
from softcore.top import SIMULATED_JOURNAL as REGION
from testbench.cosim.terminal import Terminal
from testbench.models import firmware_slots as model

LOADED_S = 12       # longest time of the loader at 2 MHz
OLD = target_image(MEMORY_SIZE).read_bytes()


def changed(image, version="0.2"):
    """The firmware with another name, and its digest."""
    old, new = (packed(f"Gapkeeper {one}") for one in ("0.1", version))
    assert image.count(old) == 1
    assert len(old) == len(new)
    body = image[:-4].replace(old, new)
    return body + struct.pack("<I", image_digest(model.words(body)))


NEW = changed(OLD)
BASE = model.words(OLD)[-1]


def memory(*slots):
    """A flash memory with a blank journal and these slots."""
    return b"\xff" * REGION.size + b"".join(slot.ljust(REGION.slot, b"\xff") for slot in slots)


def greeting(session):
    """Lines up to the greeting and for a little longer; and the clocks up to it."""
    said, end = b"", session.cycle + LOADED_S * session.clock_hz
    while b"Grbl" not in said and session.cycle < end:
        said += session.receive(20_000)
    clocks = session.cycle
    said += session.receive(60_000)
    return said.decode().split("\r\n")[:-1], clocks


def asked(session, line):
    """What the controller sends to a line."""
    session.send(line.encode() + b"\n")
    said, end = b"", session.cycle + session.clock_hz
    while not said.endswith(b"ok\r\n") and session.cycle < end:
        said += session.receive(min(20_000, end - session.cycle))
    return said.decode().split("\r\n")[:-1]


def test_the_loader_starts_whole_firmware_which_then_works(on):
    flash = memory(model.slot(NEW, base=BASE))
    session = on(flash)
    said, clocks = greeting(session)
    assert said == ["Grbl 1.1h ['$' for help]"]
    assert clocks < 10 * session.clock_hz
    version, _, told, _ = asked(session, "$I")
    assert version == "[VER:1.1h:Gapkeeper 0.2]"
    there = command.Firmware.of(told)
    assert (there.slot, there.state, there.digest) == (1, "trial", model.words(NEW)[-1])
    assert there.memory == MEMORY_SIZE
    assert session.probe("safety_status_safe"), "locked as always"
    assert asked(session, "$FIRMWARE=K") == ["ok"]
    session.send(b"\x18")
    terminal = Terminal(session)
    for line in ("G91", "G01 Z0.1 F60"):
        terminal.enter(line)
    terminal.run(1)
    assert session.positions()["z"] == session.get("pulses_per_mm") // 10
    terminal.run(2)     # the background check has read the image once
    terminal.watched_well()
    slot = model.read(session.power_off()[REGION.size:])
    assert slot == model.Slot(1, model.words(NEW)[-1], BASE, NEW, True, True)


def test_outputs_are_safe_and_nothing_is_answered_while_the_loader_runs(on):
    session = on(memory(model.slot(NEW, base=BASE)))
    for _ in range(20):
        session.run(session.clock_hz // 20)
        assert session.probe("safety_status_safe")
    assert session.receive(1) == b""


@pytest.mark.soak
def test_a_slot_that_is_damaged_is_not_started(on):
    slot = bytearray(model.slot(NEW, base=BASE))
    slot[SECTOR + 70_001] ^= 4
    session = on(memory(bytes(slot)))
    said, _ = greeting(session)
    assert said == ["Grbl 1.1h ['$' for help]",
                    "[MSG:the firmware in slot 1 is damaged: it is not used.]"]
    assert asked(session, "$I")[0] == "[VER:1.1h:Gapkeeper 0.1]"


@pytest.mark.soak
def test_firmware_that_does_not_answer_is_started_once(on):
    body = struct.pack("<4I", 0x6F, *model.words(OLD)[1:4]) + OLD[16:-4]   # an endless loop
    slot = model.slot(body + struct.pack("<I", image_digest(model.words(body))), base=BASE)
    session = on(memory(slot))
    session.run(LOADED_S * session.clock_hz)
    assert session.receive(100) == b""
    assert session.probe("safety_status_safe")
    flash = session.power_off()
    session = on(flash)
    said, _ = greeting(session)
    assert said[1:] == ["[MSG:the firmware in slot 1 was tried and not confirmed: it is not used.]"]


class Wire:
    """A simulated machine as the port of a host."""

    def __init__(self, session, url="simulated", baud=0):
        self.session, self.url = session, url

    def write(self, data):
        """Send bytes."""
        self.session.send(data)

    def read(self, timeout_s):
        """Bytes that come soon."""
        end = self.session.cycle + max(1, round(timeout_s * self.session.clock_hz))
        came = b""
        while not came and self.session.cycle < end:
            came = self.session.receive(min(4_000, end - self.session.cycle))
        return came

    def time_s(self):
        """Simulated seconds."""
        return self.session.cycle / self.session.clock_hz

    def close(self):
        """Nothing to do."""


def bring(session, monkeypatch, workdir, image=NEW, built_in=False):
    """Call ``gapkeeper firmware``; return what it says."""
    path, said = workdir / "new.bin", io.StringIO()
    path.write_bytes(image)
    monkeypatch.setattr(command, "Port", lambda url, baud: Wire(session))
    command.firmware("simulated", baud=0, file=path, built_in=built_in,
                     console=Console(file=said, width=200))
    return said.getvalue()


@pytest.mark.soak
def test_the_first_pieces_over_the_line_and_a_cut(on):
    """Pieces of the whole firmware, as the host sends them; then the power fails."""
    session = on(memory(model.slot(NEW, base=BASE, tried=True, confirmed=True)))
    greeting(session)
    link = Link(Wire(session), lambda _: None)
    for _, order in zip(range(40), command.orders(changed(OLD, "0.3")), strict=False):
        link.command(order)
    flash = session.power_off()
    at = REGION.size + REGION.slot + SECTOR
    assert flash[at:at + 39 * model.CHUNK] == changed(OLD, "0.3")[:39 * model.CHUNK]
    session = on(flash)
    greeting(session)
    assert asked(session, "$I")[0] == "[VER:1.1h:Gapkeeper 0.2]"


def test_what_the_command_refuses(on, monkeypatch, workdir):
    session = on()
    greeting(session)
    assert "nothing to do" in bring(session, monkeypatch, workdir, OLD)
    for image, says in (
            (b"no", "no firmware of Gapkeeper"),
            (NEW[:8] + bytes(4) + NEW[12:], "made for gateware of edition 00000000"),
            (NEW[:12] + bytes(4) + NEW[16:], "made for a memory of 0 bytes"),
            (NEW + bytes(1 << 19), "has room for 323584")):
        with pytest.raises(UserError, match=says):
            bring(session, monkeypatch, workdir, image)
    assert session.flash.units == 0


@pytest.mark.soak
def test_the_command_from_the_first_line_to_the_kept_firmware_and_back(on, monkeypatch, workdir):
    session = on()
    greeting(session)
    assert "is in the flash memory, whole" in bring(session, monkeypatch, workdir)
    session = on(session.power_off())
    greeting(session)
    assert asked(session, "$I")[0] == "[VER:1.1h:Gapkeeper 0.2]"
    assert "stays from now on" in bring(session, monkeypatch, workdir)
    assert "of its bitstream" in bring(session, monkeypatch, workdir, built_in=True)
    session = on(session.power_off())
    greeting(session)
    assert asked(session, "$I")[0] == "[VER:1.1h:Gapkeeper 0.1]"
