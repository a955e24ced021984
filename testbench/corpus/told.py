# SPDX-License-Identifier: Apache-2.0
"""What the firmware, built for this computer, makes of a program: in the terms of the reference."""

from fractions import Fraction

from testbench.corpus.reference import PULSES_PER_MM, Act, Move
from testbench.firmware import ACTS, STOPS, Fault

__all__ = ["acts_of", "moves_of"]

CLOCKS_PER_MS = 2000    # of the check
FINE = 64               # parts of a pulse in which centres are given
RAPID_UM = 1_800_000    # of a check without a machine
PLANES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}


def moves_of(checker, tape):
    """Moves of a tape with their lines in the text; or its fault.

    They begin at the machine's zero.
    """
    told = checker.motions(tape.rows)
    if isinstance(told, Fault):
        return told
    place, moves = [Fraction(0)] * 3, []
    for one in told:
        start = tuple(place)
        place = [at + Fraction(step, PULSES_PER_MM)
                 for at, step in zip(place, one.delta, strict=True)]
        plane = 17 + one.plane
        middle = tuple(float(start[axis]) + one.centre[k] / FINE / PULSES_PER_MM
                       for k, axis in enumerate(PLANES[plane]))
        moves.append(Move(
            tape.line(one.line), start, tuple(place), one.arc, plane if one.arc else 17,
            middle if one.arc else (0.0, 0.0),
            None if one.speed == RAPID_UM else Fraction(one.speed, 1000)))
    return moves


def acts_of(checker, tape):
    """What a tape without a fault does besides moving, in order."""
    acts = []
    for record in checker.check(tape.rows):
        if record.skipped:
            continue
        line = tape.line(record.line)
        before = [Act(line, "condition", record.condition)] * bool(record.condition)
        before += [Act(line, "on")] * (record.machining > 0)
        before += [Act(line, letter, value)
                   for letter, value in (("S", record.s), ("T", record.t)) if value >= 0]
        before += [Act(line, "M", code) for code in record.m if code >= 0]
        before += [Act(line, "dwell", Fraction(record.dwell, CLOCKS_PER_MS))] * (
            ACTS[record.act] == "dwell")
        after = [Act(line, "off")] * (record.machining < 0)
        after += [Act(line, "fluid off")] * record.fluid_off
        stop = STOPS[record.stop]
        names = {"program": "stop", "optional": "optional stop", "end": "end"}
        after += [Act(line, names[stop])] if stop in names else []
        acts += before + after
    return acts
