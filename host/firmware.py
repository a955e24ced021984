# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper firmware``: this checkout's firmware into a controller, over its link.

The bitstream stays. The controller keeps the firmware in its flash memory and starts it at the next
power-on (``softcore/firmware/store/slots.h``).
"""

import struct
from binascii import b2a_base64
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from host.errors import UserError
from host.link.link import Link
from host.link.port import Port
from host.machines import machine as machines
from host.run.controller import Controller

__all__ = ["CHUNK", "Firmware", "built", "characters", "firmware", "orders"]

CHUNK = 128             # bytes of a line
READ_BACK_S = 60.0      # for the last line's answer: the image is read back before it
IMAGE_MARK = 0x49464B47     # word 1 of an image: GKFI
REST = {"Idle", "Alarm"}
BASE64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
# The link's 64 characters; none of them is a real-time byte.
SENT = "".join(map(chr, range(0x40, 0x7E))) + "=>"


@dataclass(frozen=True)
class Firmware:
    """What a controller tells of its firmware and its room for other.

    ``slot`` is 0 for the firmware of the bitstream. ``state`` is ``built-in``, ``trial`` or
    ``kept``. ``memory`` and ``room`` are in bytes.
    """

    slot: int
    state: str
    digest: int
    edition: int
    memory: int
    room: int

    @classmethod
    def of(cls, line: str) -> "Firmware":
        """What a line ``[FIRMWARE:…]`` says."""
        slot, state, *numbers = line.removeprefix("[FIRMWARE:").removesuffix("]").split(",")
        return cls(int(slot), state, *map(int, numbers))

    @property
    def name(self) -> str:
        """Its digest and where it comes from, for a person."""
        where = "of the bitstream" if not self.slot else f"in slot {self.slot}"
        return f"{self.digest:08x} ({where}{', on trial' if self.state == 'trial' else ''})"


def characters(data: bytes) -> str:
    """Bytes as they are sent in a line: 6 bits in each character."""
    coded = b2a_base64(data, newline=False).decode("ascii").rstrip("=")
    return coded.translate(str.maketrans(BASE64, SENT))


def orders(image: bytes) -> Iterator[str]:
    """Yield the lines by which an image gets into a slot."""
    length, digest = len(image), image[-4:]
    yield "$FIRMWARE=B" + characters(struct.pack("<I", length) + digest)
    for at in range(0, length, CHUNK):
        yield "$FIRMWARE=D" + characters(struct.pack("<I", at) + image[at:at + CHUNK])
    yield "$FIRMWARE=E"


def built(memory: int, say: Callable[[str], None]) -> bytes:
    """The checkout's firmware, compiled for a memory of so many bytes.

    Raises
    ------
    UserError
        If it does not compile, or does not fit.
    """
    from softcore.image import FirmwareError, target_image
    try:
        return target_image(memory, say).read_bytes()
    except FirmwareError as error:
        raise UserError("this checkout's firmware does not compile, or does not fit the "
                        f"controller's memory of {memory} bytes: {str(error).splitlines()[-1]}"
                        ) from error


def _check(image: bytes, there: Firmware) -> None:
    """Check that an image is one for this controller.

    Raises
    ------
    UserError
        If it is not.
    """
    _, mark, edition, memory = struct.unpack("<4I", image[:16].ljust(16, b"\0"))
    if mark != IMAGE_MARK or len(image) % 4:
        raise UserError("this is no firmware of Gapkeeper.")
    if not there.room:
        raise UserError("the controller has no flash memory with room for firmware: load a "
                        "bitstream (gapkeeper build, gapkeeper flash).")
    if edition != there.edition:
        raise UserError(f"the firmware is made for gateware of edition {edition:08x}, and the "
                        f"controller's is {there.edition:08x}: load a bitstream of the same "
                        "checkout (gapkeeper build, gapkeeper flash).")
    if memory != there.memory:
        raise UserError(f"the firmware is made for a memory of {memory} bytes, and the controller "
                        f"has {there.memory}.")
    if len(image) > there.room:
        raise UserError(f"the firmware has {len(image)} bytes, and the controller has room for "
                        f"{there.room}.")


def firmware(url: str, *, baud: int, file: Path | None, built_in: bool, console: Console) -> None:
    """Bring a controller to this checkout's firmware, or to that of ``file``; see the module.

    A controller that runs it on trial keeps it. ``built_in``: back to that of the bitstream.

    Raises
    ------
    UserError
        If nobody answers at the port, the controller is at work or refuses it, or the firmware is
        not for this controller.
    """
    said: list[str] = []
    machine = machines.load("sinker")   # its clock is of no account here

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    port = Port(url, baud)
    try:
        Controller(port, machine, clock_hz=machine.clock_hz, say=say).identify(reset=False)
        link = Link(port, said.append)
        link.await_greeting()
        there = _asked(link, said)
        say(f"The controller at {url} runs firmware {there.name}.")
        if built_in:
            link.command("$FIRMWARE=C")
            say("Switch it off and on: it then runs the firmware of its bitstream.")
            return
        image = file.read_bytes() if file else built(there.memory, say)
        _check(image, there)
        digest = int.from_bytes(image[-4:], "little")
        if digest == there.digest:
            if there.state == "trial":
                link.command("$FIRMWARE=K")
                say("It stays from now on.")
            else:
                say("That is the same as here: nothing to do.")
            return
        with Progress(console=console) as bar:
            *pieces, end = orders(image)
            for line in bar.track(pieces, description=f"firmware {digest:08x}"):
                link.command(line)
        link.command(end, within_s=READ_BACK_S)
    finally:
        port.close()
    say(f"Firmware {digest:08x} is in the flash memory, whole. Switch the controller off and on: "
        "it runs on trial then. Call the same command again, and it stays; without that, the next "
        "power-on brings the present one back.")


def _asked(link: Link, said: list[str]) -> Firmware:
    state = link.status()["state"]
    if state not in REST:
        raise UserError(f"the controller is at work ({state}): firmware is replaced at rest.")
    said.clear()
    link.command("$I")
    told = next((line for line in said if line.startswith("[FIRMWARE:")), None)
    if told is None:
        raise UserError("the controller's firmware cannot be replaced over the link: load a "
                        "bitstream (gapkeeper build, gapkeeper flash).")
    return Firmware.of(told)
