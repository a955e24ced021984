# SPDX-License-Identifier: Apache-2.0
"""The rooms of the firmware: includes and calls go one way, without a circle.

Includes are read from the sources, calls from the symbols of the compiled objects: a symbol that a
module needs is a call to the module that defines it. The registers in `hal` are compiled for the
target only: there every name in the source counts. A module is a source with the header of the same
name.
"""

import re
import struct
from functools import cache
from itertools import product
from pathlib import Path

import pytest

from softcore import image

SOURCES = image.SOURCES

# From a room to those below it. `hal` is the interface and its registers; `pc`, the model of the
# hardware for computers, may use every room.
BELOW = {
    "pc": {"app", "link", "interp", "path", "gap", "roughing", "store", "base", "hal"},
    "app": {"link", "interp", "path", "gap", "roughing", "store", "base", "hal"},
    "interp": {"roughing", "gap", "base", "hal"},
    "roughing": {"gap", "base", "hal"},
    "link": {"base", "hal"},
    "path": {"base", "hal"},
    "gap": {"base", "hal"},
    "store": {"hal"},
    "base": {"hal"},
    "hal": set(),
}
# Symbols that the linker script, the compiler or the machine's start-up provide, or call.
START = {"main", "trap"}
COMPILERS = {"stdarg.h", "stdbool.h", "stddef.h", "stdint.h"}   # headers that are not ours
COMPUTERS = COMPILERS | {"stdio.h", "stdlib.h", "string.h"}     # for `pc`
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\])*\"", re.S)


def modules():
    """Module, as its path without the ending, of every source and header."""
    return sorted({path.relative_to(SOURCES).with_suffix("").as_posix()
                   for path in SOURCES.rglob("*.[ch]")})


@cache
def includes():
    """Arrows of the includes: from module, to module."""
    arrows = set()
    for path in SOURCES.rglob("*.[ch]"):
        own = path.relative_to(SOURCES).with_suffix("").as_posix()
        arrows |= {(own, name) for name in included(path.read_text(), own) if name != own}
    return arrows


def included(text, own):
    """Modules whose headers a source includes. Each is named by its path from the sources."""
    for quote, name in re.findall(r"^\s*#\s*include(?:_next)?\s*([<\"]?)([^>\"\n]*)", text, re.M):
        if quote == "<" and name in (COMPUTERS if room(own) == "pc" else COMPILERS):
            continue
        assert quote == '"', f"{own} includes {name} by another way"
        assert (SOURCES / name).is_file(), f"{own} includes {name} by another way"
        assert name.endswith(".h"), f"{own} includes {name}, which is no header"
        yield name.removesuffix(".h")


def symbols(data):
    """Names that an ELF object of 64 bits defines for others, and those that it needs."""
    assert data[:6] == b"\x7fELF\x02\x01", "an object of this computer"
    table, = struct.unpack_from("<Q", data, 40)
    size, count = struct.unpack_from("<HH", data, 58)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, table + size * k) for k in range(count)]
    defined, needed = set(), set()
    for section in sections:
        if section[1] != 2:     # SHT_SYMTAB
            continue
        strings = sections[section[6]][4]
        for at in range(section[4], section[4] + section[5], 24):
            name, info, _, place = struct.unpack_from("<IBBH", data, at)
            text = data[strings + name:data.index(b"\0", strings + name)].decode()
            if text and info >> 4:      # not local
                (defined if place else needed).add(text)
    return defined, needed


@pytest.fixture(scope="module")
def objects():
    """Per module the symbols that it defines, and those that it needs.

    In `hal` these are all names in the source, and it defines none but those of `hal.h`.
    """
    registers = sorted((SOURCES / "hal").glob("*.c"))
    sources = sorted(set(SOURCES.rglob("*.c")) - set(registers))
    found = {path: symbols(made.read_bytes())
             for path, made in zip(sources, image.host_objects(sources), strict=True)}
    found |= {path: (set(), names_in(path.read_text())) for path in registers}
    return {path.relative_to(SOURCES).with_suffix("").as_posix(): both
            for path, both in found.items()}


def names_in(text):
    """Names in a C source, without its comments and texts."""
    return set(re.findall(r"[A-Za-z_]\w*", COMMENT.sub(" ", text)))


