# SPDX-License-Identifier: Apache-2.0
"""Alarms and errors: the only place where their numbers are written down.

The controller sends the number of grbl 1.1 if grbl has an error or an alarm with the same meaning.
Our own numbers begin at ``FIRST``.

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

# Where a fault comes from. With one of the parts tape, block and program, the program is at fault:
# the run is rejected before anything has moved.
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

    ``number`` is our own number. ``grbl_error`` and ``grbl_alarm`` are the numbers of grbl for the
    same fault, 0 if grbl has none; N is grbl's number if there is one. Several of our faults may
    share an error of grbl, but not an alarm. ``sentence`` says what is wrong, without capital and
    full stop. The firmware's message is more exact, and gives the place; it is the sentence itself
    if ``spoken``. ``cause`` and ``remedy`` are whole sentences for the person at the machine;
    ``{name}`` stands for the number of a setting.
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


READ_AGAIN = ("Clean the tape and the reader and read it again; if the fault comes back, punch a "
              "new tape.")
CORRECT = "Correct the block that the message names."

FAULTS: tuple[Fault, ...] = (
    _fault(101, "no_start", "tape", "no start code before the data",
           "The tape does not begin with `%` or ER and an end of block.",
           "Insert the tape the right way round, with its leader first."),
    _fault(102, "parity", "tape", "parity error (TH)",
           "A row has an even number of holes in EIA, or an odd number in ISO: it was read or "
           "punched wrong.", READ_AGAIN),
    _fault(103, "blank", "tape", "blank tape inside the program",
           "A row without holes stands inside the data of an EIA tape.", READ_AGAIN),
    _fault(104, "code", "tape", "a row of holes that is no character of the code",
           "A row has a pattern that ISO or EIA does not know.", READ_AGAIN),
    _fault(105, "tv", "tape", "odd number of characters in a block (TV)",
           "The TV check is on, and a character of the block was lost or doubled; or the tape was "
           "made without TV.", "Read the tape again. Switch the check off (`${tv}=0`) for a tape "
           "made without it."),
    _fault(106, "too_long", "tape", "too many characters in a block or a line",
           "A block has more than 256 characters, or a line has more than the controller can take.",
           "Divide the block, or shorten its comment.", error=11),
    _fault(107, "no_end", "tape", "the tape ends before the end word (M02 or M30)",
           "The program has no M02 or M30, or the tape is torn or was cut short.",
           "End the program with M02 or M30, and read the whole tape."),
    _fault(108, "line", "link", "a line arrived damaged, out of sequence or without room",
           "The link to the controller is noisy, or lines were sent faster than they were "
           "answered. After a line with a check, lines without one are refused too.",
           "The line had no effect: send it again. If this happens often, check cable and earth."),
    _fault(110, "character", "block", "a character out of place",
           "The block has a character where no word can have it.", CORRECT, error=1),
    _fault(111, "number", "block", "a number is missing or malformed",
           "A letter has no number after it, or the number has the wrong form.", CORRECT,
           error=2),
    _fault(112, "overflow", "block", "a number is too long or out of range",
           "The number has too many digits, or the controller cannot express it.", CORRECT),
    _fault(113, "duplicate", "block", "a word stands twice in a block",
           "The same letter, or the same G or M code, is given twice.",
           "Remove one of them, or divide the block.", error=25),
    _fault(114, "conflict", "block", "words that exclude each other",
           "Two words of the block contradict each other, or a word changes something that cannot "
           "change now.", "Divide the block, or remove the word that the message names."),
    _fault(115, "unknown", "block", "a word or code that does not exist here",
           "The controller does not have this letter, G code or M code.",
           "Use a word of the page [words](programs.md).", error=20),
    _fault(116, "comment", "block", "a comment is not closed",
           "A `(` has no `)` in the same block.", "Close the comment."),
    _fault(117, "place", "block", "a word without meaning in this block",
           "The word belongs to another kind of block.", "Remove the word, or put it into a block "
           "of its own.", error=36),
    _fault(118, "missing", "block", "a word is missing in this block",
           "A code of the block needs a word that is not there.",
           "Add the word that the message names.", error=28),
    _fault(119, "refused", "block", "known, but not in this version",
           "The code or the command exists in a standard, but this controller does not have it, or "
           "does not have it here.", "Often the message names another way; use it.", error=20),
    _fault(120, "arc", "block", "no circle fits the words of the arc",
           "Start, end and centre or radius do not belong to one circle, or the circle is too "
           "large or too small.", "Check X, Y, Z, I, J, K and R, and whether G90 or G91 is in "
           "force. `${arc_difference_nm}` sets how far the radii at start and end may differ.",
           error=33),
    _fault(121, "corner", "block", "the wire offset does not fit the path",
           "The path has a corner, an arc or a gap that is smaller than the wire offset.",
           "Use a smaller offset (D), or change the path at the block that the message names."),
    _fault(122, "modal", "block", "two codes of one group",
           "Two G codes or two M codes of the block belong to one group, such as G00 and G01.",
           "Remove one of them, or divide the block.", error=21),
    _fault(123, "command", "block", "a line with $ that is unknown or not in this version",
           "The controller does not have this command.",
           "Use a command of the page [link](link.md).", error=3),
    _fault(124, "homing", "block", "homing is off",
           "`$H` asks for a homing cycle, and `${home_order}` names no axis, or an axis has no "
           "coder.", "Set `${home_order}`; or move to the mark, then send `$POSITION=HERE`.",
           error=5),
    _fault(130, "feed", "program", "the feed is missing, zero or too high",
           "G01, G02 or G03 has no feed F, or F is above the highest speed.",
           "Give F, up to `${highest_speed_mm_min}` mm/min.", error=22),
    _fault(170, "jog", "program", "a word that no jog has",
           "`$J=` takes X, Y, Z, F, N, G20, G21, G53, G90 and G91 only.",
           "Send other words in a line of their own, without `$J=`.", error=16),
    _fault(171, "jog_travel", "program", "the target of the jog is beyond the travel",
           "The jog would lead an axis past its soft limit, or further onto its limit switch.",
           "Jog less far. The soft limits are `${low_x_um}` to `${high_z_um}` and "
           "`${soft_limit_um}`.", error=15),
    _fault(172, "jog_ended", "program", "the jog was cancelled before it could begin",
           "The byte 0x85, a hold, or silence of the host has ended the jogs that waited.",
           "Jog again.", spoken=True),
    _fault(131, "mode", "program", "X, Y or Z without G00, G01, G02 or G03",
           "No kind of motion is in force yet; or the servo (G95) would move without M03.",
           "Write the G code in the block, or M03 before it.", error=31),
    _fault(132, "retraction", "program", "the retraction data are invalid or incomplete",
           "An item of G36 is zero, too high or missing, or Q is above L; or a code needs G36 "
           "before it.", "Correct the G36, or enter one by hand before the tape."),
    _fault(133, "condition", "program", "the machining condition is unknown, missing or unfit",
           "C names a condition that does not exist, there is no C before M03, the power supply "
           "cannot give the current, the pulses end before the comparators are read, or a depth "
           "series (G39) has too many steps.",
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
           "An alarm or power-on has locked it; or it is still coming to rest, or an axis is on a "
           "limit switch.", "Remove the cause, wait until the machine is at rest, and send `$X`.",
           error=9),
    _fault(138, "busy", "program", "not now: a program runs, or the machine moves or machines",
           "The line would change something that may not change meanwhile.",
           "Wait for the end of the program. For a setting that guards the machine, send M05 and "
           "wait until the machine is at rest.", error=8),
    _fault(178, "start_block", "program", "the tape ends before the block at which it was to begin",
           "`$FROM=n` names a block that the tape does not have, or one behind a touch-off.",
           "Name a block of the tape; it ends with M02 or M30.", spoken=True),
    _fault(180, "walk", "program", "the machine cannot walk to that place on the path",
           "`$WALK` names a place further back than the path is remembered or the machine may go, "
           "or the front itself, or one between the front and the place to which the servo has "
           "drawn back.",
           "Name a place within the distance that the message tells. To the front and on goes "
           "`~`."),
    _fault(139, "table", "program", "a row of a table is invalid",
           "A row of G10, or basic data for planning, has an impossible value.",
           "Correct the value that the message names."),
    _fault(140, "trip", "machine", "the interlock has tripped",
           "A guard has made the outputs safe. The message names it, such as the emergency stop, a "
           "limit switch, a drive, a coder or the watchdog.",
           "Remove the cause, then send `$X`. If the position is lost, check where the axes are "
           "and send `$POSITION=HERE`. Press ARM before machining."),
    _fault(157, "limit", "machine", "an axis is on its limit switch",
           "The interlock has tripped: an axis has pressed a limit switch, or its wire is broken.",
           "Send `$X`, and move slowly away from the switch. Check zero and soft limits.", alarm=1),
    _fault(141, "halt_limit", "machine", "still short at the retractable limit",
           "The electrode went back by L and still touches: there is debris, the wire or electrode "
           "is bent, or L is too small.", "Send `$X`, then move the electrode away. Clean the gap, "
           "check the flushing, and start again; or use a larger L in G36.", spoken=True),
    _fault(142, "halt_back_limit", "machine",
           "still short at the back limit (ceiling, soft limit or start of the path)",
           "The electrode could not go back further, and still touches.",
           "Send `$X`, then move the electrode away. Clean the gap. Look at Z of G36 and at the "
           "soft limits.", spoken=True),
    _fault(143, "halt_burst", "machine", "too many shorts in a burst without new depth",
           "The gap shorts again and again at the same place: the flushing does not carry the "
           "debris away, or the discharge is too strong for the gap.",
           "Send `$X`, move the electrode away and clean the gap. Improve the flushing, add jumps "
           "(G38), or take a weaker condition. `${repeats}` says at which return of the short "
           "the alarm comes.", spoken=True),
    _fault(144, "halt_no_data", "machine", "retraction without data (G36)",
           "The gap was shorted, or the operator asked for a retraction, and no retraction data "
           "say how far and how fast to go back.",
           "Send `$X`, move the electrode away, and enter a G36 by hand or put one into the "
           "program.", spoken=True),
    _fault(145, "fin", "machine", "the machine side did not answer",
           "An M, S or T code was sent to the machine side, and FIN did not come in time.",
           "Check the machine side: pump, tool, relay, cable. `${fin_ms}` is the longest wait in "
           "ms. Send `$X` and start again."),
    _fault(146, "events", "machine", "events of the gateware were lost",
           "Events came faster than the firmware could take them. This should never happen.",
           "Send `$X` and start again. Report it with the tape and `events.jsonl`.", spoken=True),
    _fault(147, "reset", "machine", "reset by the operator during motion",
           "Ctrl-X came while a tape ran or an axis moved. In `Hold:0` it is no alarm, unless a "
           "tape runs.",
           "Send `$X`, press ARM, and start the program again.", spoken=True, alarm=3),
    _fault(148, "halt_servo", "machine", "the servo would go back beyond the retractable limit or "
           "the ceiling or the soft limit",
           "The gap stayed too narrow, and the servo has drawn the electrode back as far as it is "
           "allowed to.",
           "Send `$X`. Clean the gap and check the flushing; check presets and references of the "
           "condition; or use a larger L in G36.", spoken=True),
    _fault(149, "fluid", "machine", "the fluid's resistance is not known",
           "The conductivity cell is shorted or broken, its converter does not answer, or the "
           "thresholds of the classes are out of order.",
           "Check the cell and its wires, and `${fluid_threshold_0}` to `${fluid_threshold_2}`. "
           "With `${fluid_mode}=0` you choose the class yourself (`${fluid_class}`)."),
    _fault(150, "no_discharge", "machine", "a long way without a discharge",
           "Under servo the electrode went forward without a discharge: there is no voltage at the "
           "gap, the zero is wrong, or there is no workpiece.",
           "Check cables and power supply, fluid, zero and workpiece. `${no_discharge_um}` is the "
           "way in µm."),
    _fault(151, "no_progress", "machine", "a long time without new depth",
           "The machine stays at one place while it machines under G95: the presets never give a "
           "step forward, or a large electrode has too little current.",
           "Check presets and references of the condition. If the job is just slow, raise "
           "`${no_progress_s}` (s)."),
    _fault(152, "contact", "machine",
           "contact with the discharge off; from here only a move away from the work is possible",
           "The electrode or wire touched the work while it moved without discharge.",
           "Send `$X`, and move away from the work, back along the way to it: by a line that "
           "leads, by at least an eighth of its length, against the last cut or touch, or straight "
           "up the jump axis; an arc never counts as a move away "
           "([contact](guards.md#contact-with-the-discharge-off)). Then check zero and program.",
           spoken=True),
    _fault(173, "no_touch", "machine", "the end of a touch-off (G38.2) was reached without contact",
           "The work is further away, the sensing source sees no contact, or the block has the "
           "wrong axis or sign.", "Check clamping, cables and the sensing source, and give the "
           "block a longer way. Where no contact is no fault, use G38.3. G38.4 gives the same "
           "alarm if the electrode still touches at its end; G38.5 does not.", spoken=True,
           alarm=5),
    _fault(174, "touches", "machine", "the electrode touches the work before the touch-off begins",
           "A touch-off (G38.2, G38.3) was asked for in contact: there is no way to measure.",
           "Send `$X`, move away from the work, and touch off again. G38.4 and G38.5 give the "
           "same alarm the other way round: the electrode does not touch to begin with.",
           spoken=True, alarm=4),
    _fault(175, "home_not_found", "machine", "the reference switch was not found",
           "The axis has gone half as far again as its travel, or in the slow approach twice the "
           "pull-off, and its switch was not pressed. Or it is homed on the index of its coder "
           "(`${home_index}`), and none came on the way `${home_index_um}` from the pull-off.",
           "Check the switch, its wires, the direction `${home_down}`, and the travel "
           "(`${low_x_um}` to `${high_z_um}`). For the index, check its wire, and that the way is "
           "longer than a turn of the coder.", spoken=True, alarm=9),
    _fault(176, "home_not_left", "machine",
           "the reference switch is still pressed after the pull-off",
           "The axis has gone the pull-off `${home_pull_off_um}` away from its reference switch. "
           "The switch sticks, or needs a longer way.",
           "Send `$X`, jog away from the switch, and set a longer pull-off.", spoken=True, alarm=8),
    _fault(177, "home_reset", "machine", "reset by the operator during homing",
           "Ctrl-X came in a homing cycle: the position is not known.",
           "Send `$H` again.", spoken=True, alarm=6),
    _fault(153, "not_armed", "machine", "the discharge is not armed: press the button ARM at the "
           "machine",
           "After power-on, an alarm, a trip or a reset the discharge is not allowed until "
           "someone at the machine presses ARM.", "Make sure that nobody is in danger, press ARM, "
           "and start again.",
           spoken=True),
    _fault(154, "position_lost", "machine",
           "the position is lost; $POSITION=HERE accepts the counted position",
           "After power-on, and after some trips, the counted position may differ from the true "
           "position of the axes.", "Send `$H`; or measure, then send "
           "`$POSITION=HERE`, and set zero again if it has moved.", spoken=True),
    _fault(155, "guard", "machine", "the controller has found itself damaged",
           "The axes are not at the place to which the path has led them, or the gateware has "
           "stopped the processor, because its memory read wrong or it did not answer.",
           "If the message names the memory or the watchdog, switch the controller off and on. "
           "Otherwise send `$X`, check where the axes are, and send `$POSITION=HERE`. If it "
           "happens again, do not use the controller."),
    _fault(156, "stuck", "machine", "nothing moves, although the path goes on",
           "The machine should move, but no pulse comes. This should never happen.",
           "Send `$X` and start again. If it happens again, report it with the tape and "
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
    """Line ``ALARM:N`` of the alarm of a name. ``KeyError`` if there is none."""
    return f"ALARM:{alarm_number(name)}"


def error_line(name: str) -> str:
    """Line ``error:N`` of the fault of a name. ``KeyError`` if there is none."""
    return f"error:{named(name).error}"
