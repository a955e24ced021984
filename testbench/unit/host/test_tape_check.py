# SPDX-License-Identifier: Apache-2.0
"""A check judges a machine's clock, settings and travel, and tells what others read otherwise."""

import dataclasses

import pytest

from host.errors import TapeError, UsageError
from host.machines import machine as machines
from host.tape.check import check
from host.tape.codes import EIA
from host.tape.notes import notes
from host.tape.tape import encode

SINKER, WIRE = (machines.load(name) for name in ("sinker", "wire"))


def refused(text, machine, mdi=()):
    with pytest.raises(TapeError) as raised:
        check(encode(text), mdi, machine)
    return str(raised.value)


def test_travel_is_that_of_the_machine_from_where_it_starts():
    """The sinker stands 0.1 mm above Z 0, 100 mm below the upper end of its jump axis."""
    text = "%\nG00 Z100.1\nZ100.1001\nM02\n"
    assert check(encode(text)) == 3
    assert check(encode(text), (), WIRE) == 3, "its Z ends at 299 mm"
    assert refused(text, SINKER) == "Block 3, line 3, character 1: Z is beyond the travel."
    assert "X is beyond" in refused("G00 X-299.0001\nM02", SINKER)
    assert "the arc goes beyond the travel of X" in refused(
        "G00 X298.\nG02 X298. Y-4. R2. F60\nM02", SINKER)
    assert check(encode(text)) == 3, "what was judged before is no more"


def test_a_line_by_hand_may_move_the_zero_and_the_ends():
    text = "G00 Z100.2\nM02"
    assert "beyond" in refused(text, SINKER)
    assert check(encode(text), ["G92 Z0.3"], SINKER) == 2


def test_speed_and_clock_are_those_of_the_machine():
    assert check(encode("G01 X1. F1200\nM02"), (), SINKER) == 2
    assert "above the machine's 900 mm/min" in refused("G01 X1. F1200\nM02", WIRE)
    slow = dataclasses.replace(SINKER, tables=SINKER.tables | {"clock_hz": 200_000})
    assert check(encode("C130 M03\nM02"), (), SINKER) == 2
    assert "is above the machine's" in refused("G01 X1. F1800\nM02", slow)


def test_a_setting_that_the_controller_refuses_is_the_machines():
    odd = dataclasses.replace(SINKER, tables=SINKER.tables | {"settings": {"9999": 1}})
    with pytest.raises(UsageError, match=r"^machine sinker: settings.9999 is refused by the cont"):
        check(encode("M02"), (), odd)


@pytest.mark.parametrize(("text", "told"), [
    ("G00 X10 Y5.\nG01 X3 Y0 F60\nM02", ["line 1: X10 has no decimal point and counts whole mill"
                                       "imetres or inches, as 2 words do; "]),
    ("%\n(X9)\nG00 X0\n\n(two)\nG04P5\nG04 P7\nM02", ["line 6: P of G04 counts milliseconds, and "
                                                     "waits 5 ms; grbl and LinuxCNC wait 5 s."]),
    ("F60. G20 G01 X.1\nG20 F5.\nM02", ["line 1: F counts in the unit of its own block, G20"]),
    ("G20\nF5. G20 G01 X.1\nM02", []),
    ("G36 R300 L1 H600 E60 Q1\nG10 C900 I3 P50 Q50\nG38 P500 L2 R300 H600\nG04 X2\nM02", []),
    ("M98 P1\nM02\nO1\nG00 X1\nM99", ["line 4: X1 has no decimal point"]),
])
@pytest.mark.parametrize("code", ["iso", "eia"])
def test_what_other_controls_read_otherwise_is_told_once(text, told, code):
    tape = encode(text) if code == "iso" else encode(text, EIA)
    check(tape)
    said = list(notes(tape))
    assert len(said) == len(told), said
    assert all(one.startswith(begin) for one, begin in zip(said, told, strict=True)), said
