# SPDX-License-Identifier: Apache-2.0
"""The machine that a tape names is the one that it is run on and judged for."""

import pytest

from host.errors import UsageError
from host.machines.machine import built_in
from host.places import ROOT
from host.run import session
from host.tape.machine import machine_named
from host.tape.tape import encode
from testbench.command import gapkeeper

TAPES = sorted((ROOT / "tapes").glob("*.nc"))


def named(folder, text, name="part.nc"):
    path = folder / name
    path.write_text(text)
    return machine_named(path)


@pytest.mark.parametrize("tape", TAPES, ids=lambda path: path.stem)
def test_every_tape_of_ours_names_its_machine_in_all_its_forms(tape):
    machine = machine_named(tape)
    assert machine in built_in()
    assert tape.stem.startswith("wire") == (machine in {"wire", "wall", "relaxation"})
    for form in (tape.with_suffix(".ptp"), tape.with_suffix(".eia.ptp")):
        assert machine_named(form) == machine


@pytest.mark.parametrize(("text", "machine"), [
    ("%\n(machine wall. a wall)\nG21\n%\n", "wall"),
    ("(PART 7)\n( MACHINE  SMALL)\nG21\n", "small"),
    ("%\nG21 (MACHINE WIRE)\n%\n", "wire"),
    ("%\nG21\n(MACHINE WIRE)\n%\n", None),
    ("%\n(MACHINE MINE)\nG21\n%\n", None),
    ("%\n(THE MACHINE WIRE)\nG21\n%\n", None),
    ("", None),
    ("%\n\n\n", None),
])
def test_a_comment_before_the_first_block_names_it(tmp_path, text, machine):
    assert named(tmp_path, text) == machine


def test_what_is_no_tape_names_none(tmp_path):
    (tmp_path / "part.ptp").write_bytes(b"\x00\xff(MACHINE WIRE)")
    assert machine_named(tmp_path / "part.ptp") is None
    (tmp_path / "part.nc").write_bytes(b"(MACHINE WIRE)\0")
    assert machine_named(tmp_path / "part.nc") is None
    assert machine_named(tmp_path / "nothing.nc") is None
    assert machine_named(tmp_path) is None


def test_what_stands_at_a_port_is_not_taken_from_the_tape(tmp_path):
    with pytest.raises(UsageError, match=r"is for the machine wire: say with --machine"):
        session.run_tape_at("socket://nowhere:1", ROOT / "tapes" / "wire_slot.nc", baud=1,
                            machine=None, folder=tmp_path, mdi=[], until_s=None, clock_hz=None,
                            at_start=False, arm=False, reset=False, scope=None, console=None)


def test_a_tape_is_judged_for_it(tmp_path):
    tape = tmp_path / "part.nc"
    for words, judged in (("MACHINE WIRE", "for the machine wire"),
                          ("NO NAME", "travel not judged (--machine)")):
        tape.write_text(f"%\n({words})\nG21 G90\nG00 X1\nM02\n%\n")
        assert gapkeeper("tape", "check", tape).stdout.splitlines()[0].endswith(judged)
    assert encode(tape.read_text())
