# SPDX-License-Identifier: Apache-2.0
"""What is made of the tables in ``softcore.tables``: C for the firmware, and pages.

Each function takes its table and gives the text of one file, without the notice at its head.
"""

from collections.abc import Iterable, Sequence

from softcore.tables.faults import FAULTS, PARTS, Fault
from softcore.tables.references import filled
from softcore.tables.settings import GROUPS, SETTINGS, Setting

__all__ = ["faults_header", "faults_page", "settings_header", "settings_page", "settings_source"]


def _string(text: str) -> str:
    """A C string."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _enum(name: str, members: Iterable[str]) -> list[str]:
    return ["typedef enum {", *(f"    {member}," for member in members), f"}} {name};"]


def grouped(number: int) -> str:
    """A number for reading: thousands apart by a narrow space."""
    return f"{number:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")


def settings_header(table: Sequence[Setting]) -> str:
    """Names of the settings, and what their table holds, in C."""
    lines = ["#pragma once", "#include <stdbool.h>", "#include <stdint.h>", ""]
    lines += _enum("setting", [*(f"SET_{setting.name.upper()}" for setting in table), "SETTINGS"])
    lines += ["", "/* What has to be done again after a change. */"]
    lines += _enum("setting_group", (f"GROUP_{group.upper()}" for group in GROUPS))
    lines += [
        "",
        "typedef struct {",
        "    uint32_t initial, lowest, highest;",
        "    uint16_t number;        /* that of the lines `$number=value` */",
        "    uint8_t group;",
        "    bool guards;            /* locked while the machine moves or machines */",
        "    const char *title;",
        "    const char *unit;       /* empty for a pure number */",
        "    const char *guard;      /* what the value 0 switches off; 0 if nothing */",
        "} settings_table_row;",
        "",
        "extern const settings_table_row SETTINGS_TABLE_ROWS[SETTINGS];",
    ]
    return "\n".join(lines) + "\n"


def settings_source(table: Sequence[Setting]) -> str:
    """Rows of the settings, in C."""
    lines = ['#include "base/settings_table.h"', "",
             "const settings_table_row SETTINGS_TABLE_ROWS[SETTINGS] = {"]
    for one in table:
        guard = _string(one.switches_off) if one.switches_off else "0"
        lines += [
            f"    [SET_{one.name.upper()}] = {{{one.default}, {one.lowest}, {one.highest}, "
            f"{one.number}, GROUP_{one.group.upper()}, {str(one.guards).lower()},",
            f"        {_string(one.title)}, {_string(one.unit)}, {guard}}},"]
    return "\n".join([*lines, "};"]) + "\n"


def settings_page(table: Sequence[Setting], faults: Sequence[Fault] = FAULTS) -> str:
    """Reference of the settings, in Markdown."""
    lines = [
        "# Settings", "",
        "Numbers by which a machine and its gap are set up. `$$` lists them, `$number=value` "
        "changes one, and a [machine's file](machine-file.md) gives them in its table "
        "`[settings]`. All values are whole numbers; both ends of a range are allowed. After "
        "power-on every setting has its default.", "",
        "No setting changes while a program runs. Those marked *rest* guard the machine: they "
        "also stay as they are while it moves or machines (" + filled("error {alarm_busy}).", table,
                                                                      faults)]
    for group, title in GROUPS.items():
        lines += ["", f"## {title}", "",
                  "| setting | name | unit | default | range | changes | meaning |",
                  f"|{' --- |' * 7}"]
        lines += [
            f"| `${one.number}` | `{one.name}` | {one.unit} | {grouped(one.default)} "
            f"| {grouped(one.lowest)} to {grouped(one.highest)} "
            f"| {'rest' if one.guards else 'no program'} | {filled(one.meaning, table, faults)} |"
            for one in table if one.group == group]
    return "\n".join(lines) + "\n"


def faults_header(table: Sequence[Fault]) -> str:
    """Codes of what can go wrong, in C, and what is said of it where that is always the same."""
    lines = ["#pragma once", "", "/* Numbers of `error:N` and `ALARM:N`. */"]
    lines += _enum("fault_code", ["FAULT_NONE = 0", *(
        f"FAULT_{one.name.upper()} = {one.number}" for one in table)])
    lines += ["", *(f"#define FAULT_TEXT_{one.name.upper()} \\\n    {_string(one.sentence)}"
                    for one in table if one.spoken)]
    return "\n".join(lines) + "\n"


def faults_page(table: Sequence[Fault], settings: Sequence[Setting] = SETTINGS) -> str:
    """Reference of alarms and errors, in Markdown."""
    lines = [
        "# Alarms and errors", "",
        "`error:N` refuses a line: nothing of it was done. `ALARM:N` ends a program and locks the "
        "machine: the discharge is off, and the axes come to rest. `$X` unlocks it when the cause "
        "is gone. Both have the same numbers. In front of each the controller says where it was "
        "and what exactly was wrong, as `[MSG:…]` or as the event `alarm`.", "",
        "A program that is refused before anything has moved is *rejected* (exit status 4); after "
        "that, or if the machine is at fault, the run ends in *alarm* (exit status 3)."]
    for part, title in PARTS.items():
        lines += ["", f"## {title}"]
        for one in table:
            if one.part == part:
                lines += ["", f"### {one.number}: {one.sentence}", "",
                          f"Cause: {filled(one.cause, settings, table)}", "",
                          f"What to do: {filled(one.remedy, settings, table)}"]
    return "\n".join(lines) + "\n"
