# SPDX-License-Identifier: Apache-2.0
"""What can go wrong: the only place the number of an alarm or error is written down.

``python -m softcore.generate`` makes the firmware's codes and sentences (``base/fault_codes.h``)
and the page ``docs/reference/alarms.md`` of it; the host reads it. Plain data: imports nothing from
Amaranth.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

__all__ = ["FAULTS", "PARTS", "Fault", "coded", "named"]

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
    """An alarm (``ALARM:number``) or the refusal of a line (``error:number``).

    ``sentence`` says what is wrong, without capital and full stop. The firmware says more: where,
    and what exactly; it has the sentence as it stands if ``spoken``. ``cause`` and ``remedy`` are
    for the person at the machine, in whole sentences; ``{name}`` is the number of a setting.
    """

    number: int
    name: str
    part: Part
    sentence: str
    cause: str
    remedy: str
    spoken: bool = False

    @property
    def of_machine(self) -> bool:
        """Whether the machine is at fault, and not the program."""
        return self.part == "machine"


def _fault(number: int, name: str, part: Part, sentence: str, cause: str, remedy: str, *,
           spoken: bool = False) -> Fault:
    return Fault(number=number, name=name, part=part, sentence=sentence, cause=cause,
                 remedy=remedy, spoken=spoken)


READ_AGAIN = "Clean the tape and the reader and read it again; if it comes back, punch a new tape."
CORRECT = "Correct the block that is named."

FAULTS: tuple[Fault, ...] = (
    _fault(1, "no_start", "tape", "no start code before the data",
           "The tape does not begin with `%` or ER and an end of block.",
           "Put the tape in the right way round, with its leader first."),
    _fault(2, "parity", "tape", "parity error (TH)",
           "A row of holes has an even count in EIA, or an odd one in ISO: it was read or punched "
           "wrong.", READ_AGAIN),
    _fault(3, "blank", "tape", "blank tape inside the program",
           "A row without holes stands inside the data of an EIA tape.", READ_AGAIN),
    _fault(4, "code", "tape", "a row of holes that is no character of the code",
           "A row has a pattern that ISO or EIA does not know.", READ_AGAIN),
    _fault(5, "tv", "tape", "odd number of characters in a block (TV)",
           "TV is checked, and a character of the block was lost or doubled; or the tape was made "
           "without TV.", "Read the tape again. Switch the check off (`${tv}=0`) for a tape made "
           "without it."),
    _fault(6, "too_long", "tape", "too many characters in a block or a line",
           "A block has more than 256 characters, or a line more than the controller takes.",
           "Divide the block, or shorten its comment."),
    _fault(7, "no_end", "tape", "the tape ends before the end word (M02 or M30)",
           "The program has no M02 or M30, or the tape is torn or was cut short.",
           "End the program with M02 or M30, and read the whole tape."),
    _fault(8, "line", "link", "a line arrived damaged, out of sequence or without room",
           "The line to the controller is noisy, or lines were sent faster than they were "
           "answered. A line without a check is refused, too, once lines with one have come.",
           "Nothing was done: send the line again. If it comes often, look at cable and earth."),
    _fault(10, "character", "block", "a character out of place",
           "The block has a character that no word has there.", CORRECT),
    _fault(11, "number", "block", "a number is missing or malformed",
           "A letter has no number behind it, or one that is not formed as it must be.", CORRECT),
    _fault(12, "overflow", "block", "a number is too long or out of range",
           "The number has too many digits, or the controller cannot express it.", CORRECT),
    _fault(13, "duplicate", "block", "a word stands twice in a block",
           "The same letter, or the same G or M code, is given twice.",
           "Take one of them away, or divide the block."),
    _fault(14, "conflict", "block", "words that exclude each other",
           "Two words of the block ask for different things, or one cannot be changed now.",
           "Divide the block, or take away the word that is named."),
    _fault(15, "unknown", "block", "a word or code that does not exist here",
           "The controller does not have this letter, G code or M code.",
           "Use what the page [words](programs.md) lists."),
    _fault(16, "comment", "block", "a comment is not closed",
           "A `(` has no `)` in the same block.", "Close the comment."),
    _fault(17, "place", "block", "a word without meaning in this block",
           "The word belongs to another kind of block.", "Take the word away, or give it a block "
           "of its own."),
    _fault(18, "missing", "block", "a word is missing in this block",
           "A code of the block needs a word that is not there.", "Add the word that is named."),
    _fault(19, "refused", "block", "known, but not in this version",
           "The code or the command exists in its standard; this controller does not have it, or "
           "not here.", "Do what you want in another way."),
    _fault(20, "arc", "block", "no circle fits what is said of the arc",
           "Start, end and centre or radius do not belong to one circle, or it is too large or too "
           "small.", "Check X, Y, Z, I, J, K and R, and whether G90 or G91 is in force. "
           "`${arc_difference_nm}` is how far the radii at start and end may differ."),
    _fault(21, "corner", "block", "the wire offset does not fit the path",
           "The path has a corner, an arc or a gap that is smaller than the wire offset.",
           "Use a smaller offset (D), or change the path where the sentence says."),
    _fault(30, "feed", "program", "the feed is missing, zero or too high",
           "G01, G02 or G03 has no feed F, or F is above the highest speed.",
           "Give F, up to `${highest_speed_mm_min}` mm/min."),
    _fault(31, "mode", "program", "X, Y or Z without G00, G01, G02 or G03",
           "No kind of motion is in force yet; or the servo (G95) would move without M03.",
           "Write the G code in the block, or M03 before it."),
    _fault(32, "retraction", "program", "the retraction data are invalid or incomplete",
           "An item of G36 is zero, too high or missing, or Q is above L; or a code needs G36 "
           "before it.", "Correct the G36, or enter one by hand before the tape."),
    _fault(33, "condition", "program", "the machining condition is unknown, missing or unfit",
           "C names a condition that is not there, M03 has none, the power supply cannot give its "
           "current, its pulses are too short to be looked at, or a series (G39) has no room.",
           "Use a built-in condition, or enter one with G10; then give C before M03."),
    _fault(34, "travel", "program", "the target is beyond the travel",
           "The block would lead an axis past its soft limit, or further onto its limit switch.",
           "Check zero (G92, G54 to G59) and the block. The soft limits are `${low_x_um}` to "
           "`${high_z_um}` and `${soft_limit_um}`."),
    _fault(35, "history", "program", "the path remembered does not cover the retractable limit",
           "So many short blocks fit into L that the controller cannot remember all of them.",
           "Use a smaller L in G36, or longer blocks."),
    _fault(36, "setting", "program", "a setting does not exist or is out of range",
           "The number of the setting is wrong, or its value is not within its range.",
           "Look it up in [settings](settings.md), or send `$$`."),
    _fault(37, "locked", "program", "the machine is locked",
           "An alarm or power-on has locked it; or it still comes to rest, or stands on a limit "
           "switch.", "Remove what caused it, wait until the machine is at rest, and send `$X`."),
    _fault(38, "busy", "program", "not now: a program runs, or the machine moves or machines",
           "The line would change something that must stay as it is meanwhile.",
           "Wait for the end of the program; for a setting that guards the machine, M05 and rest "
           "come first."),
    _fault(39, "table", "program", "a row of a table is invalid",
           "A row of G10, or basic data for planning, has a value that cannot be.",
           "Correct the value that is named."),
    _fault(40, "trip", "machine", "the interlock has tripped",
           "A guard has made the outputs safe: the sentence says which, such as the emergency "
           "stop, a limit switch, a drive, a coder or the watchdog.",
           "Remove the cause, then send `$X`. If the position is lost, check where the axes stand "
           "and send `$POSITION=HERE`. Press ARM before you machine."),
    _fault(41, "halt_limit", "machine", "still short at the retractable limit",
           "The electrode went back by L and still touches: debris, a bent wire or electrode, or "
           "an L that is too "
           "small.", "Send `$X`, then move the electrode away. Clean the gap, look at the "
           "flushing, and start again; or allow a larger L in G36.", spoken=True),
    _fault(42, "halt_floor", "machine",
           "still short where the way back ends (ceiling, soft limit or start of the path)",
           "The electrode could not go back further, and still touches.",
           "Send `$X`, then move the electrode away. Clean the gap. Look at Z of G36 and at the "
           "soft limits.", spoken=True),
    _fault(43, "halt_series", "machine", "too many shorts in series without new depth",
           "The gap shorts again and again at the same place: debris that the flushing does not "
           "carry away, or a discharge that is too strong for the gap.",
           "Send `$X`, move the electrode away and clean the gap. Improve the flushing, add jumps "
           "(G38), or take a weaker condition. `${repeats}` is the number of shorts.", spoken=True),
    _fault(44, "halt_no_data", "machine", "short without retraction data (G36)",
           "The gap is shorted, and nobody has said how far and how fast to go back.",
           "Send `$X`, move the electrode away, and enter a G36 by hand or put one into the "
           "program.", spoken=True),
    _fault(45, "fin", "machine", "the machine side did not answer",
           "An M, S or T code was sent to the machine side, and FIN did not come in time.",
           "Look at the machine side: pump, tool, relay, cable. `${fin_ms}` is the longest wait in "
           "ms. Send `$X` and start again."),
    _fault(46, "events", "machine", "events of the gateware were lost",
           "More happened than the firmware could take. This should never be.",
           "Send `$X` and start again. Report it with the tape and `events.jsonl`.", spoken=True),
    _fault(47, "reset", "machine", "reset by the operator during motion",
           "Ctrl-X came while a program ran or an axis moved.",
           "Send `$X`, press ARM, and start the program again.", spoken=True),
    _fault(48, "halt_servo", "machine", "the servo would go back beyond the retractable limit or "
           "the ceiling or the soft limit",
           "The gap stayed too narrow, and the servo has drawn the electrode back as far as it "
           "may.",
           "Send `$X`. Clean the gap and look at the flushing; check presets and references of the "
           "condition; or allow a larger L in G36.", spoken=True),
    _fault(49, "fluid", "machine", "the fluid's resistance is not known",
           "The cell in the fluid is shorted or broken, its converter does not answer, or the "
           "thresholds of the classes are out of order.",
           "Look at the cell and its wires; check `${fluid_threshold_0}` to "
           "`${fluid_threshold_2}`. With `${fluid_mode}=0` the class is yours to choose "
           "(`${fluid_class}`)."),
    _fault(50, "no_discharge", "machine", "a long way without a discharge",
           "Under servo the electrode went forward, and nothing burned: no voltage at the gap, a "
           "wrong zero, or no workpiece.",
           "Check cables and power supply, fluid, zero and workpiece. `${no_discharge_um}` is the "
           "way in µm."),
    _fault(51, "no_progress", "machine", "a long time without new depth",
           "The machine machines at one place and does not come further: presets that never ask "
           "for a step, or a large electrode with little current.",
           "Check presets and references of the condition. If the job is just slow, raise "
           "`${no_progress_s}` (s)."),
    _fault(52, "contact", "machine",
           "contact with the discharge off; only a move away from the work goes on from here",
           "The electrode or wire touched the work while it moved without discharge.",
           "Send `$X`, and move away from the work, the way it came. Then check zero and program.",
           spoken=True),
    _fault(53, "not_armed", "machine", "the discharge is not armed: press the button ARM at the "
           "machine",
           "After power-on, an alarm, a trip or a reset the discharge is not allowed until someone "
           "at the machine says so.", "See that nobody is in danger, press ARM, and start again.",
           spoken=True),
    _fault(54, "position_lost", "machine",
           "the position is lost; $POSITION=HERE takes what is counted for true",
           "After power-on, and after some trips, the counted position may differ from where the "
           "axes truly are.", "Measure or find the reference again. Then send `$POSITION=HERE`, "
           "and set zero anew if it has moved.", spoken=True),
    _fault(55, "guard", "machine", "the controller has found itself damaged",
           "The axes are not where the path has led them, or the gateware has stopped the "
           "processor: its memory read wrong, or it did not answer.",
           "If the sentence names the memory or the watchdog, switch the controller off and on. "
           "Else send `$X`, check where the axes stand, and send `$POSITION=HERE`. If it comes "
           "back, do not use the controller."),
    _fault(56, "stuck", "machine", "nothing moves, although the path goes on",
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


def coded(number: int, table: Iterable[Fault] = FAULTS) -> Fault | None:
    """Fault of a number, or None."""
    return next((fault for fault in table if fault.number == number), None)
