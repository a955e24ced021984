# SPDX-License-Identifier: Apache-2.0
"""The graph of imports, from the sources: it goes down, and there is one door into the test bench.

Rooms stand in storeys: a room is a package, or a module outside one, and imports what lies in
storeys below its own.
"""

import ast

import pytest

from testbench.unit.project.test_house import DOOR, ROOT, SOURCES, name_of, tree_of

MODULES = {name_of(path).removesuffix(".py").removesuffix("/__init__").replace("/", "."): path
           for path in SOURCES if path.parent != ROOT}
HOST_ROOMS = {"host.experiments", "host.link", "host.machines", "host.roughing", "host.run",
              "host.study", "host.tape"}
((DOORKEEPER, _),) = DOOR
# Storeys of a package's rooms, the highest first. "" has the packages themselves.
STOREYS: dict[str, tuple[set[str], ...]] = {
    "": ({"docs"}, {"testbench"}, {"host"}, {"softcore"}, {"rtl"}, {"constraints"}),
    "host": (
        {"pages"}, {"cli"},
        {"bench", "bitstream", "bootstrap", "doctor", "experiments", "flash", "panel", "prepare",
         "study"},
        {"tune"}, {"firmware", "roughing", "touch"}, {"run"}, {"door", "scope", "tape", "terminal"},
        {"options"}, {"link", "machines"}, {"alarms", "errors", "places", "words"}),
    "softcore": (
        {"build", "generate"}, {"contents", "image", "render", "top"}, {"soc"},
        {"csr", "flash", "memory", "notice", "regmap", "sleep", "uart"},
        {"cpu", "flashmap", "link_decoder", "safetymap", "scopemap", "texts"}, {"linkmap"},
        {"clock", "pins", "registers", "tables", "tools"}),
    "rtl": (
        {"controller"}, {"members", "report"}, {"gap"}, {"auxiliary", "motion", "power", "safety"},
        {"pads"}, {"events", "lib", "states"}),
    "testbench": (
        {"unit"}, {"bench"}, {"faults"}, {"conftest", "cosim", "formal"},
        {"breaks", "budget", "checkers", "fuzz", "planner", "travel"}, {"corpus", "simulators"},
        {"firmware"}, {"native"},
        {"beside", "cable", "command", "driven", "installed", "live", "models", "piped", "plant",
         "programs", "punch", "quick", "refusal", "seconds", "senders", "some", "stray", "study",
         "tools"}),
}
# The one arrow up: the host runs the simulations of the test bench by its door.
DOORS = {("host.door", "testbench")}
# Exact models are written from the contract: they know no gateware, and little else.
MODELS_KNOW = ("testbench.models", "softcore.tables", "softcore.flash", "softcore.image")
# Where the name of a module is made at run time.
MADE_NAMES = {"testbench/command.py", "testbench/cosim/session.py",
              "testbench/simulators/blocks.py"}
IMPORTERS = {"import_module", "__import__"}


def imported_by_call(node):
    """Names of modules that a call imports; empty for one that is made at run time."""
    called = getattr(node.func, "attr", getattr(node.func, "id", ""))
    if called in IMPORTERS:
        first = node.args[0] if node.args else None
        yield first.value if isinstance(first, ast.Constant) else ""


def targets(node):
    """Yield the modules of the project that an import statement runs."""
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom):
        # The imported name may be a module, or something within one.
        names = [f"{node.module}.{alias.name}" for alias in node.names]
        names = [name if name in MODULES else node.module for name in names]
    elif isinstance(node, ast.Call):
        names = [name for name in imported_by_call(node) if name]
    else:
        return
    yield from (name for name in names if name in MODULES)


def graph(trees):
    """Modules, each with those that it imports anywhere, be it within a function."""
    return {name: {target for node in ast.walk(tree) for target in targets(node)} - {name}
            for name, tree in trees.items()}


def circle(arrows):
    """The modules of a circle in their order, or nothing if there is none."""
    done, way = set(), []

    def visit(name):
        if name in way:
            return way[way.index(name):]
        if name in done:
            return []
        way.append(name)
        found = next(filter(None, map(visit, sorted(arrows.get(name, ())))), [])
        way.pop()
        done.add(name)
        return found

    return next(filter(None, map(visit, sorted(arrows))), [])


