# SPDX-License-Identifier: Apache-2.0
"""Write the pages that are made from the program itself: ``python -m host.pages``."""

import inspect
from collections.abc import Callable, Iterator
from pathlib import Path

import typer
from pydantic.fields import FieldInfo
from typer.cli import get_docs_for_click

from host.cli import app
from host.machines.axis_tables import LARGEST_PITCH_UM
from host.machines.machine_file import MACHINES, STEPS, WORDS, MachineFile, Table, said_range
from host.places import ROOT
from softcore.tables.settings import PITCH_POINTS

__all__ = ["COMMAND_LINE", "MACHINE_FILE", "PAGES", "command_line", "machine_file"]

REFERENCE = ROOT / "docs" / "reference"
COMMAND_LINE = REFERENCE / "command-line.md"
MACHINE_FILE = REFERENCE / "machine-file.md"


def _notice(source: str) -> str:
    return f"<!-- Generated from {source} by `python -m host.pages`; do not edit. -->\n"


def command_line() -> str:
    """Every command with its options, as Markdown."""
    command = typer.main.get_command(app)
    context = typer.Context(command, info_name="gapkeeper")
    text = get_docs_for_click(obj=command, ctx=context, name="gapkeeper", title="Command line")
    return _notice("host/cli.py") + text.replace(f"{ROOT}/", "").rstrip() + "\n"


def machine_file() -> str:
    """Every number of a machine's file, with unit, range and meaning, as Markdown."""
    lines = [
        "# A machine's file", "",
        "`gapkeeper run --machine FILE` reads a machine from a TOML file; see "
        "[Describe your machine](../how-to/describe-a-machine.md). Every number below must be "
        "given, but for those of the other machines and of the tables `[x]`, `[y]` and `[z]`, and "
        "nothing else may stand in the file. Both ends of a range are allowed.", "",
        *_rows(dict(MACHINES), "")]
    for name in dict.fromkeys(name for file in MACHINES.values() for name in file.model_fields):
        tables = {machine: table for machine, file in MACHINES.items()
                  if (table := _table(file.model_fields.get(name)))}
        if tables:
            lines += ["", f"## `[{name}]`", "", _title(tables), "", *_rows(tables, f"{name}.")]
    settings = MachineFile.model_fields["settings"].description
    lines += ["", "## `[settings]`", "", f"{settings} May be empty or left out. Both are whole "
              "numbers of at most 10 digits; the first has no zeros before it."]
    return _notice("host/machines/machine_file.py") + "\n".join(lines) + "\n"


def _table(field: FieldInfo | None) -> type[Table] | None:
    """Model of a field that is a table, else None."""
    found = field.annotation if field else None
    return found if isinstance(found, type) and issubclass(found, Table) else None


def _title(tables: dict[str, type[Table]]) -> str:
    """Description of a table, with the machine if only one has it."""
    first, *others = dict.fromkeys(tables.values())
    only = "" if len(tables) > 1 else f" Only the machine `{next(iter(tables))}` has this table."
    return (inspect.getdoc(first.__base__ if others else first) or "") + only


def _rows(tables: dict[str, type[Table]], prefix: str) -> Iterator[str]:
    """Rows of one table over several machines; a number that not all have names its machine."""
    having: dict[str, list[str]] = {}
    found: dict[str, FieldInfo] = {}
    for machine, table in tables.items():
        for name, field in table.model_fields.items():
            if name != "settings" and not _table(field):
                having.setdefault(name, []).append(machine)
                found.setdefault(name, field)
    shared = all(len(machines) == len(tables) for machines in having.values())
    columns = ["number", "unit", "range", *([] if shared else ["machine"]), "meaning"]
    yield f"| {' | '.join(columns)} |"
    yield f"|{' --- |' * len(columns)}"
    for name, field in found.items():
        whose = "all" if len(having[name]) == len(tables) else ", ".join(having[name])
        yield (f"| `{name}` | {_unit(field)} | {_range(prefix + name, field)} | "
               f"{'' if shared else f'{whose} | '}{field.description} |")


def _unit(field: FieldInfo) -> str:
    extra = field.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def _range(key: str, field: FieldInfo) -> str:
    if key in WORDS:
        return ", ".join(f"`{word}`" for word in WORDS[key])
    if key == "stock.steps":
        return f"1 to {STEPS} pairs"
    if key.endswith(".pitch_error_um"):
        return f"0 or 2 to {PITCH_POINTS} numbers, ±{LARGEST_PITCH_UM}"
    return said_range(field, lambda bound: f"{bound:,}".replace(
        ",", "\N{NARROW NO-BREAK SPACE}"))


PAGES: dict[Path, Callable[[], str]] = {COMMAND_LINE: command_line, MACHINE_FILE: machine_file}

if __name__ == "__main__":
    for path, made in PAGES.items():
        path.write_text(made(), encoding="utf-8")
