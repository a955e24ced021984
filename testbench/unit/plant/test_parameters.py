# SPDX-License-Identifier: Apache-2.0
"""The numbers of a machine are defined once: the generated header follows."""

import pytest
from pydantic import Field, create_model

from host.machines.machine import load
from host.machines.machine_file import MACHINES, SinkerFile, SinkerGap, entries
from testbench.native.alone import Alone
from testbench.plant import generate


def altered(**numbers):
    """Models of the files, with more numbers in the sinker's gap."""
    gap = create_model("Gap", __base__=SinkerGap, **numbers)
    return MACHINES | {"sinker": create_model("File", __base__=SinkerFile, gap=(gap, ...))}


def number(meaning):
    return (float, Field(ge=0, le=1, description=meaning, json_schema_extra={"unit": "mm²"}))


def test_the_header_is_not_stale():
    assert generate.OUTPUT.read_text(encoding="utf-8") == generate.parameters(), \
        "run python -m testbench.plant.generate"


def test_what_the_model_says_of_a_number_is_what_the_header_says():
    header = generate.parameters(altered(area_mm2=number("What faces the work.")))
    assert "    // What faces the work. [mm²]\n    double area_mm2 = 100.0;\n" in header
    assert "Area of the electrode." not in header


def test_a_number_that_no_machine_gives_is_refused():
    with pytest.raises(ValueError, match=r"no built-in machine has the number gap\.taper_mm2$"):
        generate.parameters(altered(taper_mm2=number("Area of the sides.")))


@pytest.mark.parametrize("kind", MACHINES)
def test_the_plant_has_every_number_of_a_machine_as_its_file_gives_it(kind):
    tables = load(kind).tables
    plant = Alone(machine=tables)
    seen = 0
    for name, field in entries(MACHINES[kind]):
        outer, _, inner = name.rpartition(".")
        value = (tables.get(outer, {}) if outer else tables).get(inner, field.default)
        if field.annotation is float:
            assert plant.get(name) == value, name
            seen += 1
    assert seen > 60


def test_a_name_that_no_machine_has_is_refused():
    with pytest.raises(ValueError, match=r"no parameter .gap\.taper_mm2."):
        Alone(machine=load("sinker").tables).set("gap.taper_mm2", 1)