def upward(arrows, package, doors=frozenset()):
    """Imports between the rooms of a package that do not go down."""
    depth = package.count(".") + (2 if package else 1)
    storey = {room: number for number, rooms in enumerate(STOREYS[package]) for room in rooms}

    def room(name):
        inside = f"{package}." if package else ""
        return name.split(".")[depth - 1] if name.startswith(inside) and name != package else None

    return sorted((name, other) for name, others in arrows.items() for other in others
                  if room(name) and room(other) and room(name) != room(other)
                  and (name, room(other)) not in doors
                  and storey[room(name)] >= storey[room(other)])


@pytest.fixture(scope="module")
def arrows():
    return graph({name: tree_of(path) for name, path in MODULES.items()})


def test_no_module_imports_itself_by_way_of_others(arrows):
    assert len(arrows) > 200
    assert arrows["host.run.run"] >= {"host.link.link", "host.tape.tape"}
    assert not circle(arrows), " -> ".join(circle(arrows))


@pytest.mark.parametrize("package", STOREYS)
def test_rooms_import_from_below(arrows, package):
    found = {name.split(".")[bool(package)] for name in arrows
             if name.startswith(f"{package}." if package else "")}
    assert found - {""} == set().union(*STOREYS[package])
    assert not upward(arrows, package, DOORS)


def test_models_know_no_gateware(arrows):
    assert not [(name, other) for name, others in arrows.items() for other in others
                if name.startswith("testbench.models") and not other.startswith(MODELS_KNOW)]


def test_tables_are_plain(arrows):
    """Everything may read them: so they read nothing but each other."""
    assert not [(name, other) for name, others in arrows.items() for other in others
                if name.startswith("softcore.tables.") and not other.startswith("softcore.tables.")]


def test_names_of_modules_stand_in_the_source():
    """Else the graph would lack an arrow."""
    made = {name_of(path) for path in SOURCES for node in ast.walk(tree_of(path))
            if isinstance(node, ast.Call) and "" in imported_by_call(node)}
    assert made == MADE_NAMES


def test_a_planted_circle_is_found():
    planted = {"host.tape.tape": "import host.run.run",
               "host.run.run": "def f():\n    from host.link import link",
               "host.link.link": "from host.tape.tape import load"}
    arrows = graph({name: ast.parse(text) for name, text in planted.items()})
    assert sorted(circle(arrows)) == sorted(planted)
    del arrows["host.link.link"]
    assert not circle(arrows)


def names_the_bench(tree):
    """Yield the lines in which code names the test bench: in an import, or in a text."""
    told = {ast.get_docstring(node, clean=False) for node in ast.walk(tree)
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)}
    for node in ast.walk(tree):
        texts = []
        if isinstance(node, ast.Import):
            texts = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            texts = [node.module]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts = [node.value] if node.value not in told else []
        if any(text.startswith("testbench") for text in texts):
            yield node.lineno


def test_the_host_names_the_test_bench_at_its_door_only():
    """Nothing else imports it, runs it as a program, or reads a file of it."""
    naming = {name_of(path): list(names_the_bench(tree_of(path)))
              for path in SOURCES if name_of(path).startswith("host/")}
    assert naming.pop(DOORKEEPER)
    assert not {name: lines for name, lines in naming.items() if lines}


@pytest.mark.parametrize("line", [
    "from testbench.native import start",
    "import testbench",
    'run([executable, "-m", "testbench.bench"])',
    'PLANT = ROOT / "testbench" / "plant"',
])
def test_a_planted_second_door_is_found(line):
    assert list(names_the_bench(ast.parse(line)))


@pytest.mark.parametrize(("name", "other", "package"), [
    ("rtl.motion.retraction", "rtl.gap.gap", "rtl"),
    ("host.roughing.basic", "host.panel.panel", "host"),
    ("host.link.port", "host.flash", "host"),
    ("host.machines.machine", "host.link.link", "host"),
    ("softcore.tables.settings", "softcore.clock", "softcore"),
    ("testbench.checkers.motion", "testbench.unit.rtl.test_arc", "testbench"),
    ("rtl.motion.ramp", "host.errors", ""),
])
def test_a_planted_import_up_is_found(name, other, package):
    assert upward({name: {other}}, package, DOORS) == [(name, other)]
    assert package == "" or not upward({name: {other}}, "", DOORS)


@pytest.mark.parametrize("text", [
    "import host.errors", "def f():\n    from host import errors",
    "from importlib import import_module\nimport_module('host.errors')",
    "__import__('host.errors')"])
def test_every_way_to_import_is_an_arrow(text):
    assert graph({"rtl.motion.ramp": ast.parse(text)}) == {"rtl.motion.ramp": {"host.errors"}}
