# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper doctor``: whether the controller at a port is well, and its wires are right.

It uses what every controller answers over its link. Outputs act only after a question, and always
with the discharge off: M03 is never sent. However it ends, it resets a controller that it has
unlocked, which disarms the machine; the drives hold on. A lost position is taken over only after a
yes, and stays so, as a reset at rest does not lose it again: the report then says what to do. What
shows only in a discharge is listed in the report as not checked, with the reason (``UNCHECKED``).
"""

import platform
import time
from collections.abc import Callable

from constraints.board import Board
from host.doctor import comparators, guards, identity
from host.doctor.complaints import place, suspects, touched
from host.doctor.examination import CLEAR_MM, Examination, Finding, stopped
from host.doctor.levels import BLOCKING, CLOSED, CODES, FULL, open_guards, resting
from host.errors import UserError
from host.link.link import RESET, HeldError, LinkError
from host.link.port import Port
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run.controller import Controller
from softcore.tables.settings import named

__all__ = ["HOME_FIRST", "UNCHECKED", "Doctor", "Finding"]

VERSION = "Gapkeeper 0.1"   # of the firmware of this checkout, as $I tells it
ASKED = 40                  # lines that try the link
WATCHED_S = 2.0             # rest during which memory and gates must stay silent
STEP_MM = 0.2               # an axis is moved by so much, and back
MOVED_S = 8.0
FIN_S = 130.0               # either edge of FIN may take a minute ($425)
SETTLED_S = 0.5             # for the contactor, and for an alarm at the end of a motion
RESETS = 3                  # a byte may get lost
AXES = "XYZ"
TRIED_S = 0.02              # for the filters of the comparators' levels
BY_HAND_S = 10.0
BY_HAND_MM = 0.01           # a coder that counts so much is sound

HOME_FIRST = ("the lost position was taken over as it stood, and the controller believes it: "
              "home the machine before you cut")
UNCHECKED = (
    ("gap_on, gap_level, gap_supply", "they act in discharges only, and the doctor switches none "
     "on; a gate that is on by itself is noticed at rest"),
    ("gap_noise", "it acts in discharges only; that it is off at rest has been looked at"),
    ("codes of M, S and T functions", "only M09 is sent; a tape tries the others"),
)


class Doctor(Examination):
    """Examines the controller at an open port.

    Parameters
    ----------
    port, board, ask, say
        See ``Examination``.
    machine : Machine, optional
        The machine there. Its settings are entered first: without those of its drives, a sound
        axis may seem to count the wrong way.
    wait_s : float
        How long a person may take to press a button.
    """

    def __init__(self, port: Port, board: Board, *, ask: Callable[[str], bool],
                 say: Callable[[str], None], machine: Machine | None = None,
                 wait_s: float = 60.0) -> None:
        super().__init__(port, board, ask=ask, say=say)
        self.machine, self.wait_s = machine, wait_s
        self._free = False      # the machine is unlocked, and nothing keeps it from moving
        self._changed = False   # unlocked, or with levels that are tried: only a reset ends that
        self._taken = False     # a lost position was taken over
        self._swept = False     # the comparators have been looked at in a motion
        steps = named("step_axes")
        self._steps = int(machine.settings.get(str(steps.number), 0)) if machine else 0

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
                if not self._identify():
                    self.find("wires", None, "not looked at: the gateware is another board's, and "
                              "they would be told with wrong pins")
                    return self.findings
                self._try_link()
                self._settings()
                identity.memory(self)
                sound = self._levels()
                opened = guards.opened(self, self.wait_s)
                self._inputs(unlock=opened)
                self._free = self._free and sound and opened
                self._rest()
                self._button()
                self._motion()
                self._side()
            except HeldError as error:
                self.find("memory", False, f"the processor is held: {error}")
            for what, why in UNCHECKED:
                self.find(what, None, why)
        finally:
            self._end()
        return self.findings

    def report(self) -> str:
        """Everything as a text to send along with a question."""
        lines = ["Gapkeeper doctor", f"board {self.board.name}, port {self.port.url}, "
                 f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
                 "", *map(str, self.findings), "", "What the controller said:",
                 *(f"  {line}" for line in self.said if not line.startswith("[SCOPE"))]
        return "\n".join(lines) + "\n"

    # ---- the checks

    def _identify(self) -> bool:
        """Tell who answers; false if its pins are another board's."""
        who = Controller(self.port, machines.load("sinker"), clock_hz=self.board.clock_hz,
                         say=self.say)
        who.identify(reset=False)
        self.link.await_greeting()
        self.find("link", True, f"the controller answers at {self.port.url}")
        told = self.command("$I")
        version = [line for line in told if line.startswith("[VER:")]
        same = any(VERSION in line for line in version)
        self.find("identity", same, f"{' '.join(version) or 'it tells no version'}"
                   + ("" if same else f"; this checkout is {VERSION}"))
        return identity.gateware(self, identity.firmware(self, told))

    def _try_link(self) -> None:
        old, began = self._counts(), time.monotonic()
        for _ in range(ASKED):
            self.link.command("$G")
        spent, new = time.monotonic() - began, self._counts()
        # Since power-on others may have been damaged: another program's, or while a plug was moved.
        bad = {name: count for name in ("refused", "damaged", "faulty")
               if (count := new.get(name, 0) - old.get(name, 0))}
        counted = bool(old and new)
        self.find("quality of the link", counted and not bad, (
            f"{ASKED} lines answered in {spent:.2f} s, none damaged" if counted and not bad else
            f"damaged: {bad or 'it tells no counts'}; look at the cable and its ground"))

    def _counts(self) -> dict[str, int]:
        """What the controller has counted on its link since power-on."""
        told = next((line for line in self.command("$L") if line.startswith("[LNK:")), "")
        return {name: int(number) for part in told[5:-1].split(",")
                for name, _, number in [part.rpartition(" ")] if number.isdecimal()}

    def _settings(self) -> None:
        """Enter the settings of the machine's file, while the outputs are still safe."""
        if self.machine is None:
            return
        for number, value in self.machine.settings.items():
            said = self.command(f"${number}={value}", refused=True)
            if told := [text for text in said if text.startswith("refused:")]:
                self.find("settings", False, f"machine {self.machine.name}: {told[0]}")
                return
        self.find("settings", True, f"those of the machine {self.machine.name} are entered")

    def _levels(self) -> bool:
        """Look at the inputs at rest, with comparators and converter on; true if axes may move."""
        self._changed = True
        self.command(f"$LEVELS={FULL // 2},{FULL // 2}", refused=True)
        self.listen(TRIED_S)
        inputs = self.inputs()
        self.command("$LEVELS", refused=True)
        if inputs is None:
            self.find("gap at rest", None, "it does not tell its inputs ($INPUTS)")
            return False
        wrong = list(resting(self.board, inputs))
        for check, meaning, places in wrong:
            self.find(check, False, meaning, places)
        if not wrong:
            self.find("gap at rest", True, f"the converter reads {inputs.voltage} of {CODES} for "
                       f"the gap and {inputs.cell} for the fluid's cell; all comparators say: no "
                       "voltage, no current")
        return not any(check in BLOCKING for check, _, _ in wrong)

    def _inputs(self, *, unlock: bool) -> None:
        """Unlock. The controller names one open guard, with its axes; its levels name all.

        After a guard that was found wrong nothing is unlocked, so that no button arms anything.
        """
        self._changed = True
        if (inputs := self.inputs()) is None:
            self.find("inputs", None, "it did not tell its inputs: ask again")
            return
        found_open = {one: meaning for meaning, one in open_guards(self.board, inputs)}
        said = self.command("$X", refused=True) if unlock else []
        told = suspects(self.board, said)
        accused = {wire for one in self.findings if one.ok is False for wire in one.places}
        found = []
        for meaning, places in told:
            if any(one in found_open for one in places):
                if len(places) == 1:    # it may know more: the third drive may be the wire's
                    found_open[places[0]] = meaning
            elif not accused & set(places):     # else a more exact finding names this wire
                found.append((meaning, places))
        found += [(meaning, [one]) for one, meaning in found_open.items()]
        for meaning, places in found:
            self.find("inputs", False, meaning, places)
        locked = any(text.startswith("refused:") for text in said)
        if locked and not told:
            self.find("inputs", False, " ".join(said))
        # On a limit switch it is unlocked. Too little fluid keeps nobody from moving.
        open_pads = {one.wire.partition("[")[0] for _, places in found for one in places}
        self._free = unlock and not locked and open_pads <= {"fluid_low"}
        wrong_pads = {one.wire.partition("[")[0] for one in accused}
        for pad, meaning in CLOSED.items():
            if pad not in open_pads | wrong_pads:
                self.find(pad, True, meaning)

    def _rest(self) -> None:
        """Wait: a gate, a comparator or a memory that is wrong trips the interlock at rest."""
        if not self._free:
            return
        if self._quiet("at rest", self.listen(WATCHED_S)):
            self.find("at rest", True, f"no alarm within {WATCHED_S:g} s; gap_current and "
                       "gap_short show no current with both gates off")

    def _quiet(self, check: str, said: list[str]) -> bool:
        """Whether nothing was said against the machine; else it is a finding, and nothing moves."""
        found = suspects(self.board, said)
        for meaning, places in found:
            self.find(check, False, meaning, places)
        if stopped(said):
            if not found:
                self.find(check, False, " ".join(said))
            self._free = False
        return not found and not stopped(said)

    def _button(self) -> None:
        if not self._free:
            return
        before = len(self.said)
        if not self.board.arm_strapped and "Armed" not in self.link.status():
            self.say('Press the button "arm" at the machine now. The contactor closes; nothing '
                     "discharges.")
        end = self.port.time_s() + self.wait_s
        while "Armed" not in self.link.status():
            if stopped(self.since(before)):
                break
            if self.port.time_s() > end:
                self.find("arm", False, f"no press came within {self.wait_s:g} s: nobody pressed, "
                           "the wire is broken, or the input is closed all the time",
                           [place(self.board, "arm")])
                self._free = False  # without the contactor the sensing source has no supply
                return
            self.listen(0.1)
        else:
            self.find("arm", True, "this board needs no press" if self.board.arm_strapped else
                      "a press came")
        # The contactor gives the power supply its voltage: a gate that is on shows only now.
        self.listen(SETTLED_S)
        if not self._quiet("at rest, armed", self.since(before)):
            return
        self.find("at rest, armed", True, "no alarm after the contactor has closed")
        closed = self.ask("The main contactor should have closed just now, with a click. Has it?")
        self.find("contactor", closed, "it has closed" if closed else
                  "it has not closed, though it is switched on: look at its coil, its supply and "
                  "its wire", [] if closed else [place(self.board, "contactor")])

    def _motion(self) -> None:
        """Move each axis a little, and back: the supervision compares its coder with the drive."""
        for axis, name in enumerate(AXES):
            if not self._free:
                self.find(f"axis {name}", None, "something else must be mended first")
                continue
            lost = ("; for this the lost position is taken over as it stands"
                    if "Lost" in self.link.status() else "")
            if not self.ask(f"Axis {name} moves some times by {STEP_MM:g} mm at most, and back, "
                            f"slowly, with the discharge off{lost}. Is it free to move, and nobody "
                            "near it?"):
                self.find(f"axis {name}", None, "not agreed to")
                continue
            if lost:
                self._taken = True
                if not self._quiet(f"axis {name}", self.command("$POSITION=HERE", refused=True)):
                    continue
            self._move(axis, name)

    def _move(self, axis: int, name: str) -> None:
        """Move an axis there and back; only what both say makes it right."""
        shown = []
        for way in (STEP_MM, -STEP_MM):
            said, moved = self._go(axis, f"G91 G94 G01 {name}{way:g} F60")
            # A gap that reads as a short from the beginning lets no pulse out.
            if abs(moved) > CLEAR_MM and any(map(touched, said)):
                self.find(f"axis {name}", None, f"touched after {abs(moved):.3f} mm: move away by "
                           "hand, then ask again")
                self._free = False
                said = [text for text in said if not touched(text) and "ALARM:" not in text]
                self._quiet(f"axis {name}", said)
                return
            if any("both phases are silent" in text for text in said) and not self._coder_is_silent(
                    axis, name):
                return
            if not self._quiet(f"axis {name}", said):
                return
            if abs(moved - way) > STEP_MM / 4:
                self.find(f"axis {name}", False, f"it was to move by {way:g} mm, and its coder "
                           f"shows {moved:.4f} mm", [place(self.board, "enc_a", axis),
                                                     place(self.board, "enc_b", axis)])
                return
            shown.append(f"{moved:.4f} mm of {way:g} mm")
        if not self._steps >> axis & 1:
            self.find(f"axis {name}", True, f"its coder shows {' and '.join(shown)}")
        elif self.ask(f"The motor of {name} is driven by steps and has no coder. Has it moved "
                      f"{STEP_MM:g} mm and back?"):
            self.find(f"axis {name}", True, "it was seen to move")
        else:
            self.find(f"axis {name}", False, "its steps were sent, and it did not move as it "
                      "should", [place(self.board, pad, axis)
                                 for pad in ("step", "dir", "drive_enable")])
            return
        self._sweep(name)

    def _sweep(self, name: str) -> None:
        """Look at the comparators while an axis moves that is known to move; once."""
        if self._swept:
            return
        self._swept = True
        said, goes_on = comparators.sweep(self, name)
        self._free = self._free and goes_on
        self._quiet("comparators", said)

    def _coder_is_silent(self, axis: int, name: str) -> bool:
        """Tell a coder that is silent from a drive that does not move, which is then a finding."""
        command = [place(self.board, pad, axis) for pad in (
            "drive_enable", "dac", "dac_negative")]
        if not self.ask(f"The coder of axis {name} was silent. The drives are off now. Can you "
                        f"turn the motor of axis {name} by hand?"):
            self._free = False
            self.find(f"axis {name}", False, "its coder was silent, and nobody turned its motor: "
                      "the coder's plug is off, or the drive did not move", [
                          *(place(self.board, pad, axis) for pad in ("enc_a", "enc_b")), *command])
            return False
        self.say(f"Turn it now, within {BY_HAND_S:g} s.")
        start, end = self.places()[axis], self.port.time_s() + BY_HAND_S
        moved = 0.0
        while abs(moved) < BY_HAND_MM and self.port.time_s() < end:
            self.listen(0.1)
            moved = self.places()[axis] - start
        if abs(moved) < BY_HAND_MM:
            return True
        self._free = False
        self.find(f"axis {name}", False, f"its coder was silent in the motion, and counts by hand "
                  f"({moved:.3f} mm): the drive did not move", command)
        return False

    def _side(self) -> None:
        """Send M09 to the machine's side, which answers it by FIN."""
        if not self._free or any(one.check == "fin" for one in self.findings):
            return
        if not self.ask("M09 (fluid off) goes to the machine's side, which has to answer by FIN. "
                        "Is it connected?"):
            self.find("fin answers", None, "not agreed to")
            return
        before = len(self.said)
        self.command("M09", refused=True, within_s=FIN_S)
        self.await_state("Idle", "Alarm", within_s=MOVED_S)
        self.listen(SETTLED_S)
        if stopped(self.since(before)):
            strobe = next(wire for wire in self.board.wires
                          if wire.pad in ("auxiliary_strobe", "chain"))
            bits = range(len(strobe.pins.split())) if strobe.pad == "chain" else [0]
            self.find("fin answers", False, "no FIN after M09: its wire or the strobe's is "
                      "broken, or the machine side does not work", [
                          place(self.board, "fin"),
                          *(place(self.board, strobe.pad, bit) for bit in bits)])
        else:
            self.find("fin answers", True, "M09 was answered by FIN")

    def _go(self, axis: int, line: str) -> tuple[list[str], float]:
        """Send a line that moves an axis; return what was said until rest, and the way in mm."""
        before, start = len(self.said), self.places()[axis]
        self.command(line, refused=True)
        end = self.port.time_s() + MOVED_S
        while not stopped(self.since(before)):
            self.listen(0.2)
            if self.link.status()["state"] == "Idle" or self.port.time_s() > end:
                break
        self.listen(SETTLED_S)
        moved = self.places()[axis] - start
        return self.since(before), moved

    def _end(self) -> None:
        """Reset a machine that may be unlocked: it comes to rest, and its contactor opens."""
        if not self._changed:
            return
        try:
            self._reset()
            self.find("end", True, "the controller is reset: the machine is disarmed; its drives "
                       "may still hold it")
        except HeldError:
            self.find("end", None, "the processor is held, and the outputs are safe until the "
                       "controller is switched off and on")
        except UserError as error:
            self.find("end", False, f"no answer to the reset at the end ({error}) The machine may "
                       "be armed: press the emergency stop")
        if self._taken:
            self.find("position", None, HOME_FIRST)

    def _reset(self) -> None:
        for left in reversed(range(RESETS)):
            self.link.realtime(RESET)
            try:
                return self.link.await_greeting()
            except HeldError:
                raise
            except LinkError:
                if not left:
                    raise
        return None
