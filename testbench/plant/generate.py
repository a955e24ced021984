# SPDX-License-Identifier: Apache-2.0
"""Write the plant's numbers in C++ from the model of a machine's file.

``python -m testbench.plant.generate`` makes ``parameters.hpp``: a struct for each table of the
file, every number with its unit and meaning, and the names by which a test sets it. The initial
value of a number is that of the built-in sinker, or of the wire machine if the sinker has none.
"""

import textwrap
import tomllib
from collections.abc import Iterator
from pathlib import Path

from pydantic.fields import FieldInfo

from host.machines.machine import BUILT_IN
from host.machines.machine_file import MACHINES, STEPS, WORDS, Table, entries

__all__ = ["OUTPUT", "parameters"]

HERE = Path(__file__).parent
OUTPUT = HERE / "parameters.hpp"
NOTICE = ("// Generated from host/machines/machine_file.py by "
          "`python -m testbench.plant.generate`; do not edit.")
COLUMNS = 100
CONTROLLERS = "settings", "pitch_error_um"  # what the plant does not need
PAIRS = "stock.steps"  # a list of pairs: their number, and an array of each half


def _fields(machines: dict[str, type[Table]]) -> dict[str, FieldInfo]:
    """Entries of the machines' files by name; of one name in several files, the first."""
    found: dict[str, FieldInfo] = {}
    for model in machines.values():
        for name, field in entries(model):
            if name.rpartition(".")[2] not in CONTROLLERS:
                found.setdefault(name, field)
    return found


def _start(name: str, machines: dict[str, type[Table]]) -> str:
    """The value that a number starts with."""
    if name in WORDS or name == PAIRS:
        return "0"
    for machine in machines:
        tables = tomllib.loads((BUILT_IN / f"{machine}.toml").read_text(encoding="utf-8"))
        outer, _, inner = name.rpartition(".")
        value = (tables.get(outer, {}) if outer else tables).get(inner)
        if value is not None:
            return repr(float(value))
    if isinstance(default := _fields(machines)[name].default, int | float):
        return repr(float(default))
    raise ValueError(f"no built-in machine has the number {name}")


def _unit(field: FieldInfo) -> str:
    extra = field.json_schema_extra
    unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
    return f" [{unit}]" if unit else ""


def _member(name: str, field: FieldInfo, start: str) -> Iterator[str]:
    if name == PAIRS:
        yield f"    static constexpr std::size_t STEPS = {STEPS};"
    comment = "    // "
    yield from textwrap.wrap(f"{field.description}{_unit(field)}", COLUMNS,
                             initial_indent=comment, subsequent_indent=comment)
    yield f"    double {name.rpartition('.')[2]} = {start};"
    if name == PAIRS:
        yield "    double at_mm[STEPS] = {}, width_um[STEPS] = {};"


def _words() -> Iterator[str]:
    """An enumeration for each number that stands for a word."""
    for name, words in WORDS.items():
        title = "".join(part.title() for part in name.split(".")) if "." in name else "MachineKind"
        yield f"enum class {title} {{ {', '.join(words)} }};  // `{name}`"


def parameters(machines: dict[str, type[Table]] = MACHINES) -> str:
    """The header: structs, and names. ``machines``: models of the files, by built-in machine."""
    tables: dict[str, dict[str, FieldInfo]] = {}
    for name, field in _fields(machines).items():
        tables.setdefault(name.rpartition(".")[0], {})[name] = field
    whole = tables.pop("")
    lines = ["// SPDX-License-Identifier: Apache-2.0", NOTICE, "#pragma once", "",
             "#include <cstddef>", "#include <map>", "#include <string>", "",
             "namespace plant {", "", *_words()]
    for table, members in tables.items():
        lines += ["", f"struct {table.title()}Parameters {{"]
        for name, field in members.items():
            lines += _member(name, field, _start(name, machines))
        lines.append("};")
    lines += ["", "// All that a machine's file says of it.", "struct MachineParameters {"]
    for name, field in whole.items():
        lines += _member(name, field, _start(name, machines))
    lines += [f"    {table.title()}Parameters {table};" for table in tables]
    lines += ["};", "", "// Every number by its name.",
              "inline std::map<std::string, double*> by_name(MachineParameters& p) {",
              "    std::map<std::string, double*> names = {"]
    every = [*whole, *(name for members in tables.values() for name in members)]
    lines += [f'        {{"{name}", &p.{name}}},' for name in every]
    lines += ["    };", "    for (std::size_t i = 0; i < StockParameters::STEPS; ++i) {",
              '        names["stock.at_mm_" + std::to_string(i)] = &p.stock.at_mm[i];',
              '        names["stock.width_um_" + std::to_string(i)] = &p.stock.width_um[i];',
              "    }", "    return names;", "}", "", "}  // namespace plant"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    OUTPUT.write_text(parameters(), encoding="utf-8")
