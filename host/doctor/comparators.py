# SPDX-License-Identifier: Apache-2.0
"""Comparators and converter of the gap voltage, against the sensing source.

While an axis moves with the discharge off, the controller senses the gap with short pulses of a low
voltage. The levels of two comparators are swept past it, and each record of the gap oscilloscope
tells on which side of its level a comparator sees the pulses.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from constraints.board import Board
from host.doctor.complaints import Place, place, touched
from host.doctor.examination import CLEAR_MM, Examination, stopped
from host.doctor.levels import CODES, FULL
from host.scope.acquire import Acquisition, Trigger
from host.scope.record import Record

__all__ = ["LOWEST", "Seen", "apart", "judged", "levels_around", "seen", "sweep"]

AXES = "XYZ"
SWEPT_MM = 0.05     # way of the axis for each level, there and back
FEED = 6            # mm/min: half a second
MOVED_S = 8.0
TRIED_S = 0.02      # for the filters of the levels
ENTRIES = 256       # of the oscilloscope that are read

LOWEST = 8          # 1/1024: a voltage below it does not count
LADDER = (8, 16, 32, 64, 128, 256, 512)     # levels where the converter tells no voltage
SHARES = (0.3, 0.5, 0.75, 1.33, 2.0)    # of the converter's reading: the levels


@dataclass(frozen=True)
class Seen:
    """Sensing pulses with comparators at ``level``, 1/1024 of full scale.

    ``voltage`` is the converter's greatest sample, in the same unit, None without a sample.
    ``high`` and ``arc`` are the comparators' levels at the pulses' ends.
    """

    level: int
    voltage: float | None
    high: bool
    arc: bool


def seen(record: Record, level: int) -> Seen | None:
    """What a record shows at a level; None without a whole sensing pulse."""
    sense = record.levels["sense"]
    ends = np.flatnonzero(sense[:-1] & ~sense[1:])
    if not len(ends):
        return None
    # A sample tells of a time before it, so it may come after its pulse.
    codes = record.code[record.samples]
    return Seen(level, float(codes.max()) * FULL / CODES if len(codes) else None,
                bool(record.levels["high"][ends].mean() > 0.5),
                bool(record.levels["arc"][ends].mean() > 0.5))


def levels_around(first: Seen) -> list[int]:
    """Levels below and above the voltage that a first record shows, or a ladder without one."""
    if first.voltage is None or first.voltage < LOWEST:
        return list(LADDER)
    return [min(FULL - 1, max(1, round(share * first.voltage))) for share in SHARES]


def apart(board: Board, ways: Sequence[tuple[bool, Seen]]) -> list[Place]:
    """Suspect wires if the two levels are not each at its own comparator.

    ``ways`` has what was seen with one level below and the other above the voltage: true if that
    of ``gap_high`` was below. With equal levels, wires that are exchanged look sound.
    """
    if all(one.high is open_below and one.arc is open_below for open_below, one in ways):
        return []
    return [place(board, pad, bit) for pad, bit in (
        ("gap_high", 0), ("gap_arc", 0), ("gap_reference", 0), ("gap_reference", 1))]


def _percent(level: float) -> str:
    return f"{100 * level / FULL:.1f} %"


def judged(board: Board, shown: Sequence[Seen]) -> tuple[bool, str, list[Place]]:
    """Whether both comparators change sides at the voltage; with a sentence, and suspect wires.

    ``shown`` is by level, lowest first.
    """
    voltages = [one.voltage for one in shown if one.voltage is not None]
    voltage = float(np.median(voltages)) if voltages else 0.0
    told = voltage >= LOWEST
    suspects: list[Place] = []
    said = []
    changes = {}
    for name, pad, reference, below in (("open level", "gap_high", 0, True),
                                        ("arc level", "gap_arc", 1, False)):
        sides = [getattr(one, pad.removeprefix("gap_")) is below for one in shown]
        change = sum(sides)     # number of levels that this comparator reports below the voltage
        bounds = ([0, *(one.level for one in shown)][change],
                  [*(one.level for one in shown), FULL][change])
        sound = sides == [True] * change + [False] * (len(sides) - change)
        if told:
            sound = sound and bounds[0] < voltage < bounds[1]
        elif change in (0, len(sides)):
            sound = False
        changes[pad] = change
        said.append(f"{name} {_percent(bounds[0])} to {_percent(bounds[1])}")
        if not sound:
            suspects += [place(board, pad), place(board, "gap_reference", reference)]
    if not suspects and abs(changes["gap_high"] - changes["gap_arc"]) > 1:
        suspects = [place(board, pad, bit) for pad, bit in (
            ("gap_high", 0), ("gap_arc", 0), ("gap_reference", 0), ("gap_reference", 1))]
    reads = (f"the converter reads {_percent(voltage)}" if told else
             "the converter shows no voltage")
    return (not suspects, f"{reads} while the sensing source is on; the comparators change sides "
            f"between: {', '.join(said)} of full scale", suspects)


@dataclass(frozen=True)
class Look:
    """A motion of the sweep.

    ``seen`` is what its record shows, ``moved`` the way in mm. ``said`` is what was said if it was
    stopped, else None.
    """

    seen: Seen | None
    moved: float
    said: list[str] | None


def sweep(doctor: Examination, name: str) -> tuple[list[str], bool]:
    """Sweep the levels past the sensing pulses while this axis moves there and back.

    Returns what the controller said against the machine, unless that is a finding already, and
    whether axes may go on moving.
    """
    if stopped(doctor.command("$SCOPE", refused=True)):
        doctor.find("comparators", None, "this controller is built without the oscilloscope, "
                    "which the sweep needs")
        return [], True
    tried = [(FULL - 1, 1)]
    looks = [_look(doctor, name, tried[0], 1)]
    levels = levels_around(looks[0].seen) if looks[0].seen else [FULL - 1]
    tried += [(level, level) for level in levels]
    if len(levels) > 1:
        tried += [(levels[0], levels[-1]), (levels[-1], levels[0])]
    while looks[-1].said is None and len(looks) < len(tried):
        looks.append(_look(doctor, name, tried[len(looks)], -1 if len(looks) % 2 else 1))
    doctor.command("$LEVELS", refused=True)
    if looks[-1].said is not None:
        return _ended(doctor, looks, tried[len(looks) - 1]), False
    whole = [look.seen for look in looks[1:] if look.seen]
    if len(whole) == len(tried) - 1 > 1:
        sound, said, places = judged(doctor.board, whole[:len(levels)])
        crossed = list(zip((True, False), whole[len(levels):], strict=True))
        if sound and (places := apart(doctor.board, crossed)):
            sound, said = False, (said + "; with one level below the voltage and one above it they "
                                  "are on the wrong sides: open level and arc level are exchanged, "
                                  "at the references or at the comparators")
        doctor.find("comparators", sound, said, places)
    else:
        doctor.find("comparators", None, "the oscilloscope saw no sensing pulse")
    return [], True


def _ended(doctor: Examination, looks: Sequence[Look], levels: tuple[int, int]) -> list[str]:
    """Judge why the last look was stopped; return what was said, unless it is a finding now.

    Where the level for contact is exchanged with one that is tried above the gap's voltage, the gap
    reads as a short at once. The first look has the open level at the top and the arc level at the
    bottom, so from the second one on it can only be the arc level.
    """
    last = looks[-1]
    said = last.said or []
    if not any(map(touched, said)):
        if not said:
            doctor.find("comparators", None, "the axis was stopped, and why was not heard: ask "
                        "again")
        return said
    pad, reference = ("gap_high", 0) if len(looks) == 1 else ("gap_arc", 1)
    voltage = (looks[0].seen.voltage if looks[0].seen else None) or 0.0
    above = len(looks) == 1 or levels[1] > voltage >= LOWEST
    if above and abs(last.moved) < CLEAR_MM:
        doctor.find("comparators", False, "with a high level tried it reads as a short, where the "
                    "axis has just moved without one: the level for contact is exchanged with "
                    "another, at the references or at the comparators",
                    [place(doctor.board, *one) for one in (
                        (pad, 0), ("gap_short", 0), ("gap_reference", reference),
                        ("gap_reference", 2))])
    else:
        doctor.find("comparators", None, "touched on the way: move away by hand, then ask again")
    return []


def _look(doctor: Examination, name: str, levels: tuple[int, int], way: int) -> Look:
    """Move the axis and read a record; ``levels`` are of ``gap_high`` and ``gap_arc``."""
    before, axis = len(doctor.said), AXES.index(name)
    start = doctor.places()[axis]
    doctor.command(f"$LEVELS={levels[0]},{levels[1]}", refused=True)
    doctor.listen(TRIED_S)
    wanted = Acquisition(Trigger("now", before=0), most=ENTRIES)
    if not stopped(doctor.command(f"G91 G94 G01 {name}{way * SWEPT_MM:g} F{FEED}", refused=True)):
        doctor.await_state("Run", "Alarm", within_s=MOVED_S)
        end = doctor.port.time_s() + MOVED_S
        while wanted.record is None and doctor.port.time_s() < end:
            line = wanted.line(doctor.port.time_s())
            if line is None:
                doctor.listen(TRIED_S)
                continue
            for text in doctor.command(line):
                wanted.hear(text)
            wanted.answered("ok")
        doctor.await_state("Idle", "Alarm", within_s=MOVED_S)
        doctor.listen(TRIED_S)
    said = [text for text in doctor.since(before) if not text.startswith("[SCOPE")]
    # The line of the alarm may get lost, and the controller still tells its state.
    ended = stopped(said) or doctor.link.status()["state"] == "Alarm"
    return Look(None if wanted.record is None else seen(wanted.record, levels[0]),
                doctor.places()[axis] - start, said if ended else None)
