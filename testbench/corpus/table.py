# SPDX-License-Identifier: Apache-2.0
"""The programs of the corpus: which are refused, where and why; and points written by hand.

Every other file of ``programs/`` runs, and does what ``testbench.corpus.reference`` says.
"""

from dataclasses import dataclass
from pathlib import Path

__all__ = ["FILES", "POINTS", "PROGRAMS", "REFUSED", "Refusal"]

PROGRAMS = Path(__file__).parent / "programs"
FILES = sorted(path.name for path in PROGRAMS.iterdir())


@dataclass(frozen=True)
class Refusal:
    """Where a program is refused, and a part of what is said; ``column`` is 0 for the block."""

    line: int
    column: int
    words: str


REFUSED = {
    "arc_centre_and_radius.nc": Refusal(4, 17, "a centre (I, J, K) or a radius R, not both"),
    "arc_chord_too_long.nc": Refusal(4, 13, "longer than the arc's diameter of 4.0000 mm"),
    "arc_circle_by_radius.nc": Refusal(4, 13, "needs an end point other than its start"),
    "arc_other_plane.nc": Refusal(4, 17, "K has no meaning in the plane G17"),
    "arc_radii_differ.nc": Refusal(4, 13, "1.5000 mm at its start, 2.5000 mm at its end"),
    "arc_without_centre.nc": Refusal(4, 5, "needs its centre (I, J, K) or its radius R"),
    "block_of_300.nc": Refusal(3, 257, "more than 256 characters"),
    "block_skip_inside.nc": Refusal(3, 9, "'/' is out of place"),
    "blocks_before_percent.nc": Refusal(1, 0, "a block stands before the % that starts"),
    "calls_itself.nc": Refusal(8, 1, "the subprogram O20 calls itself"),
    "calls_nowhere.nc": Refusal(4, 5, "there is no subprogram O20"),
    "calls_two_meanings.nc": Refusal(4, 5, "may be O52000, or O2000 5 times; say which by L"),
    "calls_without_end.nc": Refusal(6, 0, "the subprogram O20 has no end (M99)"),
    "comment_alone.nc": Refusal(2, 1, "ends without its end word (M02 or M30)"),
    "comment_in_comment.nc": Refusal(3, 14, "a comment begins within a comment"),
    "comment_open.nc": Refusal(3, 9, "the comment is not closed"),
    "control_byte.tap": Refusal(4, 8, "no code for character U+0007"),
    "decimal_comma.nc": Refusal(3, 7, "',' is out of place"),
    "dwell_u.nc": Refusal(3, 0, "G04 needs its time, as P (ms) or X (s)"),
    "dwell_without_time.nc": Refusal(3, 0, "G04 needs its time, as P (ms) or X (s)"),
    "empty.nc": Refusal(1, 0, "the text is empty"),
    "exponent.nc": Refusal(3, 9, "the word E has no meaning in this block"),
    "fanuc_g50_places.nc": Refusal(5, 1, "G50 with X, Y or Z"),
    "fanuc_return_to_reference.nc": Refusal(4, 8, "store it by G28.1"),
    "far_away.nc": Refusal(3, 5, "the distance X is out of range"),
    "feed_zero.nc": Refusal(3, 9, "the feed F must be 0.001 mm/min or more"),
    "g10_tool_table.nc": Refusal(3, 5, "G10 L must be L2 or L20"),
    "g52_local.nc": Refusal(3, 1, "use G54 to G59, or G92"),
    "g53_incremental.nc": Refusal(3, 1, "G53 needs G90"),
    "g54_extended.nc": Refusal(3, 1, "there are G54 to G59"),
    "grbl_dwell_in_seconds.gcode": Refusal(3, 4, "seconds are written X"),
    "grbl_inverse_time.gcode": Refusal(3, 1, "inverse time feed (G93)"),
    "grbl_probe.gcode": Refusal(2, 1, "G38.2 without a feed F"),
    "grbl_reference_unset.gcode": Refusal(3, 1, "store it by G30.1"),
    "grbl_spindle.gcode": Refusal(2, 1, "M03 without a machining condition (C)"),
    "haas_spindle.nc": Refusal(5, 7, "M03 without a machining condition (C)"),
    "haas_tool_length.nc": Refusal(5, 1, "tool length offsets (G43)"),
    "heidenhain_iso.nc": Refusal(1, 2, "% must stand alone on its line"),
    "latin1_in_block.tap": Refusal(4, 6, 'no code for "²"'),
    "letter_outside_ascii.nc": Refusal(3, 9, 'no code for "Ü"'),
    "linuxcnc_if.ngc": Refusal(2, 6, "O-words (sub, call, if, while and so on)"),
    "linuxcnc_named.ngc": Refusal(2, 1, "variables and expressions"),
    "linuxcnc_no_end.ngc": Refusal(5, 1, "ends without its end word (M02 or M30)"),
    "linuxcnc_owords.ngc": Refusal(1, 6, "O-words (sub, call, if, while and so on)"),
    "linuxcnc_percent_only.ngc": Refusal(4, 1, "ends without its end word (M02 or M30)"),
    "mach_centre_absolute.tap": Refusal(1, 9, "I, J, K count from the start"),
    "minus_alone.nc": Refusal(3, 7, "the number of the word X is missing"),
    "name_behind_percent.nc": Refusal(1, 2, "% must stand alone on its line"),
    "no_feed.nc": Refusal(3, 1, "G01 without a feed F"),
    "no_mode.nc": Refusal(3, 1, "X without G00, G01, G02 or G03"),
    "old_mark_asterisk.nc": Refusal(2, 8, "'*' is out of place"),
    "percent_in_block.nc": Refusal(3, 9, "cannot stand inside the program"),
    "refused_cycle_g73.nc": Refusal(4, 1, "canned cycles (G73 to G76)"),
    "refused_cycle_g81.nc": Refusal(4, 1, "canned cycles (G81 to G89)"),
    "refused_cycle_g83.nc": Refusal(4, 1, "canned cycles (G81 to G89)"),
    "refused_expression.nc": Refusal(4, 6, "variables and expressions"),
    "refused_macro_call.nc": Refusal(4, 1, "macro calls (G65, G66)"),
    "refused_modal_save.nc": Refusal(4, 1, "M70 keeps or brings back modal state"),
    "refused_polar.nc": Refusal(4, 1, "polar coordinates (G15, G16)"),
    "refused_rotation.nc": Refusal(4, 1, "turned coordinates (G68)"),
    "refused_scaling.nc": Refusal(4, 1, "scaling and shifts (G51, G52)"),
    "refused_variables.nc": Refusal(4, 1, "variables and expressions"),
    "refused_wire_offset_dynamic.nc": Refusal(4, 1, "G41.1 is not in this version"),
    "refused_work_offset_59_1.nc": Refusal(4, 1, "there are G54 to G59"),
    "return_alone.nc": Refusal(5, 1, "M99 belongs to a subprogram"),
    "return_to_block.nc": Refusal(8, 1, "M99 returns behind its call"),
    "siemens_comment.nc": Refusal(3, 9, "variables and expressions"),
    "siemens_style.nc": Refusal(1, 1, "G70 and G71 are G20 and G21 here"),
    "sinker_c_axis.nc": Refusal(3, 5, "the word C takes no decimal point"),
    "sinker_servo_without_data.nc": Refusal(6, 0, "G95 needs retraction data (G36)"),
    "sinker_without_condition.nc": Refusal(3, 1, "M03 without a machining condition (C)"),
    "too_many_functions.nc": Refusal(3, 25, "more than 6 M codes in the block"),
    "two_motions.nc": Refusal(3, 5, "G0 and G1 exclude each other"),
    "two_points.nc": Refusal(3, 9, "second decimal point in the word X"),
    "unknown_axis.nc": Refusal(3, 9, "the word A is unknown"),
    "utf16.tap": Refusal(1, 4, "is zero, so that it is no text"),
    "wire_narrow_slot.nc": Refusal(6, 0, "leaves nothing of this move between its corners"),
    "wire_offset_begins_on_arc.nc": Refusal(4, 20, "must begin with a line, not with an arc"),
    "wire_offset_unentered.nc": Refusal(3, 5, "the wire offset D4 has not been entered"),
    "wire_post_condition_words.nc": Refusal(4, 4, "the word D has no meaning in this block"),
    "wire_register_words.nc": Refusal(3, 5, "variables and expressions"),
    "wire_taper.nc": Refusal(3, 1, "scaling and shifts (G51, G52)"),
    "word_twice.nc": Refusal(3, 13, "the word X stands twice"),
    "zero_byte.tap": Refusal(4, 8, "is zero, so that it is no text"),
}

