# SPDX-License-Identifier: Apache-2.0
"""Makes C for the firmware, and pages, from the tables in ``softcore.tables``.

Each function takes a table and returns the text of one file, without the notice at its head.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import accumulate

from softcore.tables import events
from softcore.tables.causes import CAUSES, Cause
from softcore.tables.conditions import (
    CURRENT_MAX_A,
    ENTERED,
    IP_MA,
    LEVELS,
    PLANNED,
    USUAL,
    Condition,
    Voltages,
)
from softcore.tables.events import Choice, Event, Field
from softcore.tables.faults import FAULTS, PARTS, Fault
from softcore.tables.grbl import GRBL_SETTINGS, SOURCES, GrblSetting
from softcore.tables.references import filled
from softcore.tables.settings import GROUPS, SETTINGS, Setting
from softcore.tables.states import State
from softcore.texts import FIRST

__all__ = ["causes_header", "conditions_header", "conditions_page", "events_gateware",
           "events_header", "events_page", "faults_header", "faults_page", "grbl_header",
           "grbl_source", "settings_header", "settings_page", "settings_source", "states_gateware",
           "states_header"]


def _string(text: str) -> str:
    """A C string."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _enum(name: str, members: Iterable[str]) -> list[str]:
    return ["typedef enum {", *(f"    {member}," for member in members), f"}} {name};"]


def grouped(number: int) -> str:
    """Format a number with a narrow space between thousands."""
    return f"{number:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")


POINT = re.compile(r", [XYZ]\d+$")


def _alike(table: Sequence[Setting]) -> range:
    """Places of the settings that are points of a table: they have one row, and all their titles.

    They follow each other, as many for each axis; the firmware adds axis and point to the title.
    """
    found = [at for at, one in enumerate(table) if POINT.search(one.title)]
    first = table[found[0]]
    many = len(found) // 3
    for at, one in enumerate(table[found[0]:found[-1] + 1]):
        title = POINT.sub(f", {'XYZ'[at // many]}{at % many + 1}", first.title)
        if one != replace(first, title=title, number=first.number + at, name=one.name,
                          meaning=one.meaning):
            raise ValueError(f"setting {one.number} ({one.name}) is unlike {first.number}")
    return range(found[0], found[-1] + 1)


def settings_header(table: Sequence[Setting]) -> str:
    """Names of the settings, and the type of their table's rows, in C."""
    alike = _alike(table)
    lines = ["#pragma once", "#include <stdbool.h>", "#include <stdint.h>", ""]
    lines += _enum("setting", [*(f"SET_{setting.name.upper()}" for setting in table), "SETTINGS"])
    numbers = [setting.number for setting in table]
    lines += ["", "/* Range of the numbers; some in it may be unused. */",
              f"#define SETTINGS_FIRST {min(numbers)}u", f"#define SETTINGS_LAST {max(numbers)}u"]
    lines += ["", "/* The firmware applies the whole group again when a setting of it changes. */"]
    lines += _enum("setting_group", [*(f"GROUP_{group.upper()}" for group in GROUPS),
                                     "SETTINGS_GROUPS"])
    lines += [
        "",
        "typedef struct {",
        "    uint32_t initial, lowest, highest;",
        "    const char *title;",
        "    uint16_t number;        /* of the line `$number=value` */",
        "    uint8_t unit;           /* of SETTINGS_TABLE_UNITS; empty for a pure number */",
        "    uint8_t group : 6;",
        "    bool guards : 1;        /* locked while the machine moves or machines */",
        "    bool any_time : 1;      /* an operator's switch: may change while a program runs */",
        "} settings_table_row;",
        "",
        "/* Points of the axes' tables: as many of each axis, with one row and rising numbers. */",
        f"#define SETTINGS_ALIKE {alike.start}u",
        f"#define SETTINGS_SO_MANY {len(alike)}u",
        "#define SETTINGS_ROWS (SETTINGS - SETTINGS_SO_MANY + 1)",
        "extern const settings_table_row SETTINGS_TABLE_ROWS[SETTINGS_ROWS];",
        "extern const char *const SETTINGS_TABLE_UNITS[];",
        "",
        "/* Guards that the value 0 switches off. */",
        f"#define SETTINGS_GUARDS {sum(bool(one.switches_off) for one in table)}u",
        "typedef struct {",
        "    setting which;",
        "    const char *name;",
        "} settings_table_guard;",
        "extern const settings_table_guard SETTINGS_TABLE_GUARDS[SETTINGS_GUARDS];",
        "extern const char *const SETTINGS_TABLE_GROUPS[SETTINGS_GROUPS];",
    ]
    return "\n".join(lines) + "\n"


