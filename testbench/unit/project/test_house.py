# SPDX-License-Identifier: Apache-2.0
"""House rules that a reviewer should not have to remember.

Each rule is one test. It reads every file, and names all that break the rule.
"""

import ast
import re
from pathlib import Path

import pytest

from softcore.generate import OUTPUTS
from testbench.plant import generate as plant

ROOT = Path(__file__).parents[3]
ROOMS = ("rtl", "softcore", "host", "testbench", "constraints")
CODE = {".py", ".c", ".h", ".S", ".ld", ".cpp", ".hpp", ".v", ".sv", ".vlt", ".toml"}
LONGEST_FILE = 500  # lines
TEXT = CODE | {"", ".md", ".nc", ".lpf", ".j2", ".json"}


def files(suffixes):
    """Files of the project by suffix, in a fixed order, without build results."""
    made = {"build", "__pycache__"}
    inside = [path for room in (*ROOMS, "docs", "tapes", ".ci", ".github")
              for path in (ROOT / room).rglob("*")]
    return sorted(path for path in inside + list(ROOT.glob("*"))
                  if path.is_file() and path.suffix in suffixes and not made & set(path.parts)
                  and path.name != ".git")  # a file in a second working tree


SOURCES = files({".py"})
GENERATED = {*OUTPUTS, plant.OUTPUT}

# A room may import itself and the rooms named here.
ALLOWED = {
    "rtl": set(),
    "constraints": set(),
    "softcore": {"rtl", "constraints"},
    "host": {"softcore", "constraints"},
    "testbench": {"rtl", "constraints", "softcore", "host"},
}
# The one door from the host to the test bench, and what may come through it.
DOOR = {("host/door.py", "testbench.native")}
# Plain data that a room may read besides: the table of the signals at the pins.
DATA = {("rtl/pads.py", "constraints.pads")}
RETIRED = {
    "Record": "use lib.data for storage, lib.wiring for ports (accepted silently by 0.5)",
    "Memory": "import lib.memory and write memory.Memory",
    "Elaboratable": "use wiring.Component",
}


def name_of(path):
    return str(path.relative_to(ROOT))


def offenders(paths, breaks):
    """A line for each file that breaks a rule: its name, and what ``breaks(path)`` yields."""
    paths = list(paths)
    assert paths, "a rule without a file has checked nothing"
    return "\n".join(f"{name_of(path)}: {what}" for path in paths for what in breaks(path))


def tree_of(path):
    return ast.parse(path.read_text())


def under(room):
    return [path for path in SOURCES if name_of(path).startswith(f"{room}/")]


