# SPDX-License-Identifier: Apache-2.0
"""What can go wrong: the only place the number of an alarm or error is written down.

Where grbl 1.1 has an error or an alarm of the same meaning, its number is told; ours begin at
``FIRST``.

``python -m softcore.generate`` makes the firmware's codes and sentences (``base/fault_codes.h``)
and the page ``docs/reference/alarms.md`` of it; the host reads it. Plain data: imports nothing from
Amaranth.

Ref: the lists of errors and alarms in the documentation of grbl 1.1 (``doc/csv``).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

__all__ = ["FAULTS", "FIRST", "PARTS", "Fault", "alarm_line", "alarm_number", "error_line", "named",
           "of_alarm", "of_error"]

FIRST = 100

# Where a fault comes from. The tape's, the block's and the program's are the program's fault:
# before anything has moved, the run is rejected.
PARTS = {
    "tape": "Tape",
    "link": "Link",
    "block": "Words of a block",
    "program": "Program",
    "machine": "Machine",
}
Part = Literal["tape", "link", "block", "program", "machine"]


@dataclass(frozen=True, kw_only=True)
class Fault:
    """An alarm (``ALARM:N``) or the refusal of a line (``error:N``).

    ``number`` is our own. N is that of grbl where grbl has the same: ``grbl_error`` for a line,
    ``grbl_alarm`` for an alarm, 0 where it has none. Several of ours may be one error of grbl; an
    alarm's number is its own. ``sentence`` says what is wrong, without capital and full stop. The
    firmware says more: where, and what exactly; it has the sentence as it stands if ``spoken``.
    ``cause`` and ``remedy`` are for the person at the machine, in whole sentences; ``{name}`` is
    the number of a setting.
    """

    number: int
    name: str
    part: Part
    sentence: str
    cause: str
    remedy: str
    spoken: bool = False
    grbl_error: int = 0
    grbl_alarm: int = 0

    @property
    def error(self) -> int:
        """Number of the refusal of a line: ``error:N``."""
        return self.grbl_error or self.number

    @property
    def alarm(self) -> int:
        """Number of the alarm: ``ALARM:N``, and ``code`` of the event."""
        return self.grbl_alarm or self.number

    @property
    def of_machine(self) -> bool:
        """Whether the machine is at fault, and not the program."""
        return self.part == "machine"


def _fault(number: int, name: str, part: Part, sentence: str, cause: str, remedy: str, *,
           spoken: bool = False, error: int = 0, alarm: int = 0) -> Fault:
    """Fault; ``error`` and ``alarm`` are the numbers of grbl."""
    return Fault(number=number, name=name, part=part, sentence=sentence, cause=cause,
                 remedy=remedy, spoken=spoken, grbl_error=error, grbl_alarm=alarm)


READ_AGAIN = "Clean the tape and the reader and read it again; if it comes back, punch a new tape."
CORRECT = "Correct the block that is named."

FAULTS: tuple[Fault, ...] = (
    _fault(101, "no_start", "tape", "no start code before the data",
           "The tape does not begin with `%` or ER and an end of block.",
           "Put the tape in the right way round, with its leader first."),
    _fault(102, "parity", "tape", "parity error (TH)",
           "A row of holes has an even count in EIA, or an odd one in ISO: it was read or punched "
           "wrong.", READ_AGAIN),
    _fault(103, "blank", "tape", "blank tape inside the program",
           "A row without holes stands inside the data of an EIA tape.", READ_AGAIN),
    _fault(104, "code", "tape", "a row of holes that is no character of the code",
           "A row has a pattern that ISO or EIA does not know.", READ_AGAIN),
    _fault(105, "tv", "tape", "odd number of characters in a block (TV)",
           "TV is checked, and a character of the block was lost or doubled; or the tape was made "
           "without TV.", "Read the tape again. Switch the check off (`${tv}=0`) for a tape made "
           "without it."),
    _fault(106, "too_long", "tape", "too many characters in a block or a line",
           "A block has more than 256 characters, or a line more than the controller takes.",
           "Divide the block, or shorten its comment.", error=11),
    _fault(107, "no_end", "tape", "the tape ends before the end word (M02 or M30)",
           "The program has no M02 or M30, or the tape is torn or was cut short.",
           "End the program with M02 or M30, and read the whole tape."),
    _fault(108, "line", "link", "a line arrived damaged, out of sequence or without room",
           "The line to the controller is noisy, or lines were sent faster than they were "
           "answered. A line without a check is refused, too, once lines with one have come.",
           "Nothing was done: send the line again. If it comes often, look at cable and earth."),
    _fault(110, "character", "block", "a character out of place",
           "The block has a character that no word has there.", CORRECT, error=1),
    _fault(111, "number", "block", "a number is missing or malformed",
           "A letter has no number behind it, or one that is not formed as it must be.", CORRECT,
           error=2),
    _fault(112, "overflow", "block", "a number is too long or out of range",
           "The number has too many digits, or the controller cannot express it.", CORRECT),
    _fault(113, "duplicate", "block", "a word stands twice in a block",
           "The same letter, or the same G or M code, is given twice.",
           "Take one of them away, or divide the block.", error=25),
    _fault(114, "conflict", "block", "words that exclude each other",
           "Two words of the block ask for different things, or one cannot be changed now.",
           "Divide the block, or take away the word that is named."),
    _fault(115, "unknown", "block", "a word or code that does not exist here",
           "The controller does not have this letter, G code or M code.",
           "Use what the page [words](programs.md) lists.", error=20),
    _fault(116, "comment", "block", "a comment is not closed",
           "A `(` has no `)` in the same block.", "Close the comment."),
    _fault(117, "place", "block", "a word without meaning in this block",
           "The word belongs to another kind of block.", "Take the word away, or give it a block "
           "of its own.", error=36),
    _fault(118, "missing", "block", "a word is missing in this block",
           "A code of the block needs a word that is not there.", "Add the word that is named.",
           error=28),
    _fault(119, "refused", "block", "known, but not in this version",
           "The code or the command exists in its standard; this controller does not have it, or "
           "not here.", "Do what you want in another way.", error=20),
    _fault(120, "arc", "block", "no circle fits what is said of the arc",
           "Start, end and centre or radius do not belong to one circle, or it is too large or too "
           "small.", "Check X, Y, Z, I, J, K and R, and whether G90 or G91 is in force. "
           "`${arc_difference_nm}` is how far the radii at start and end may differ.", error=33),
    _fault(121, "corner", "block", "the wire offset does not fit the path",
           "The path has a corner, an arc or a gap that is smaller than the wire offset.",
           "Use a smaller offset (D), or change the path where the sentence says."),
    _fault(122, "modal", "block", "two codes of one group",
           "Two G codes or two M codes of the block set the same thing.",
           "Take one of them away, or divide the block.", error=21),
    _fault(123, "command", "block", "a line with $ that is unknown or not in this version",
           "The controller does not have this command.",
           "Use what the page [link](link.md) lists.", error=3),
    _fault(124, "homing", "block", "homing is off: there is none in this version",
           "`$H` asks for a homing cycle. The controller has none.",
           "Move to the mark, then send `$POSITION=HERE`.", error=5),
    _fault(130, "feed", "program", "the feed is missing, zero or too high",
           "G01, G02 or G03 has no feed F, or F is above the highest speed.",
           "Give F, up to `${highest_speed_mm_min}` mm/min.", error=22),
    _fault(131, "mode", "program", "X, Y or Z without G00, G01, G02 or G03",
           "No kind of motion is in force yet; or the servo (G95) would move without M03.",
           "Write the G code in the block, or M03 before it.", error=31),
    _fault(132, "retraction", "program", "the retraction data are invalid or incomplete",
           "An item of G36 is zero, too high or missing, or Q is above L; or a code needs G36 "
           "before it.", "Correct the G36, or enter one by hand before the tape."),
    _fault(133, "condition", "program", "the machining condition is unknown, missing or unfit",
           "C names a condition that is not there, M03 has none, the power supply cannot give its "
           "current, its pulses are too short to be looked at, or a series (G39) has no room.",
           "Use a built-in condition, or enter one with G10; then give C before M03."),
    _fault(134, "travel", "program", "the target is beyond the travel",
           "The block would lead an axis past its soft limit, or further onto its limit switch.",
           "Check zero (G92, G54 to G59) and the block. The soft limits are `${low_x_um}` to "
           "`${high_z_um}` and `${soft_limit_um}`.", alarm=2),
    _fault(135, "history", "program", "the path remembered does not cover the retractable limit",
           "So many short blocks fit into L that the controller cannot remember all of them.",
           "Use a smaller L in G36, or longer blocks."),
    _fault(136, "setting", "program", "a setting does not exist or is out of range",
           "The number of the setting is wrong, or its value is not within its range.",
           "Look it up in [settings](settings.md), or send `$$`.", error=3),
    _fault(137, "locked", "program", "the machine is locked",
           "An alarm or power-on has locked it; or it still comes to rest, or stands on a limit "
           "switch.", "Remove what caused it, wait until the machine is at rest, and send `$X`.",
           error=9),
    _fault(138, "busy", "program", "not now: a program runs, or the machine moves or machines",
           "The line would change something that must stay as it is meanwhile.",
           "Wait for the end of the program; for a setting that guards the machine, M05 and rest "
           "come first.", error=8),
    _fault(139, "table", "program", "a row of a table is invalid",
           "A row of G10, or basic data for planning, has a value that cannot be.",
           "Correct the value that is named."),
    _fault(140, "trip", "machine", "the interlock has tripped",
           "A guard has made the outputs safe: the sentence says which, such as the emergency "
           "stop, a limit switch, a drive, a coder or the watchdog.",
           "Remove the cause, then send `$X`. If the position is lost, check where the axes stand "
           "and send `$POSITION=HERE`. Press ARM before you machine."),
    _fault(157, "limit", "machine", "an axis is on its limit switch",
           "The interlock has tripped: an axis has pressed a limit switch, or its wire is broken.",
           "Send `$X`, and move slowly away from the switch. Check zero and soft limits.", alarm=1),
    _fault(141, "halt_limit", "machine", "still short at the retractable limit",
           "The electrode went back by L and still touches: debris, a bent wire or electrode, or "
           "an L that is too "
           "small.", "Send `$X`, then move the electrode away. Clean the gap, look at the "
           "flushing, and start again; or allow a larger L in G36.", spoken=True),
    _fault(142, "halt_back_limit", "machine",
           "still short where the way back ends (ceiling, soft limit or start of the path)",
           "The electrode could not go back further, and still touches.",
           "Send `$X`, then move the electrode away. Clean the gap. Look at Z of G36 and at the "
           "soft limits.", spoken=True),
    _fault(143, "halt_burst", "machine", "too many shorts in series without new depth",
           "The gap shorts again and again at the same place: debris that the flushing does not "
           "carry away, or a discharge that is too strong for the gap.",
           "Send `$X`, move the electrode away and clean the gap. Improve the flushing, add jumps "
           "(G38), or take a weaker condition. `${repeats}` is the number of shorts.", spoken=True),
    _fault(144, "halt_no_data", "machine", "short without retraction data (G36)",
           "The gap is shorted, and nobody has said how far and how fast to go back.",
           "Send `$X`, move the electrode away, and enter a G36 by hand or put one into the "
           "program.", spoken=True),
    _fault(145, "fin", "machine", "the machine side did not answer",
           "An M, S or T code was sent to the machine side, and FIN did not come in time.",
           "Look at the machine side: pump, tool, relay, cable. `${fin_ms}` is the longest wait in "
           "ms. Send `$X` and start again."),
    _fault(146, "events", "machine", "events of the gateware were lost",
           "More happened than the firmware could take. This should never be.",
           "Send `$X` and start again. Report it with the tape and `events.jsonl`.", spoken=True),
    _fault(147, "reset", "machine", "reset by the operator during motion",
           "Ctrl-X came while a tape ran or an axis moved. In `Hold:0` it is no alarm, unless a "
           "tape runs.",
           "Send `$X`, press ARM, and start the program again.", spoken=True, alarm=3),
    _fault(148, "halt_servo", "machine", "the servo would go back beyond the retractable limit or "
           "the ceiling or the soft limit",
           "The gap stayed too narrow, and the servo has drawn the electrode back as far as it "
           "may.",
           "Send `$X`. Clean the gap and look at the flushing; check presets and references of the "
           "condition; or allow a larger L in G36.", spoken=True),
    _fault(149, "fluid", "machine", "the fluid's resistance is not known",
           "The cell in the fluid is shorted or broken, its converter does not answer, or the "
           "thresholds of the classes are out of order.",
           "Look at the cell and its wires; check `${fluid_threshold_0}` to "
           "`${fluid_threshold_2}`. With `${fluid_mode}=0` the class is yours to choose "
           "(`${fluid_class}`)."),
    _fault(150, "no_discharge", "machine", "a long way without a discharge",
           "Under servo the electrode went forward, and nothing burned: no voltage at the gap, a "
           "wrong zero, or no workpiece.",
           "Check cables and power supply, fluid, zero and workpiece. `${no_discharge_um}` is the "
           "way in µm."),
    _fault(151, "no_progress", "machine", "a long time without new depth",
           "The machine machines at one place and does not come further: presets that never ask "
           "for a step, or a large electrode with little current.",
           "Check presets and references of the condition. If the job is just slow, raise "
           "`${no_progress_s}` (s)."),
    _fault(152, "contact", "machine",
           "contact with the discharge off; only a move away from the work goes on from here",
           "The electrode or wire touched the work while it moved without discharge.",
           "Send `$X`, and move away from the work, the way it came. Then check zero and program.",
           spoken=True),
    _fault(153, "not_armed", "machine", "the discharge is not armed: press the button ARM at the "
           "machine",
           "After power-on, an alarm, a trip or a reset the discharge is not allowed until someone "
           "at the machine says so.", "See that nobody is in danger, press ARM, and start again.",
           spoken=True),
    _fault(154, "position_lost", "machine",
           "the position is lost; $POSITION=HERE takes what is counted for true",
           "After power-on, and after some trips, the counted position may differ from where the "
           "axes truly are.", "Measure or find the reference again. Then send `$POSITION=HERE`, "
           "and set zero anew if it has moved.", spoken=True),
    _fault(155, "guard", "machine", "the controller has found itself damaged",
           "The axes are not where the path has led them, or the gateware has stopped the "
           "processor: its memory read wrong, or it did not answer.",
           "If the sentence names the memory or the watchdog, switch the controller off and on. "
           "Else send `$X`, check where the axes stand, and send `$POSITION=HERE`. If it comes "
           "back, do not use the controller."),
    _fault(156, "stuck", "machine", "nothing moves, although the path goes on",
           "Motion is wanted, and no pulse comes. This should never be.",
           "Send `$X` and start again. If it comes back, report it with the tape and "
           "`events.jsonl`.", spoken=True),
)


def named(name: str, table: Iterable[Fault] = FAULTS) -> Fault:
    """Fault of a name. ``KeyError`` if there is none."""
    for fault in table:
        if fault.name == name:
            return fault
    raise KeyError(name)


def of_alarm(number: int, table: Iterable[Fault] = FAULTS) -> Fault | None:
    """Fault of the number of an alarm, or None."""
    return next((fault for fault in table if fault.alarm == number), None)


def of_error(number: int, table: Iterable[Fault] = FAULTS) -> Fault | None:
    """Fault of the number of an error, or None; of several the first."""
    return next((fault for fault in table if fault.error == number), None)


def alarm_number(name: str) -> int:
    """Number of the alarm of a name. ``KeyError`` if there is none."""
    return named(name).alarm


def alarm_line(name: str) -> str:
    """Line by which the controller tells the alarm of a name. ``KeyError`` if there is none."""
    return f"ALARM:{alarm_number(name)}"


def error_line(name: str) -> str:
    """Line by which it refuses one for the fault of a name. ``KeyError`` if there is none."""
    return f"error:{named(name).error}"