def settings_source(table: Sequence[Setting]) -> str:
    """Rows of the settings, in C."""
    alike = _alike(table)
    units = list(dict.fromkeys(one.unit for one in table))
    lines = ['#include "base/settings_table.h"', "",
             "const settings_table_row SETTINGS_TABLE_ROWS[SETTINGS_ROWS] = {"]
    for one in (*table[:alike.start + 1], *table[alike.stop:]):
        lines += [
            f"    {{{one.default}, {one.lowest}, {one.highest}, "
            f"{_string(POINT.sub('', one.title))},",
            f"        {one.number}, {units.index(one.unit)}, GROUP_{one.group.upper()}, "
            f"{str(one.guards).lower()}, {str(one.any_time).lower()}}},"]
    lines += ["};", "", "const char *const SETTINGS_TABLE_UNITS[] = {",
              *(f"    {_string(unit)}," for unit in units), "};", "",
              "const settings_table_guard SETTINGS_TABLE_GUARDS[SETTINGS_GUARDS] = {",
              *(f"    {{SET_{one.name.upper()}, {_string(one.switches_off)}}},"
                for one in table if one.switches_off),
              "};", "", "const char *const SETTINGS_TABLE_GROUPS[SETTINGS_GROUPS] = {",
              *(f"    [GROUP_{group.upper()}] = {_string(title)}," for group, title in
                GROUPS.items())]
    return "\n".join([*lines, "};"]) + "\n"


def grbl_header(table: Sequence[GrblSetting]) -> str:
    """Types for grbl's settings, in C."""
    lines = ["#pragma once", "#include <stdint.h>", "", '#include "base/settings_table.h"', "",
             f"#define GRBL_ROWS {len(table)}u", "",
             "/* Source of a value. All but a constant have three decimals. */"]
    lines += _enum("grbl_source", (f"GRBL_{source.upper()}" for source in SOURCES))
    lines += [
        "",
        "typedef struct {",
        "    uint16_t number;",
        "    uint8_t source;",
        "    uint8_t value;          /* of a constant; for other sources the axis */",
        "    uint8_t follows[2];     /* settings that it follows from; SETTINGS for none */",
        "    const char *title;",
        "    const char *unit;",
        "} grbl_table_row;",
        "",
        "extern const grbl_table_row GRBL_TABLE_ROWS[GRBL_ROWS];",
    ]
    return "\n".join(lines) + "\n"


def grbl_source(table: Sequence[GrblSetting]) -> str:
    """Rows of grbl's settings, in C."""
    lines = ['#include "base/grbl_table.h"', "",
             "const grbl_table_row GRBL_TABLE_ROWS[GRBL_ROWS] = {"]
    for one in table:
        follows = [*(f"SET_{name.upper()}" for name in one.follows), "SETTINGS", "SETTINGS"][:2]
        value = one.value if one.source == "constant" else one.axis
        lines += [f"    {{{one.number}, GRBL_{one.source.upper()}, {value}, "
                  f"{{{', '.join(follows)}}},",
                  f"        {_string(one.title)}, {_string(one.unit)}}},"]
    return "\n".join([*lines, "};"]) + "\n"


def _changes(one: Setting) -> str:
    """When a setting can change."""
    if one.any_time:
        return "any time"
    return "rest" if one.guards else "no program"