def imported(tree):
    """Yield the modules a file imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            yield node.module


def forbidden(path, tree):
    """Yield the forbidden imports of a file at ``path``."""
    top = path.split("/")[0]
    if top not in ALLOWED:
        return
    plain = path.startswith(("testbench/models/", "host/", "softcore/tables/",
                             "constraints/pads.py")) or path.endswith(
        ("map.py", "/registers.py", "/render.py"))
    foreign = set(ALLOWED) - {top} - ALLOWED[top]
    for name in imported(tree):
        if name.split(".")[0] in foreign and (path, name) not in DOOR | DATA:
            yield f"{top} must not import {name}"
        if plain and name.startswith("amaranth"):
            yield f"{name}: plain Python only here"


def test_dependencies_point_one_way():
    assert not offenders(SOURCES, lambda path: forbidden(name_of(path), tree_of(path)))


@pytest.mark.parametrize(("path", "line"), [
    ("rtl/motion/ramp.py",         "import softcore.regmap"),
    ("rtl/controller.py",          "from host import tape"),
    ("rtl/controller.py",          "from constraints.pads import PADS"),
    ("rtl/pads.py",                "from constraints import boards"),
    ("constraints/pads.py",        "from amaranth.hdl import Signal"),
    ("constraints/ulx3s.py",       "from rtl.controller import Controller"),
    ("softcore/soc.py",            "from host.link.link import Link"),
    ("host/run/run.py",            "from testbench.native import start"),
    ("host/run/run.py",            "import amaranth"),
    ("host/door.py",               "import testbench.plant"),
    ("testbench/models/ramp.py",   "from amaranth.hdl import Signal"),
    ("softcore/regmap.py",         "import amaranth"),
    ("softcore/tables/faults.py",  "import amaranth"),
])
def test_a_planted_violation_is_found(path, line):
    assert len(list(forbidden(path, ast.parse(line)))) == 1


def test_gateware_uses_no_retired_name():
    def breaks(path):
        return (f"line {node.lineno}: {node.id}: {RETIRED[node.id]}"
                for node in ast.walk(tree_of(path))
                if isinstance(node, ast.Name) and node.id in RETIRED)

    assert not offenders(under("rtl"), breaks)


def test_texts_are_in_one_encoding_everywhere():
    """No file names a path of one computer."""
    def breaks(path):
        return (f"line {node.lineno}: without encoding" for node in ast.walk(tree_of(path))
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
                and node.func.attr in ("read_text", "write_text")
                and "encoding" not in [word.arg for word in node.keywords])

    assert not offenders(under("host"), breaks)


def test_sources_start_with_their_licence():
    def breaks(path):
        lines = path.read_text().splitlines() or ["Generated from nothing: empty."]
        first = lines[1] if lines[0].startswith("#!") else lines[0]
        if "SPDX-License-Identifier: Apache-2.0" not in first and "Generated from" not in first:
            yield "no licence in its first line"

    assert not offenders(files(CODE) + [ROOT / "Makefile", ROOT / ".ci" / "run"], breaks)


def test_sources_say_what_they_are():
    def breaks(path):
        if path.name != "__init__.py" and not ast.get_docstring(tree_of(path)):
            yield "no docstring"

    assert not offenders(SOURCES, breaks)


def test_files_can_be_read_in_one_sitting():
    def breaks(path):
        lines = len(path.read_text().splitlines())
        if lines > LONGEST_FILE:
            yield f"{lines} lines"

    written = [path for path in files(CODE - {".toml"}) if path not in GENERATED]
    assert not offenders(written, breaks)


def test_no_file_names_a_place_of_one_machine():
    def breaks(path):
        if found := re.search(r"/(?:tmp|work|home|root|Users)/\S*", path.read_text()):
            yield f"{found[0]} exists on one machine only"

    assert not offenders(files(TEXT), breaks)


def test_no_file_holds_two_sides_of_a_merge():
    def breaks(path):
        lines = path.read_text().splitlines()
        return (f"line {number}: {line}" for number, line in enumerate(lines, 1)
                if re.match(r"(<{7}|>{7}) ", line))

    assert not offenders(files(TEXT), breaks)


def test_comments_defer_nothing():
    words = ["TO" + "DO", "FIX" + "ME", "X" * 3, "no" + "qa"]
    assert not offenders(files(CODE), lambda path: (word for word in words
                                                    if word in path.read_text()))


def unnamed_patents(path):
    """Places where it is not said which of the four patents is meant."""
    text = re.sub(r"[\s#/*|\"]+", " ", path.read_text())
    for found in re.finditer(r"(?<![-\w])patent", text, re.IGNORECASE):
        before = text[:found.start()].lower()
        if not before.endswith(("first ", "second ", "third ", "fourth ", "four ")):
            yield f"which one? {text[max(0, found.start() - 20):found.end() + 10]}"


def test_a_patent_is_called_by_its_place_in_the_list():
    """The list is on the page ``docs/explanation/four-patents.md``."""
    apart = {"four-patents.md", "test_house.py", "LICENSE"}
    paths = [path for path in files(TEXT) if path.name not in apart]
    assert not offenders(paths, unnamed_patents)


@pytest.mark.parametrize(("line", "broken"), [
    ("as the patent says", True), ("# the fourth\n# patent", False), ("four-patents.md", False)])
def test_a_patent_without_its_place_is_found(tmp_path, line, broken):
    page = tmp_path / "page.md"
    page.write_text(line)
    assert bool([*unnamed_patents(page)]) is broken


def test_dependencies_are_pinned_and_give_a_reason():
    lines = (ROOT / "pyproject.toml").read_text().splitlines()
    entries = [line for line in lines if re.match(r'    "[a-z][\w\[\]-]*[=<>~]', line)]
    assert len(entries) >= 15
    for line in entries:
        assert re.fullmatch(r'    "[\w\[\]-]+==[\w.]+", +# \S.{10,}', line), line
