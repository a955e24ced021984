# SPDX-License-Identifier: Apache-2.0
"""The machine that a tape names is the one that it is run on and judged for."""

import pytest
from rich.console import Console

from host.errors import UsageError
from host.machines.machine import built_in
from host.places import ROOT
from host.run import session
from host.tape.machine import machine_named
from host.tape.tape import Tape, encode, load
from testbench.command import gapkeeper

TAPES = sorted((ROOT / "tapes").glob("*.nc"))


@pytest.mark.parametrize("tape", TAPES, ids=lambda path: path.stem)
def test_every_tape_of_ours_names_its_machine_in_all_its_forms(tape):
    machine = machine_named(load(tape))
    assert machine in built_in()
    assert tape.stem.startswith("wire") == (machine in {"wire", "wall", "relaxation"})
    for form in (tape.with_suffix(".ptp"), tape.with_suffix(".eia.ptp")):
        assert machine_named(load(form)) == machine


@pytest.mark.parametrize(("text", "machine"), [
    ("%\n(machine wall. a wall)\nG21\n%\n", "wall"),
    ("(PART 7)\n( MACHINE  SMALL)\nG21\n", "small"),
    ("%\nO0001\n(MACHINE WIRE)\nG21\n%\n", "wire"),
    ("%\n:1\nN5 (PART 7) (MACHINE WIRE, OURS)\nG21\n%\n", "wire"),
    ("%\n(MACHINE: WIRE)\nG21\n%\n", "wire"),
    ("%\n;MACHINE WIRE\nG21\n%\n", "wire"),
    ("%\nG21 (MACHINE WIRE)\n%\n", "wire"),
    ("%\n(MACHINE MY-ONE)\nG21\n%\n", "my-one"),
    ("%\n(MACHINE HALF OF THE BLOCK FIRST)\n(MACHINE WIRE)\nG21\n%\n", "wire"),
    ("(MACHINE SMALL)\n%\n(MACHINE WIRE)\nG21\n%\n", "wire"),
    ("(MACHINE SMALL)\n%\nG21\n%\n", None),
    ("%\nG21\n(MACHINE WIRE)\n%\n", None),
    ("%\n(NOT FOR THE MACHINE WIRE)\nG21\n%\n", None),
    ("%\n(MACHINE WIRE.TOML)\nG21\n%\n", "wire"),
])
def test_a_comment_before_the_first_block_names_it(text, machine):
    assert machine_named(encode(text.replace("G21", "G21 M02"))) == machine


def test_a_damaged_tape_names_none():
    sound = encode("%\n(MACHINE WIRE)\nM02\n%\n")
    assert machine_named(sound) == "wire"
    bent = bytearray(sound.rows)
    bent[sound.rows.index(sound.code.punch["W"])] ^= 1
    assert machine_named(Tape(bytes(bent), sound.code)) is None


@pytest.mark.parametrize(("name", "machine", "said"), [
    ("WIRE", "wire", "on the machine wire, which the tape names"),
    ("SINKER", "sinker", ""),
    ("MINE", "sinker", "on the machine sinker: the tape is for the machine mine, which does not"),
])
def test_a_run_is_on_it(tmp_path, monkeypatch, capsys, name, machine, said):
    """Looked at up to the start of a machine."""
    class StartedError(Exception):
        pass

    def start(chosen, **_options):
        raise StartedError(chosen.name)

    monkeypatch.setattr(session.simulation, "start", start)
    (tmp_path / "part.nc").write_text(f"%\n(MACHINE {name})\nG21\nM02\n%\n")

    def run(given):
        with pytest.raises(StartedError) as started:
            session.run_tape(tmp_path / "part.nc", machine=given, seed=1, waves=False,
                             folder=tmp_path / "out", mdi=[], until_s=None, clock_hz=None,
                             scope=None, console=Console(width=200))
        return str(started.value)

    assert run(None) == machine
    assert capsys.readouterr().out.startswith(said)
    assert run("small") == "small"
    assert not capsys.readouterr().out


def test_no_name_is_no_machine(tmp_path):
    tape = tmp_path / "part.nc"
    tape.write_text("%\n(MACHINE WIRE)\nG21\nM02\n%\n")
    for command in (["run", tape], ["tape", "check", tape]):
        done = gapkeeper(*command, "--machine", "")
        assert (done.returncode, done.stdout) == (2, "")
        assert 'there is no machine ""' in done.stderr


def test_what_stands_at_a_port_is_not_taken_from_the_tape(tmp_path):
    with pytest.raises(UsageError, match=r"is for the machine wire: say with --machine"):
        session.run_tape_at("socket://nowhere:1", ROOT / "tapes" / "wire_slot.nc", baud=1,
                            machine=None, folder=tmp_path, mdi=[], until_s=None, clock_hz=None,
                            at_start=False, arm=False, reset=False, scope=None, console=None)


@pytest.mark.parametrize(("words", "judged"), [
    ("MACHINE WIRE", "for the machine wire"),
    ("NO NAME", "travel not judged (--machine)"),
    ("MACHINE MINE", "travel not judged (--machine)"),
])
def test_a_tape_is_judged_for_it(tmp_path, words, judged):
    tape = tmp_path / "part.nc"
    tape.write_text(f"%\n({words})\nG21 G90\nG00 X1\nM02\n%\n")
    assert gapkeeper("tape", "check", tape).stdout.splitlines()[0].endswith(judged)