def settings_page(table: Sequence[Setting], faults: Sequence[Fault] = FAULTS,
                  grbl: Sequence[GrblSetting] = GRBL_SETTINGS) -> str:
    """Reference of the settings, in Markdown."""
    lines = [
        "# Settings", "",
        "The settings adapt the controller to a machine and its gap. `$$` lists them as "
        "`$number=value`, and such a line changes one. Old documents give numbers from before "
        "those of grbl were adopted: add 400 to them (`$44` is `$444`). `$ES` lists title, unit "
        "and range of all settings, `$ES=number` of one. A [machine's "
        "file](machine-file.md) gives them in its table `[settings]`. All values are whole "
        "numbers; both ends of a range are allowed. A changed setting outlives power-off where the "
        "board has a [flash memory](storage.md); `$RST=$` brings all defaults back.", "",
        "Those marked *any time* are switches of the operator. No other setting can change while a "
        "program runs. Those marked *rest* guard the machine: they cannot change while it moves or "
        "machines either (" + filled(
            "`error:{error_busy}`).", table, faults)]
    for group, title in GROUPS.items():
        lines += ["", f"## {title}", "",
                  "| setting | name | unit | default | range | changes | meaning |",
                  f"|{' --- |' * 7}"]
        lines += [
            f"| `${one.number}` | `{one.name}` | {one.unit} | {grouped(one.default)} "
            f"| {grouped(one.lowest)} to {grouped(one.highest)} "
            f"| {_changes(one)} | {filled(one.meaning, table, faults)} |"
            for one in table if one.group == group]
    lines += ["", "## Numbers of grbl", "",
              "Numbers below `$400` are those of grbl 1.1, with its meaning, for the senders that "
              "read them. They cannot be set: they are fixed, or follow from the settings above.",
              "", "| setting | title | unit | follows from | meaning |", f"|{' --- |' * 5}"]
    numbers = {one.name: one.number for one in table}
    lines += [f"| `${one.number}` | {one.title} | {one.unit} "
              f"| {', '.join(f'`${numbers[name]}`' for name in one.follows) or 'fixed'} "
              f"| {filled(one.meaning, table, faults)} |" for one in grbl]
    return "\n".join(lines) + "\n"


def faults_header(table: Sequence[Fault]) -> str:
    """Codes of faults in C, and the sentences that are always the same."""
    lines = ["#pragma once", "",
             "/* Our numbers. Grbl's number is sent instead if it has one (below). */"]
    lines += _enum("fault_code", ["FAULT_NONE = 0", *(
        f"FAULT_{one.name.upper()} = {one.number}" for one in table)])
    lines += ["", *(f"#define FAULT_TEXT_{one.name.upper()} \\\n    {_string(one.sentence)}"
                    for one in table if one.spoken)]
    for line, what, numbers in (
            ("error:N", "ERRORS", {one.name: one.grbl_error for one in table}),
            ("ALARM:N", "ALARMS", {one.name: one.grbl_alarm for one in table})):
        rows = [f"    {{FAULT_{name.upper()}, {number}}}" for name, number in numbers.items()
                if number]
        lines += ["", f"/* Numbers of grbl for `{line}`. */", f"#define FAULT_{what} \\",
                  ", \\\n".join(rows)]
    return "\n".join(lines) + "\n"


def causes_header(table: Sequence[Cause]) -> str:
    """Sentences of the interlock's causes, in C."""
    lines = ["#pragma once", "", '#include "hal/regs.h"', "", "#define CAUSE_TEXTS \\"]
    rows = [f"    [CAUSE_{one.name.upper()}] = {_string(one.sentence)}" for one in table]
    return "\n".join([*lines, ", \\\n".join(rows)]) + "\n"


def parts_header(parts: Sequence[str]) -> str:
    """What each byte of the stored texts from the first on stands for, in C."""
    def rows(numbers: Iterable[int]) -> list[str]:
        every = [str(number) for number in numbers]
        return ["    " + ", ".join(every[at:at + 16]) + "," for at in range(0, len(every), 16)]

    edges = list(accumulate(map(len, parts), initial=0))
    return "\n".join([
        "#pragma once", "#include <stdint.h>", "", f"#define TEXT_PARTS_FIRST {FIRST}",
        "/* Part n is that from TEXT_PARTS_AT[n] to the next. */",
        f"static const uint16_t TEXT_PARTS_AT[{len(edges)}] = {{", *rows(edges), "};",
        f"static const uint8_t TEXT_PARTS[{edges[-1]}] = {{", *rows("".join(parts).encode()), "};",
    ]) + "\n"


