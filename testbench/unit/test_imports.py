# SPDX-License-Identifier: Apache-2.0
"""The rooms of the Python packages: imports go one way, and no module goes round in a circle.

Every import counts, also one inside a function. ``test_house`` keeps the packages apart; here are
the modules of all of them, and the rooms of the gateware.
"""

import ast
from itertools import product
from pathlib import Path

from testbench.unit.test_firmware_layers import circle
from testbench.unit.test_house import ROOMS, ROOT, SOURCES

# From a room of the gateware to those below it. A module that stands alone is a room.
BELOW = {
    "controller": {"report", "gap", "motion", "power", "safety", "auxiliary", "members"},
    "report": {"motion", "safety", "lib"},
    "gap": {"motion", "power", "lib"},
    "motion": {"lib"},
    "power": {"lib"},
    "safety": {"lib"},
    "auxiliary": {"lib"},
    "members": {"pads"},
    "pads": {"lib"},
    "lib": set(),
}


def name_of(path: Path) -> str:
    """Name of a module, that of a package for its ``__init__``."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(tree, modules):
    """Yield the modules of the project that a module imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            # A name of a package is a module of it, or stands in its __init__.
            names = [full if (full := f"{node.module}.{alias.name}") in modules else node.module
                     for alias in node.names]
        else:
            continue
        yield from (name for name in names if name in modules)


def arrows():
    """From module, to module: every import within the project."""
    paths = {name_of(path): path for path in SOURCES if path.relative_to(ROOT).parts[0] in ROOMS}
    return {(name, to) for name, path in paths.items()
            for to in imports(ast.parse(path.read_text(encoding="utf-8")), paths) if to != name}


def room(module):
    return module.split(".")[1]


def upward(found):
    """Imports within the gateware that do not go down."""
    inside = [(source, to) for source, to in found
              if source.startswith("rtl.") and to.startswith("rtl.")]
    assert inside
    return sorted((source, to) for source, to in inside
                  if room(source) != room(to) and room(to) not in BELOW[room(source)])


def test_no_module_goes_round_in_a_circle():
    found = arrows()
    assert len(found) > 500
    assert not circle(found)


def test_rooms_of_the_gateware_stand_above_each_other():
    assert not circle({(above, below) for above, those in BELOW.items() for below in those})
    rooms = {path.relative_to(ROOT / "rtl").parts[0].removesuffix(".py") for path in SOURCES
             if path.is_relative_to(ROOT / "rtl")}
    assert rooms - {"__init__"} == set(BELOW)


def test_imports_within_the_gateware_point_down():
    assert not upward(arrows())


def test_an_import_up_and_a_circle_are_seen():
    """The checks themselves."""
    up = ("rtl.motion.retraction", "rtl.gap.gap")
    assert upward({up, ("rtl.gap.gap", "rtl.motion.motion")}) == [up]
    assert circle({("a.x", "a.y"), ("a.y", "b.z"), ("b.z", "a.x")})
    assert not circle({(f"a.{k}", f"a.{m}") for k, m in product(range(5), repeat=2) if k < m})


def test_imports_are_read():
    modules = {"a", "a.b", "c"}
    text = "import c\ndef f():\n    from a import b\nfrom a import other\nimport json\n"
    assert sorted(imports(ast.parse(text), modules)) == ["a", "a.b", "c"]
