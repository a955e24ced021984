# SPDX-License-Identifier: Apache-2.0
"""Machine files: what they give, and what of them is refused."""

import re

import pytest

from host.errors import UsageError
from host.machine import BOUNDS, BUILT_IN, WORDS, load
from testbench.native import station
from testbench.native.station import parameters

SINKER = (BUILT_IN / "sinker.toml").read_text(encoding="utf-8")
WIRE = (BUILT_IN / "wire.toml").read_text(encoding="utf-8")


def test_machines_give_every_parameter_of_the_plant():
    """So that none of its numbers is a default of the C++."""
    plant = (BUILT_IN / "plant.cpp").read_text(encoding="utf-8")
    names = {name for name in re.findall(r'p\["([\w.]+)"\] = &', plant)
             if not name.startswith("force.")}
    given = {kind: {name for name, _ in parameters(load(kind).tables)
                    if not re.match(r"stock\.(at_mm|width_um)_\d+$", name)}
             for kind in ("sinker", "wire")}
    assert given["sinker"] | given["wire"] == names
    assert not BOUNDS.keys() - names
    # What only the wire machine has is its own part of the plant; the rest is what both share.
    own = plant[plant.index('p["wire.diameter_mm"]'):plant.index('p["force.short"]')]
    wire = {name for name in names if f'p["{name}"]' in own}
    assert given["sinker"] == names - wire
    assert given["wire"] - wire <= given["sinker"]
    assert wire <= given["wire"]


@pytest.mark.parametrize("key", ["kind", "stock.kind"])
def test_words_of_a_machine_are_those_of_the_plant(workdir, key):
    assert WORDS == station.WORDS
    path = workdir / "odd.toml"
    path.write_text(re.sub(rf'^{key[-4:]} = "{WORDS[key][key == "kind"]}"', f'{key[-4:]} = "odd"',
                           WIRE, flags=re.M))
    with pytest.raises(UsageError, match=rf"^machine odd: {key} must be one of {WORDS[key][0]}, "):
        load(str(path))


def test_a_file_without_a_kind_is_a_sinker(workdir):
    path = workdir / "plain.toml"
    path.write_text(SINKER.replace('kind = "sinker"\n', ""))
    assert load(str(path)).kind == "sinker"
    assert load("wire").kind == "wire"


@pytest.mark.parametrize("steps", [
    "3", "[]", "[3]", "[[0.0]]", '[[0.0, "a"]]', "[[0.0, -1.0]]", "[[1.0, 3.0], [1.0, 4.0]]",
    "[" + ", ".join(f"[{n}, 1]" for n in range(17)) + "]"])
def test_stock_that_is_none_is_refused(workdir, steps):
    path = workdir / "odd.toml"
    path.write_text(WIRE.replace("steps = [[0.0, 30.0]]", f"steps = {steps}"))
    with pytest.raises(UsageError, match=r"^machine odd: stock\.steps must be 1 to 16 pairs"):
        load(str(path))


def test_the_program_begins_where_the_machine_stands(workdir):
    path = workdir / "aside.toml"
    path.write_text(WIRE.replace("start_y_mm = 0.0", "start_y_mm = -0.25"))
    assert load(str(path)).start_mm == {"x": 0.0, "y": -0.25, "z": 0.0}
    assert load("sinker").start_mm == {"x": 0.0, "y": 0.0, "z": 0.1}