def faults_page(table: Sequence[Fault], settings: Sequence[Setting] = SETTINGS,
                causes: Sequence[Cause] = CAUSES) -> str:
    """Reference of alarms and errors, in Markdown."""
    lines = [
        "# Alarms and errors", "",
        "`error:N` refuses a line. The line had no effect, unless a reset or an alarm came while "
        "it was being carried out. `ALARM:N` ends a program and locks the "
        "machine: the discharge is off, and the axes come to rest. `$X` unlocks it when the cause "
        "is gone. Before each of them the controller says where it happened and what exactly was "
        "wrong, as `[MSG:…]` or as the event `alarm`.", "",
        "Our own numbers begin at 100. If grbl 1.1 has a number with the same meaning, the "
        "controller sends that one; it follows our number here.", "",
        "A program that is refused before anything has moved is *rejected* (exit status 4); after "
        "that, or if the machine is at fault, the run ends in *alarm* (exit status 3)."]
    for part, title in PARTS.items():
        lines += ["", f"## {title}"]
        for one in table:
            if one.part == part:
                told = "".join((f", `error:{one.grbl_error}`" if one.grbl_error else "",
                                f", `ALARM:{one.grbl_alarm}`" if one.grbl_alarm else ""))
                lines += ["", f"### {one.number}{told}: {one.sentence}", "",
                          f"Cause: {filled(one.cause, settings, table)}", "",
                          f"What to do: {filled(one.remedy, settings, table)}"]
            if one.part == part and one.name == "trip":
                lines += ["", "| what tripped | what to do first |", "| --- | --- |",
                          *(f"| {cause.sentence} | {cause.remedy} |" for cause in causes)]
    return "\n".join(lines) + "\n"


def _format(fields: Iterable[Field]) -> str:
    """Format of an event's fields for ``text_print``."""
    return "".join(f",{events.FORMATS[one.kind]}" for one in fields if one.kind in events.FORMATS)


def events_header(table: Sequence[Event]) -> str:
    """Kinds of events in C: numbers of the queue, names and formats of the lines."""
    lines = ["#pragma once", "", "/* Kinds in the gateware's queue. */"]
    lines += _enum("hal_event_kind", ["EVENT_NONE = 0", *(
        f"EVENT_{one.name.upper()} = {one.number}" for one in events.numbered(table))])
    lines += ["", "/* Details: letters on the line, by their number in the gateware; 0 is none. */"]
    lines += [f"#define EVENT_{name} {_string('?' + ''.join(one.letter for one in choices))}"
              for name, choices in (("CAUSES", events.CAUSES), ("REASONS", events.REASONS),
                                    ("PHASES", events.PHASES))]
    lines += [f"#define EVENT_{name}_{one.name.upper()} {one.number}"
              for name, choices in (("CAUSE", events.CAUSES), ("REASON", events.REASONS),
                                    ("PHASE", events.PHASES), ("HALT", events.HALTS))
              for one in choices]
    lines += [f"#define EVENT_SOURCE_{one.name.upper()} '{one.letter}'" for one in events.SOURCES]
    lines += ["", "/* Name of an event on the line, and the form of what follows its place. With",
              "   `_FULL` it has what may be left out, too. */"]
    for one in table:
        if not one.word:
            continue
        stem = one.name.upper()
        lines.append(f"#define EVENT_WORD_{stem} {_string(one.word)}")
        optional = [field for field in one.fields if field.optional and field.kind != "text"]
        if one.fields or optional:
            always = [field for field in one.fields if field not in optional]
            lines.append(f"#define EVENT_FORMAT_{stem} {_string(_format(always))}")
        if optional:
            lines.append(f"#define EVENT_FORMAT_{stem}_FULL {_string(_format(one.fields))}")
    return "\n".join(lines) + "\n"


def _class(name: str, doc: str, choices: Iterable[tuple[int, str, str]]) -> list[str]:
    """An Amaranth enumeration of 8 bits, 0 for none."""
    return ["", "", f"class {name}(enum.Enum, shape=8):", f'    """{doc}"""', "", "    NONE = 0",
            *(line for number, member, comment in choices for line in (
                *([f"    # {comment}"] if comment else []), f"    {member.upper()} = {number}"))]


