# SPDX-License-Identifier: Apache-2.0
"""The graph of imports, from the sources: no circle, and only one door into the test bench."""

import ast

import pytest

from testbench.unit.project.test_house import DOOR, ROOT, SOURCES, name_of, tree_of

MODULES = {name_of(path).removesuffix(".py").removesuffix("/__init__").replace("/", "."): path
           for path in SOURCES if path.parent != ROOT}
HOST_ROOMS = {"host.experiments", "host.link", "host.machines", "host.roughing", "host.run",
              "host.study", "host.tape"}
((DOORKEEPER, _),) = DOOR
# From a room of the gateware to those below it. A module outside a folder counts as a room.
BELOW = {
    "controller": {"report", "gap", "motion", "power", "safety", "auxiliary", "members"},
    "report": {"motion", "safety", "lib", "events"},
    "gap": {"motion", "power", "lib"},
    "motion": {"lib", "events"},
    "power": {"lib"},
    "safety": {"lib"},
    "auxiliary": {"lib"},
    "members": {"pads"},
    "pads": {"lib"},
    "events": set(),
    "lib": set(),
}


def targets(node):
    """Yield the modules of the project that an import statement runs."""
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
    elif isinstance(node, ast.ImportFrom):
        # The imported name may be a module, or something within one.
        names = [f"{node.module}.{alias.name}" for alias in node.names]
        names = [name if name in MODULES else node.module for name in names]
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


def rooms(arrows):
    """The same graph between the host's packages; a module outside a package is its own node."""
    def room(name):
        return ".".join(name.split(".")[:2])

    joined = {}
    for name, others in arrows.items():
        joined.setdefault(room(name), set()).update(room(other) for other in others)
    return {name: others - {name} for name, others in joined.items()}


@pytest.fixture(scope="module")
def arrows():
    return graph({name: tree_of(path) for name, path in MODULES.items()})


def test_no_module_imports_itself_by_way_of_others(arrows):
    assert len(arrows) > 200
    assert arrows["host.run.run"] >= {"host.link.link", "host.tape.tape"}
    assert not circle(arrows), " -> ".join(circle(arrows))


def test_the_rooms_of_the_host_are_in_no_circle(arrows):
    """Modules without a circle may still lie in packages with one."""
    host = rooms({name: {other for other in others if other.startswith("host.")}
                  for name, others in arrows.items() if name.startswith("host.")})
    assert set(host) > HOST_ROOMS
    assert not circle(host), " -> ".join(circle(host))


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


def upward(arrows):
    """Imports between rooms of the gateware that do not go down."""
    inside = [(name, other) for name, others in arrows.items() for other in others
              if name.startswith("rtl.") and other.startswith("rtl.")]
    assert inside
    rooms_of = [(name, other, name.split(".")[1], other.split(".")[1]) for name, other in inside]
    return sorted((name, other) for name, other, room, below in rooms_of
                  if room != below and below not in BELOW[room])


def test_rooms_of_the_gateware_stand_above_each_other():
    assert not circle(BELOW)
    found = {path.relative_to(ROOT / "rtl").parts[0].removesuffix(".py") for path in SOURCES
             if path.is_relative_to(ROOT / "rtl")}
    assert found - {"__init__"} == set(BELOW)


def test_imports_within_the_gateware_point_down(arrows):
    assert not upward(arrows)


def test_a_planted_import_up_is_found():
    up = ("rtl.motion.retraction", "rtl.gap.gap")
    assert upward({up[0]: {up[1]}, "rtl.gap.gap": {"rtl.motion.motion"}}) == [up]
