# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper doctor``: whether the controller at a port is well, and its wires are right.

It uses what every controller answers over its link. Outputs act only after a question, and always
with the discharge off: M03 is never sent. However it ends, it resets a controller that it has
unlocked, which disarms the machine; the drives hold on. A lost position is taken over only after a
yes, and stays so, as a reset at rest does not lose it again: the report then says what to do. What
the present firmware cannot tell is listed in the report as not checked, with the reason
(``UNCHECKED``).
"""

import platform
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from constraints.board import Board
from host.doctor.complaints import Place, place, suspects, touched
from host.errors import UserError
from host.link.link import RESET, HeldError, Link, LinkError, RefusedError
from host.link.port import Port
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run.controller import Controller

__all__ = ["HOME_FIRST", "UNCHECKED", "Doctor", "Finding"]

VERSION = "Gapkeeper 0.1"   # of the firmware of this checkout, as $I tells it
ASKED = 40                  # lines that try the link
WATCHED_S = 2.0             # rest during which memory and gates must stay silent
STEP_MM = 0.2               # an axis is moved by so much, and back
CLEAR_MM = STEP_MM / 100    # an axis that came so far had an open gap before it touched
MOVED_S = 8.0
SETTLED_S = 0.5             # for the contactor, and for an alarm at the end of a motion
RESETS = 3                  # a byte may get lost
AXES = "XYZ"

HOME_FIRST = ("the lost position was taken over as it stood, and the controller believes it: "
              "home the machine before you cut")
UNCHECKED = (
    ("digests of gateware and firmware", "the controller tells its version only; `$I` needs a "
     "further line with the register `build` and the image's digest"),
    ("clock", "no line tells the controller's clock at rest"),
    ("full memory test", "the parity of each word is checked when it is read, and the image's "
     "digest by the firmware; a test of all words needs new firmware"),
    ("fluid_low, fin", "they act only while the machine discharges or an M, S or T function runs"),
    ("converter (adc_*), gap_reference, gap_high, gap_arc, gap_noise", "no line tells the "
     "converter's reading or a comparator's level, and none sweeps a reference"),
    ("contactor, gap_on, gap_level, gap_supply, auxiliary outputs", "no line switches one of them "
     "alone with the discharge off"),
)


@dataclass
class Finding:
    """The outcome of a check: ``ok`` is None if it was left out."""

    check: str
    ok: bool | None
    said: str
    places: list[Place] = field(default_factory=list)

    def __str__(self) -> str:
        mark = {True: "ok", False: "WRONG", None: "left out"}[self.ok]
        where = "; look at " + ", ".join(map(str, self.places)) if self.places else ""
        return f"{mark:8} {self.check}: {self.said}{where}"


def stopped(said: list[str]) -> bool:
    """Whether the controller raised an alarm or refused a line."""
    return any("ALARM:" in text or text.startswith("refused:") for text in said)


class Doctor:
    """Examines the controller at an open port.

    Parameters
    ----------
    port : Port
        The line to it. The caller closes it.
    board : Board
        The board, by which wires have pins.
    ask : callable
        Asks a person a question; true is yes.
    say : callable
        Gets each finding as it is made, and what a person has to do.
    machine : Machine, optional
        The machine there. Its settings are entered first: without those of its drives, a sound
        axis may seem to count the wrong way.
    wait_s : float
        How long a person may take to press a button.
    """

    def __init__(self, port: Port, board: Board, *, ask: Callable[[str], bool],
                 say: Callable[[str], None], machine: Machine | None = None,
                 wait_s: float = 60.0) -> None:
        self.port, self.board, self.ask, self.say, self.wait_s = port, board, ask, say, wait_s
        self.machine = machine
        self.findings: list[Finding] = []
        self._said: list[str] = []
        self._link = Link(port, self._said.append)
        self._free = False      # the machine is unlocked, and nothing keeps it from moving
        self._unlocks = False   # it may be unlocked: only a reset makes sure that it is not
        self._taken = False     # a lost position was taken over

    def examine(self) -> list[Finding]:
        """Make all checks; return what was found.

        Whatever ends it, a machine that it has unlocked is disarmed: its contactor is open.

        Raises
        ------
        LinkError
            If nobody answers, or it is not Gapkeeper, or it is at work.
        """
        try:
            try:
                self._identify()
                self._try_link()
                self._settings()
                self._inputs()
                self._rest()
                self._button()
                self._motion()
            except HeldError as error:
                self._find("memory", False, f"the processor is held: {error}")
            for what, why in UNCHECKED:
                self._find(what, None, why)
        finally:
            self._end()
        return self.findings

    def report(self) -> str:
        """Everything as a text to send along with a question."""
        lines = ["Gapkeeper doctor", f"board {self.board.name}, port {self.port.url}, "
                 f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
                 "", *map(str, self.findings), "", "What the controller said:",
                 *(f"  {line}" for line in self._said)]
        return "\n".join(lines) + "\n"

    # ---- the checks

    def _identify(self) -> None:
        who = Controller(self.port, machines.load("sinker"), clock_hz=self.board.clock_hz,
                         say=self.say)
        who.identify(reset=False)
        self._link.await_greeting()
        self._find("link", True, f"the controller answers at {self.port.url}")
        told = [line for line in self._command("$I") if line.startswith("[VER:")]
        same = any(VERSION in line for line in told)
        self._find("identity", same, f"{' '.join(told) or 'it tells no version'}"
                   + ("" if same else f"; this checkout is {VERSION}"))

    def _try_link(self) -> None:
        old, began = self._counts(), time.monotonic()
        for _ in range(ASKED):
            self._link.command("$G")
        spent, new = time.monotonic() - began, self._counts()
        # Since power-on others may have been damaged: another program's, or while a plug was moved.
        bad = {name: count for name in ("refused", "damaged", "faulty")
               if (count := new.get(name, 0) - old.get(name, 0))}
        counted = bool(old and new)
        self._find("quality of the link", counted and not bad, (
            f"{ASKED} lines answered in {spent:.2f} s, none damaged" if counted and not bad else
            f"damaged: {bad or 'it tells no counts'}; look at the cable and its ground"))

    def _counts(self) -> dict[str, int]:
        """What the controller has counted on its link since power-on."""
        told = next((line for line in self._command("$L") if line.startswith("[LNK:")), "")
        return {name: int(number) for part in told[5:-1].split(",")
                for name, _, number in [part.rpartition(" ")] if number.isdecimal()}

    def _settings(self) -> None:
        """Enter the settings of the machine's file, while the outputs are still safe."""
        if self.machine is None:
            return
        for number, value in self.machine.settings.items():
            said = self._command(f"${number}={value}", refused=True)
            if told := [text for text in said if text.startswith("refused:")]:
                self._find("settings", False, f"machine {self.machine.name}: {told[0]}")
                return
        self._find("settings", True, f"those of the machine {self.machine.name} are entered")

    def _inputs(self) -> None:
        """Unlock: the controller names each guard that is open, with the axes it belongs to."""
        self._unlocks = True
        said = self._command("$X", refused=True)
        found = suspects(self.board, said)
        for meaning, places in found:
            self._find("inputs", False, meaning, places)
        locked = any(text.startswith("refused:") for text in said)
        self._free = not locked and not found   # on a limit switch it is unlocked
        if locked and not found:
            self._find("inputs", False, " ".join(said))
        open_pads = {one.wire.partition("[")[0] for _, places in found for one in places}
        if locked:
            self._find("other inputs", None, "the controller names the first open guard only: mend "
                       "it and start the doctor again")
            return
        for pad, meaning in (("estop", "closed: no emergency stop"),
                             ("drive_fault", "closed: no drive reports a fault"),
                             ("limit_low", "closed: no axis is on its lower limit switch"),
                             ("limit_high", "closed: no axis is on its upper limit switch")):
            if pad not in open_pads:
                self._find(pad, True, meaning)

    def _rest(self) -> None:
        """Wait: a gate, a comparator or a memory that is wrong trips the interlock at rest."""
        if not self._free:
            return
        if self._quiet("at rest", self._listen(WATCHED_S)):
            self._find("at rest", True, f"no alarm within {WATCHED_S:g} s; gap_current and "
                       "gap_short show no current with both gates off")

    def _quiet(self, check: str, said: list[str]) -> bool:
        """Whether nothing was said against the machine; else it is a finding, and nothing moves."""
        found = suspects(self.board, said)
        for meaning, places in found:
            self._find(check, False, meaning, places)
        if stopped(said):
            if not found:
                self._find(check, False, " ".join(said))
            self._free = False
        return not found and not stopped(said)

    def _button(self) -> None:
        if not self._free:
            return
        before = len(self._said)
        if "Armed" not in self._link.status():
            self.say('Press the button "arm" at the machine now. The contactor closes; nothing '
                     "discharges.")
        end = self.port.time_s() + self.wait_s
        while "Armed" not in self._link.status():
            if stopped(self._since(before)):
                break
            if self.port.time_s() > end:
                self._find("arm", False, f"no press came within {self.wait_s:g} s: nobody pressed, "
                           "the wire is broken, or the input is closed all the time",
                           [place(self.board, "arm")])
                self._free = False  # without the contactor the sensing source has no supply
                return
            self._listen(0.1)
        else:
            self._find("arm", True, "a press came")
        # The contactor gives the power supply its voltage: a gate that is on shows only now.
        self._listen(SETTLED_S)
        if self._quiet("at rest, armed", self._since(before)):
            self._find("at rest, armed", True, "no alarm after the contactor has closed")

    def _motion(self) -> None:
        """Move each axis a little, and back: the supervision compares its coder with the drive."""
        for axis, name in enumerate(AXES):
            if not self._free:
                self._find(f"axis {name}", None, "something else must be mended first")
                continue
            lost = ("; for this the lost position is taken over as it stands"
                    if "Lost" in self._link.status() else "")
            if not self.ask(f"Axis {name} moves by {STEP_MM:g} mm, slowly, with the discharge off"
                            f"{lost}. Is it free to move, and nobody near it?"):
                self._find(f"axis {name}", None, "not agreed to")
                continue
            if lost:
                self._taken = True
                if not self._quiet(f"axis {name}", self._command("$POSITION=HERE", refused=True)):
                    continue
            self._move(axis, name)

    def _move(self, axis: int, name: str) -> None:
        """Move an axis there and back; only what both say makes it right."""
        shown = []
        for way in (STEP_MM, -STEP_MM):
            said, moved = self._go(axis, f"G91 G94 G01 {name}{way:g} F60")
            # A gap that reads as a short from the beginning lets no pulse out.
            if abs(moved) > CLEAR_MM and any(map(touched, said)):
                self._find(f"axis {name}", None, f"touched after {abs(moved):.3f} mm: move away by "
                           "hand, then ask again")
                self._free = False
                said = [text for text in said if not touched(text) and "ALARM:" not in text]
                self._quiet(f"axis {name}", said)
                return
            if not self._quiet(f"axis {name}", said):
                return
            if abs(moved - way) > STEP_MM / 4:
                self._find(f"axis {name}", False, f"it was to move by {way:g} mm, and its coder "
                           f"shows {moved:.4f} mm", [place(self.board, "enc_a", axis),
                                                     place(self.board, "enc_b", axis)])
                return
            shown.append(f"{moved:.4f} mm of {way:g} mm")
        self._find(f"axis {name}", True, f"its coder shows {' and '.join(shown)}")

    def _go(self, axis: int, line: str) -> tuple[list[str], float]:
        """Send a line that moves an axis; return what was said until rest, and the way in mm."""
        before, start = len(self._said), self._places()[axis]
        self._command(line, refused=True)
        end = self.port.time_s() + MOVED_S
        while not stopped(self._since(before)):
            self._listen(0.2)
            if self._link.status()["state"] == "Idle" or self.port.time_s() > end:
                break
        self._listen(SETTLED_S)
        moved = self._places()[axis] - start
        return self._since(before), moved

    def _end(self) -> None:
        """Reset a machine that may be unlocked: it comes to rest, and its contactor opens."""
        if not self._unlocks:
            return
        try:
            self._reset()
            self._find("end", True, "the controller is reset: the machine is disarmed; its drives "
                       "may still hold it")
        except HeldError:
            self._find("end", None, "the processor is held, and the outputs are safe until the "
                       "controller is switched off and on")
        except UserError as error:
            self._find("end", False, f"no answer to the reset at the end ({error}) The machine may "
                       "be armed: press the emergency stop")
        if self._taken:
            self._find("position", None, HOME_FIRST)

    def _reset(self) -> None:
        for left in reversed(range(RESETS)):
            self._link.realtime(RESET)
            try:
                return self._link.await_greeting()
            except HeldError:
                raise
            except LinkError:
                if not left:
                    raise
        return None

    # ---- the link

    def _command(self, line: str, *, refused: bool = False) -> list[str]:
        """Send a line; return what was said until its answer, and a refusal as ``refused: …``."""
        before = len(self._said)
        try:
            self._link.command(line)
        except RefusedError as error:
            if not refused:
                raise
            self._said.append(f"refused: {error}")
        self._listen(0.1)
        return self._said[before:]

    def _listen(self, seconds: float) -> list[str]:
        before, end = len(self._said), self.port.time_s() + seconds
        while self.port.time_s() < end:
            self._link.poll(0.05)
        return self._said[before:]

    def _since(self, before: int) -> list[str]:
        """What was said since there were so many lines, less the status reports."""
        return [text for text in self._said[before:] if not text.startswith("<")]

    def _places(self) -> list[float]:
        return [float(one) for one in self._link.status()["MPos"].split(",")]

    def _find(self, check: str, ok: bool | None, said: str,
              places: list[Place] | None = None) -> None:
        self.findings.append(Finding(check, ok, said, places or []))
        self.say(str(self.findings[-1]))