def events_gateware(table: Sequence[Event]) -> str:
    """Kinds of events and their details for the gateware, in Python."""
    def rows(choices: Iterable[Choice]) -> list[tuple[int, str, str]]:
        return [(one.number, one.name, one.doc) for one in choices]

    def contents(one: Event) -> str:
        parts = (f"{key}: {said}" for key, said in (
            ("Detail", one.detail), ("first", one.first), ("second", one.second)) if said)
        text = "; ".join(parts)
        return f"{text}." if text else ""

    def struct(name: str, doc: str, values: Iterable[str]) -> list[str]:
        return ["", "", f"class {name}(data.Struct):", f'    """{doc}"""', "", "    kind: Event", *(
            f"    {value}: {f'signed({bits})' if sign else bits}"
            for value, (bits, sign) in ((value, events.QUEUE[value]) for value in values))]

    lines = ['"""Events: their kinds and details, and the structures that hold one."""', "",
             "from amaranth import *", "from amaranth.lib import data, enum", "",
             '__all__ = ["Cause", "Event", "Halt", "Happened", "Phase", "Queued", "Reason"]']
    lines += _class("Event", "Kinds of events.", (
        (one.number, one.name, contents(one)) for one in events.numbered(table)))
    lines += _class("Cause", "Why a retraction starts.", rows(events.CAUSES))
    lines += _class("Reason", "Why a retraction ends.", rows(events.REASONS))
    lines += _class("Phase", "How a re-advance goes.", rows(events.PHASES))
    lines += _class("Halt", "Why the machine halts.", rows(events.HALTS))
    lines += struct("Happened", "An event as its source tells it; ``cycle`` is the clock when it "
                    "happened.", events.TOLD)
    lines += struct("Queued", "An event as the firmware gets it: with the machine's place on the "
                    "path.", events.QUEUE)
    return "\n".join(lines) + "\n"


def states_header(motion: Sequence[State], checks: Sequence[State]) -> str:
    """Numbered states in C, and the words of the checks."""
    def rows(prefix: str, states: Sequence[State]) -> list[str]:
        return [f"{prefix}_{one.name.upper()} = {one.number}" for one in states]

    lines = ["#pragma once", "", "/* What the motion is doing. */",
             *_enum("hal_motion_state", rows("MOTION", motion)), "",
             "/* Results of a coder's supervision. */",
             *_enum("hal_check", [*rows("CHECK", checks), f"CHECKS = {len(checks)}"]), "",
             "#define CHECK_TEXTS \\"]
    lines += [f"    [CHECK_{one.name.upper()}] = {_string(one.text)}, \\" for one in checks]
    lines[-1] = lines[-1].removesuffix(" \\")
    return "\n".join(lines) + "\n"


def states_gateware(motion: Sequence[State], checks: Sequence[State],
                    pulses: Sequence[State]) -> str:
    """Numbered states for the gateware, in Python."""
    def one(name: str, bits: int, doc: str, states: Sequence[State]) -> list[str]:
        members = [f"    {state.name.upper()} = {state.number}" for state in states]
        wide = max(map(len, members))
        return ["", "", f"class {name}(enum.Enum, shape={bits}):", f'    """{doc}"""', "", *(
            f"{member:<{wide}}  # {state.doc}" if state.doc else member
            for member, state in zip(members, states, strict=True))]

    lines = ['"""States of the motion, the coders\' supervision and the oscilloscope\'s pulses."""',
             "", "from amaranth.lib import enum", "", '__all__ = ["Check", "Pulse", "State"]']
    lines += one("State", 4, "What the motion is doing.", motion)
    lines += one("Check", 3, "The check that failed first.", checks)
    lines += one("Pulse", 3, "The pulse that got its class in the clock of an entry.", pulses)
    return "\n".join(lines) + "\n"


def _field_row(one: Field) -> str:
    doc = one.doc + "".join(f" `{choice.name}` (`{choice.letter}`): "
                            f"{choice.doc[:1].lower()}{choice.doc[1:]}" for choice in one.choices)
    doc += f" Only with `{one.only}`." if one.only else ""
    doc += "" if one.filed else " On the line only."
    return f"| `{one.name}` | {one.unit} | {doc} |"


