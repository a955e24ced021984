# SPDX-License-Identifier: Apache-2.0
"""The rooms of the firmware: includes go from a room to those below, but for arrows known by name.

A module is a source with the header of its name.
"""

import re
from functools import cache

from softcore import image

SOURCES = image.SOURCES

# From a room to those below it; `pc`, the model of the hardware, stands outside and may know all.
BELOW = {
    "pc": {"app", "link", "interp", "path", "gap", "roughing", "base", "hal"},
    "app": {"link", "interp", "path", "gap", "roughing", "base", "hal"},
    "interp": {"roughing", "gap", "base", "hal"},
    "roughing": {"gap", "base", "hal"},
    "link": {"base", "hal"},
    "path": {"base", "hal"},
    "gap": {"base", "hal"},
    "base": {"hal"},
    "hal": set(),
}

# Arrows up that are still to be cut: this list gets shorter only.
UP = {
    "base/settings": {"gap/gap"},
    "gap/gap": {"app/events", "app/machine", "link/output", "path/path"},
    "gap/law": {"interp/block"},
    "gap/series": {"app/events", "app/program", "link/output"},
    "link/frame": {"app/program"},
    "link/lines": {"app/program"},
    "link/link": {"app/events", "app/execute", "app/machine", "app/program", "app/watch",
                  "path/path", "roughing/planner"},
    "roughing/planner": {"app/program", "link/link", "link/output"},
}


@cache
def includes():
    """Arrows of the includes: from module, to module."""
    arrows = set()
    for path in SOURCES.rglob("*.[ch]"):
        own = path.relative_to(SOURCES).with_suffix("").as_posix()
        for name in re.findall(r'^#include "(.*)\.h"', path.read_text(), re.M):
            assert (SOURCES / f"{name}.h").exists(), f"{own} includes {name}.h by another way"
            if name != own:
                arrows.add((own, name))
    return arrows


def room(module):
    return module.split("/")[0]


def upward(arrows):
    return {(source, to) for source, to in arrows
            if room(source) != room(to) and room(to) not in BELOW[room(source)]}


def test_every_source_lives_in_a_room():
    assert {path.parent.name for path in SOURCES.rglob("*.[chS]")} == set(BELOW)
    assert not [path for path in SOURCES.iterdir() if path.is_file()]


def test_includes_point_down_but_for_those_that_are_known():
    assert len(includes()) > 150
    assert upward(includes()) == {(source, to) for source, those in UP.items() for to in those}


def test_an_arrow_up_is_seen():
    assert upward({("base/text", "app/machine"), ("app/machine", "base/text")}) == \
        {("base/text", "app/machine")}