def calls(objects):
    """Arrows of the calls: from module, to module. A name of ``hal.h`` belongs to `hal/hal`."""
    home = {name: module for module, (defined, _) in objects.items() for name in defined}
    arrows = set()
    for module, (_, needed) in objects.items():
        for name in needed:
            to = "hal/hal" if name.startswith("hal_") else home.get(name)
            if to and to != module:
                arrows.add((module, to))
    return arrows


def room(module):
    return module.split("/")[0]


def upward(arrows):
    return sorted((source, to) for source, to in arrows
                  if room(source) != room(to) and room(to) not in BELOW[room(source)])


def circle(arrows):
    """Modules of a circle, in order; empty if there is none."""
    after = {}
    for source, to in arrows:
        after.setdefault(source, []).append(to)
    done, way = set(), []

    def walk(module):
        if module in way:
            return [*way[way.index(module):], module]
        if module in done:
            return []
        way.append(module)
        for to in sorted(after.get(module, ())):
            if found := walk(to):
                return found
        way.pop()
        done.add(module)
        return []

    return next((found for start in sorted(after) if (found := walk(start))), [])


def test_every_source_lives_in_a_room():
    rooms = {room(module) for module in modules()}
    assert rooms == set(BELOW)
    assert not [path for path in SOURCES.iterdir() if path.is_file()]


def test_rooms_stand_above_each_other():
    assert not circle({(above, below) for above, those in BELOW.items() for below in those})


def test_includes_point_down():
    assert len(includes()) > 150
    assert not upward(includes())


def test_calls_point_down(objects):
    arrows = calls(objects)
    assert len(arrows) > 150
    assert not upward(arrows)


def test_no_module_goes_round_in_a_circle(objects):
    """Includes and calls together: a call against an include would make a circle too."""
    assert not circle(includes() | calls(objects))


def prefixes(module):
    """Allowed prefixes of a module's names: its own name, or that of its room."""
    return [f"{word}_" for word in (room(module), Path(module).name)]


def test_exported_names_bear_their_modules_prefix(objects):
    """`pc` has the registers' model and the functions for Python: `hal_`, `gk_` and `host_`."""
    wrong = []
    for module, (defined, _) in objects.items():
        known = ["hal_", "gk_", "host_", "__sanitizer_"] if room(module) == "pc" else \
            prefixes(module)
        wrong += [f"{module}: {name}" for name in sorted(defined - START)
                  if not name.lower().startswith(tuple(known))]
    assert not wrong


def test_an_arrow_up_and_a_circle_are_seen():
    """The checks themselves."""
    assert upward({("base/text", "app/machine"), ("app/machine", "base/text")}) == \
        [("base/text", "app/machine")]
    assert upward({("path/path", "gap/gap")})
    assert circle({("a/x", "a/y"), ("a/y", "b/z"), ("b/z", "a/x")})
    assert not circle({(f"a/{k}", f"a/{m}") for k, m in product(range(5), repeat=2) if k < m})


@pytest.mark.parametrize("line", [
    '#include "app/machine.h"', '  #  include\t"app/machine.h"',
    '#ifdef __riscv\n#include "app/machine.h"'])
def test_every_way_to_include_is_an_arrow(line):
    assert list(included(f"/* first */\n{line}\n", "base/text")) == ["app/machine"]


@pytest.mark.parametrize("line", ["#include <app/machine.h>", '#include "../app/machine.h"',
                                  '#include "app/machine.c"', "#include HEADER",
                                  "#include <stdio.h>"])
def test_other_ways_to_include_are_refused(line):
    with pytest.raises(AssertionError, match=r"^base/text includes "):
        list(included(line, "base/text"))


def test_a_call_from_the_registers_is_an_arrow(objects):
    text = 'void one(void) { machine_run(0); /* gap_start */ print("path_begin"); }'
    planted = objects | {"hal/hal_one": (set(), names_in(text))}
    assert calls(planted) - calls(objects) == {("hal/hal_one", "app/machine")}


def test_symbols_are_read(tmp_path):
    source = tmp_path / "one.c"
    source.write_text("int other_call(void); static int own(void) { return 1; }\n"
                      "int one_value = 3; int one_call(void) { return own() + other_call(); }\n")
    made, = image.host_objects([source])
    assert symbols(made.read_bytes()) == ({"one_value", "one_call"}, {"other_call"})
