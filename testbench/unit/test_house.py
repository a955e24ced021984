# SPDX-License-Identifier: Apache-2.0
"""House rules a reviewer should not have to remember: who may import whom, and retired names."""

import ast
import re
from pathlib import Path

import pytest

from softcore.generate import OUTPUTS

ROOT = Path(__file__).parents[2]
ROOMS = ("rtl", "softcore", "host", "testbench", "constraints")
CODE = {".py", ".c", ".h", ".S", ".ld", ".cpp", ".hpp", ".v", ".sv", ".vlt", ".toml"}
TEXT = CODE | {"", ".md", ".nc", ".lpf", ".j2", ".json"}


def files(suffixes):
    """Files of the project by suffix, in a fixed order; nothing that was made."""
    made = {"build", "__pycache__"}
    inside = [path for room in (*ROOMS, "tapes", ".ci") for path in (ROOT / room).rglob("*")]
    return sorted(path for path in inside + list(ROOT.glob("*"))
                  if path.is_file() and path.suffix in suffixes and not made & set(path.parts))


SOURCES = files({".py"})
GENERATED = set(OUTPUTS)

# A room may import itself and the rooms named here.
ALLOWED = {
    "rtl": set(),
    "constraints": set(),
    "softcore": {"rtl", "constraints"},
    "host": {"softcore", "constraints"},
    "testbench": {"rtl", "constraints", "softcore", "host"},
}
# The one door from the host to the simulated machine, and what may come through it.
DOOR = {("host/simulation.py", "testbench.native")}
RETIRED = {
    "Record": "use lib.data for storage, lib.wiring for ports (accepted silently by 0.5)",
    "Memory": "import lib.memory and write memory.Memory",
    "Elaboratable": "use wiring.Component",
}


def name_of(path):
    return str(path.relative_to(ROOT))


def imported(tree):
    """Yield the modules a file imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            yield node.module


def forbidden(path, tree):
    """Yield what a file at ``path`` must not import."""
    top = path.split("/")[0]
    if top not in ALLOWED:
        return
    plain = path.startswith(("testbench/models/", "host/")) or path.endswith(
        ("/regmap.py", "/linkmap.py", "/registers.py"))
    foreign = set(ALLOWED) - {top} - ALLOWED[top]
    for name in imported(tree):
        if name.split(".")[0] in foreign and (path, name) not in DOOR:
            yield f"{top} must not import {name}"
        if plain and name.startswith("amaranth"):
            yield f"{name}: plain Python only here"


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_dependencies_point_one_way(path):
    assert not list(forbidden(name_of(path), ast.parse(path.read_text())))


@pytest.mark.parametrize(("path", "line"), [
    ("rtl/motion/ramp.py",         "import softcore.regmap"),
    ("rtl/machine.py",             "from host import tape"),
    ("constraints/ulx3s.py",       "from rtl.machine import Machine"),
    ("softcore/soc.py",            "from host.link import Link"),
    ("host/run.py",                "from testbench.native import start"),
    ("host/run.py",                "import amaranth"),
    ("host/simulation.py",         "import testbench.plant"),
    ("testbench/models/ramp.py",   "from amaranth.hdl import Signal"),
    ("softcore/regmap.py",         "import amaranth"),
])
def test_a_planted_violation_is_found(path, line):
    assert len(list(forbidden(path, ast.parse(line)))) == 1


@pytest.mark.parametrize("path", [p for p in SOURCES if name_of(p).startswith("rtl/")], ids=name_of)
def test_gateware_uses_no_retired_name(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Name) and node.id in RETIRED:
            pytest.fail(f"line {node.lineno}: {node.id}: {RETIRED[node.id]}")


@pytest.mark.parametrize("path", [p for p in SOURCES if name_of(p).startswith("host/")],
                         ids=name_of)
def test_texts_are_in_one_encoding_everywhere(path):
    """Not in what the user's computer takes for granted."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and (
                node.func.attr in ("read_text", "write_text")):
            assert "encoding" in [word.arg for word in node.keywords], f"line {node.lineno}"


@pytest.mark.parametrize("path", files(CODE) + [ROOT / "Makefile", ROOT / ".ci" / "run"],
                         ids=name_of)
def test_source_starts_with_its_licence(path):
    lines = path.read_text().splitlines() or ["Generated from nothing: empty."]
    first = lines[1] if lines[0].startswith("#!") else lines[0]
    assert "SPDX-License-Identifier: Apache-2.0" in first or "Generated from" in first


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_source_says_what_it_is(path):
    if path.name != "__init__.py":
        assert ast.get_docstring(ast.parse(path.read_text()))


@pytest.mark.parametrize("path", [path for path in files(CODE - {".toml"})
                                  if path not in GENERATED], ids=name_of)
def test_file_can_be_read_in_one_sitting(path):
    assert len(path.read_text().splitlines()) <= 500


@pytest.mark.parametrize("path", files(TEXT), ids=name_of)
def test_names_no_place_of_one_machine(path):
    found = re.search(r"/(?:tmp|work|home|root|Users)/\S*", path.read_text())
    assert not found, f"{found} exists on one machine only"


@pytest.mark.parametrize("path", files(CODE), ids=name_of)
def test_comments_defer_nothing(path):
    words = ["TO" + "DO", "FIX" + "ME", "X" * 3, "no" + "qa"]
    assert not [word for word in words if word in path.read_text()]


def test_dependencies_are_pinned_and_give_a_reason():
    lines = (ROOT / "pyproject.toml").read_text().splitlines()
    entries = [line for line in lines if re.match(r'    "[a-z][\w\[\]-]*[=<>~]', line)]
    assert len(entries) >= 15
    for line in entries:
        assert re.fullmatch(r'    "[\w\[\]-]+==[\w.]+", +# \S.{10,}', line), line