# Ends of the moves in X and Y, from the machine's zero, mm; and of an arc its turn and centre. The
# reference knows no wire offset: these are drawn on paper.
POINTS = {
    "wire_left.nc": [
        ("1.88", "0"), ("1.88", "5"), ("2", "5.12", -1, "2", "5"), ("7", "5.12"),
        ("7.12", "5", -1, "7", "5"), ("7.12", "0"), ("7", "-0.12", -1, "7", "0"), ("2", "-0.12"),
        ("0", "0")],
    "wire_right.nc": [
        ("1.15", "0"), ("1.15", "3.85"), ("3.85", "3.85"), ("3.85", "0.15"), ("1", "0.15"),
        ("0", "0")],
    "wire_arc_contour.nc": [
        ("2", "-0.1"), ("6", "-0.1"), ("8.1", "2", 1, "6", "2"), ("8.1", "4"), ("9", "4")],
    "wire_inch.nc": [
        ("2.413", "0"), ("2.413", "5.08"), ("2.54", "5.207", -1, "2.54", "5.08"),
        ("7.62", "5.207"), ("7.62", "2.54")],
    "fanuc_contour.nc": [
        ("-5", "-5"), ("-5", "-5"), ("-5", "-5"), ("-5", "-5"), ("10", "-5"),
        ("15", "0", 1, "10", "0"), ("15", "10"), ("10", "15", 1, "10", "10"), ("0", "15"),
        ("-5", "10", -1, "-5", "15"), ("-5", "-5"), ("-5", "-5")],
    "calls_fanuc_digits.nc": [
        ("1", "0"), *[(str(1 + (n + 1) // 2 / 2), str(n // 2 / 4)) for n in range(1, 13)]],
}
