# SPDX-License-Identifier: Apache-2.0
"""What is made of the tables in ``softcore.tables``: C for the firmware, and pages.

Each function takes its table and gives the text of one file, without the notice at its head.
"""

from collections.abc import Iterable, Sequence

from softcore.tables.settings import GROUPS, Setting

__all__ = ["settings_header", "settings_page", "settings_source"]


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


def settings_page(table: Sequence[Setting]) -> str:
    """Reference of the settings, in Markdown."""
    lines = [
        "# Settings", "",
        "Numbers by which a machine and its gap are set up. `$$` lists them, `$number=value` "
        "changes one, and a [machine's file](machine-file.md) gives them in its table "
        "`[settings]`. All values are whole numbers; both ends of a range are allowed. After "
        "power-on every setting has its default.", "",
        "No setting changes while a program runs. Those marked *rest* guard the machine: they "
        "also stay as they are while it moves or machines (alarm 38)."]
    for group, title in GROUPS.items():
        lines += ["", f"## {title}", "",
                  "| setting | name | unit | default | range | changes | meaning |",
                  f"|{' --- |' * 7}"]
        lines += [
            f"| `${one.number}` | `{one.name}` | {one.unit} | {grouped(one.default)} "
            f"| {grouped(one.lowest)} to {grouped(one.highest)} "
            f"| {'rest' if one.guards else 'no program'} | {one.meaning} |"
            for one in table if one.group == group]
    return "\n".join(lines) + "\n"