def events_page(table: Sequence[Event]) -> str:
    """Reference of the events, in Markdown."""
    lines = [
        "# Events", "",
        "`events.jsonl` has the events of a run, one JSON object in each line, in order. Every "
        "object has `cycle` (clocks since reset), `t` (s), `event`, `line` (of the source text) "
        "and `pos` (mm for each axis, by the coders, in the program frame in force). The fields "
        "below follow.", "",
        "On the link an event is a line `[E:name,cycle,line,x,y,z,…]` with a short name. All "
        "numbers are decimal, places in pulses, speeds in µm/min, and the fields have the same "
        "order. Blocks that follow each other closely are compact events "
        "(`softcore/firmware/link/output.h`)."]
    for one in table:
        lines += ["", f"## `{one.name}`", "", one.doc]
        if not one.filed and one.word:
            lines[-1] += " `events.jsonl` does not have it."
        if one.word:
            lines[-1] += f" On the line: `{one.word}`."
        if one.number:
            lines[-1] += f" In the gateware's queue: {one.number}."
            lines[-1] += "".join(f" `{key}`: {getattr(one, key)}." for key in (
                "detail", "first", "second") if getattr(one, key))
        if one.fields:
            lines += ["", "| field | unit | meaning |", "| --- | --- | --- |",
                      *map(_field_row, one.fields)]
    return "\n".join(lines) + "\n"


def conditions_header(table: Sequence[Condition], usual: Voltages = USUAL) -> str:
    """Built-in conditions as initialisers of the firmware's rows, in C."""
    common = ", ".join(f".{name} = {value}" for name, value in vars(usual).items())
    lines = [
        "#pragma once", "",
        f"#define CONDITIONS_ENTERED {ENTERED}   /* rows that can be entered */",
        f"#define CONDITIONS_IP_MA {IP_MA}   /* one IP */",
        f"#define CONDITIONS_MAX_MA {1000 * CURRENT_MAX_A}    /* highest current, if the machine "
        "sets no other */",
        f"#define CONDITIONS_LEVELS {LEVELS}",
        f"#define CONDITIONS_PLANNED {PLANNED}  /* a planned condition has this number + IP */", "",
        "/* Defaults of a row. */",
        f"#define CONDITIONS_USUAL {common}", "", "#define CONDITIONS_BUILT_IN \\"]
    rows = [f"    {{.number = {row.number}, .milli_ip = {row.milli_ip}, .on_us = {row.on_us}, "
            f".off_us = {row.off_us}, .rest_us = {row.rest_us}, "
            f".negative = {str(row.negative).lower()}, \\\n     "
            + (f".from_ignition = true, .wait_us = {row.wait_us}, " if row.from_ignition else "")
            + "CONDITIONS_USUAL}"
            for row in table]
    return "\n".join([*lines, ", \\\n".join(rows)]) + "\n"


def conditions_page(table: Sequence[Condition], usual: Voltages = USUAL) -> str:
    """Reference of the built-in conditions, in Markdown."""
    lines = [
        "# Machining conditions", "",
        f"`C` with a number selects one of these conditions, or one of up to {ENTERED} that were "
        f"entered with G10 ([words](programs.md)). One IP is {IP_MA / 1000:g} A. The additional "
        "off-time follows an arc or a short. The first conditions are for copper on steel "
        "in hydrocarbon oil, from finishing to roughing; those with a negative electrode are for "
        "wire. With default settings, pulses of 510 end before the comparators are read: see `C` "
        "in [words](programs.md). The on-time of most counts from the gate, that of some [from the "
        "ignition](gap.md#on-time-from-the-ignition), with a longest wait for it.", "",
        "| C | IP | A | on, us | off, us | additional off, us | electrode | wait, us |",
        f"|{' --- |' * 8}"]
    lines += [f"| {row.number} | {row.milli_ip / 1000:g} | {row.milli_ip * IP_MA / 10**6:g} "
              f"| {row.on_us} | {row.off_us} | {row.rest_us} "
              f"| {'negative' if row.negative else 'positive'} "
              f"| {row.wait_us or row.on_us if row.from_ignition else 'from the gate'} |"
              for row in table]
    lines += ["", f"All have an open voltage of {usual.open_v} V. The gap is open above "
              f"{usual.open_percent} % of it, burns an arc below {usual.arc_v} V and is shorted "
              f"below {usual.short_v} V. A step of the servo is {usual.step} pulses."]
    return "\n".join(lines) + "\n"
