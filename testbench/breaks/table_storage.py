# SPDX-License-Identifier: Apache-2.0
"""Planted breaks of the journal, and of the port to its flash memory."""

from testbench.breaks.harness import breaks_of

__all__ = ["STORAGE"]

PITCH = "unit/firmware/test_pitch.py"
BOOKMARK = "unit/firmware/test_bookmark.py"
JOURNAL = "unit/firmware/test_journal.py"
PULSE = "unit/firmware/test_resume_pulse.py"
SLOTS = "unit/firmware/test_slots.py"
STORAGE = (
    *breaks_of(
        "softcore/firmware/store/journal.c", JOURNAL,
        ("of.words[of.count] == ~value", "true", "a page without its check is none"),
        ("come && come == of.parts", "come", "a record without its last page is none"),
        ("(!any || of.sequence > sequence)", "!any", "the newest sector counts"),
        ("    if (has_changed()) {\n        /* Parts", "    if (false) {\n        /* Parts",
         "parts of two states make no record"),
        ("        if (!renewing)\n            sector =", "        sector =",
         "the sector before stays until the new one is whole"),
        ("begin_record(kind + 1 < JOURNAL_KINDS ? kind + 1 : OPENING)",
         "begin_record(kind + 1 < JOURNAL_KINDS - 1 ? kind + 1 : OPENING)",
         "a new sector has all kinds"),
        ("    if (digest == stored[kind])", "    if (false)", "an equal value is not written"),
        ("++failures > FAILURES", "++failures > 1000u", "a memory that keeps nothing is told"),
        ("of.bytes[at] && same;", "of.bytes[at] || same;", "a page is read back"),
    ),
    *breaks_of(
        "softcore/firmware/store/bookmark.c", BOOKMARK,
        ("words[0] != BLANK && words[count - 1] == check()", "words[0] != BLANK",
         "a mark without its check is none"),
        (" && words[0] > sequence", "", "the newest sector counts"),
        ("hal_cycle_low() - written >= hal_clock_hz()", "true", "at most one write in a second"),
        ("(!now.line || ", "(", "the end of a tape is written at once"),
        ("opens && !blank && (ahead || changed);", "opens && !blank && ahead;",
         "after power-on the next sector is erased too"),
        ("failures > FAILURES", "failures > 1000u", "a memory that keeps nothing is told"),
        ("== words[i] && same;", "== words[i] || same;", "a mark is read back"),
        (" || place == PLACES", "", "a full sector is followed by the next"),
    ),
    *breaks_of(
        "softcore/firmware/app/resume.c", BOOKMARK,
        ("last->homed && machine_homed()", "machine_homed()", "the first run was homed"),
        ("ours != machine_frame() && ", "!ours && ", "a loss of the position ends the frame"),
        ("(last->homed && machine_homed())", "last->homed", "it is homed again"),
        ("same = same && zero", "same = zero", "program zero of every axis"),
        ("    kept = begun = !dry;", "    kept = begun = true;", "a dry run is none"),
        ("state->position[axis] = bookmark_now()->start[axis];", "state->position[axis] += 0;",
         "axes go where they stood at first"),
        ("        sum = mix(sum, (uint8_t)text[i]);", "        (void)text;",
         "the tape's text is compared"),
        ("entered = mix(entered + item", "entered = (entered + 0 * item",
         "retraction data entered by hand are compared"),
        ("mix(total + at, ", "mix(total, ", "it is the same setting that has a value", PITCH),
        (" ||\n            (group == GROUP_PITCH && settings_differs(at))", "",
         "tables of screws are compared", PITCH),
        ("|| ours != machine_frame() ||", "||", "homing makes it another place", PULSE),
        ("rest->delta[axis] -= way;", "rest->delta[axis] -= 0 * way;", "the rest of a line", PULSE),
        ("- (uint32_t)way * MOVE_FINE", "- 0 * (uint32_t)way", "... around the same centre", PULSE),
        ("if (rest->arc && axis == axes->third)", "if (0)", "a helix turns in its plane", PULSE),
        ("rest->arc = rest->arc && more;", "", "a short rest of an arc is a line", PULSE),
        ("+ 1;\n    under = 0;", "+ 1;", "what moves by hand is no block of the tape", PULSE),
        ("p->corners && rest_of != bookmark_now()->line", "p->corners",
         "it may be left twice behind a corner", PULSE),
        ("rests = rests || way > NEAR || way < -NEAR;", "rests = true;",
         "what has hardly begun begins anew", PULSE),
    ),
    *breaks_of(
        "softcore/firmware/path/path.c", PULSE,
        ("from = entry_of(first)->start,", "from = entry_of(first)->start - 5000,",
         "an earlier block is not the one of the front"),
        ("        first--;\n", "        break;\n", "an arc is one block"),
    ),
    *breaks_of(
        "softcore/firmware/app/start_block.c", PULSE,
        ("    rests = false;\n    start_block_done();", "    start_block_done();",
         "the rest is only that of the tape"),
        ("rest.delta[2] ? &rest : 0;", "rest.delta[2] ? &rest : move;",
         "what has ended is not carried out again"),
    ),
    *breaks_of(
        "softcore/firmware/store/slots.c", SLOTS,
        ("h->sum == sum_of(h)", "true", "the sum of a head is looked at"),
        ("flash_word() == total && total == h->digest", "true",
         "the digest is looked at before the start"),
        ("flash_word() == sum && sum == coming.digest", "true", "what was written is read back"),
        ("    begin_erase(sector_of(slot), 0);\n    return SLOTS_WELL;",
         "    begin_program(sector_of(slot), 0, &coming, sizeof coming);\n    doing = ERASE;\n"
         "    return SLOTS_WELL;", "the head is written last"),
        ("i = IMAGE_MARK; i < IMAGE_WORDS", "i = IMAGE_MARK; i < IMAGE_EDITION",
         "the edition is looked at"),
        ("h->base == base && is_ours", "(h->base == base || true) && is_ours",
         "slots of another bitstream are passed over"),
        ("!stays && marked(number, TRIED)", "false", "what does not answer is not tried twice"),
        ("running ? running % SLOTS :", "running ? running - 1 :",
         "the running firmware's slot stays"),
        ("place != have ||", "", "pieces come in their order"),
        ("    if (hal_arm_pressed())\n", "    if (false)\n", "ARM leads back"),
    ),
    *breaks_of(
        "softcore/firmware/app/firmware.c", SLOTS,
        ("    if (!may())\n", "    if (false)\n", "firmware is taken only at rest and disarmed"),
    ),
    *breaks_of(
        "softcore/firmware/app/keep.c", JOURNAL,
        ("(!status_idle() && !machine_locked())", "false",
         "defaults wait for the end of a held motion", "unit/firmware/test_held_line.py"),
        ("(journal_holds() || (!machine_machining() && meter_rests()))", "true",
         "nothing is written while the machine works"),
        ("return condition_check_row(&row) && conditions_enter", "return conditions_enter",
         "a condition is checked"),
        ("places_sound(part))", "(places_sound(part) || part))", "offsets are checked"),
        ("    told = true;\n", "", "it is told once"),
    ),
    *breaks_of(
        "softcore/firmware/base/settings.c", JOURNAL,
        ("    if (which == SETTINGS || value < settings_row(which)->lowest ||\n"
         "        value > settings_row(which)->highest)", "    if (which == SETTINGS)",
         "a kept setting has the range of its entry"),
    ),
    *breaks_of(
        "softcore/flash.py", "unit/softcore/test_flash.py",
        ("rises[-1]", "rises[0]", "the bit is taken when it is there"),
        ("self.start & ~self.busy", "self.start", "a start meanwhile does nothing"),
    ),
)
