# SPDX-License-Identifier: Apache-2.0
"""The block in which a run was interrupted: kept while it runs, and found by ``--from last``."""

import json
import re
import signal
import subprocess
import sys
import time
from hashlib import sha256

import pytest

from host.errors import UsageError
from host.link.link import RESET
from host.machines import machine as machines
from host.run import interrupted, session, simulation
from host.run.interrupted import FILE, Interrupted, last
from host.run.run import Run
from host.tape.tape import encode

TAPE = encode("%\nG21\nG01 X1\n(a comment)\nM02\n%\n")
OTHER = encode("%\nG21\nG01 X2\nM02\n%\n")
ZERO = {"x": 1.5, "y": 0.0, "z": -2.0}
LONG = """%
N10 G21 G90 G94
N20 C100
N30 G04 P60
N40 M03
N50 G01 X0.02 F600
N60 X2 F5
N70 M05
N80 M02
%
"""


def kept_in(folder, tape=TAPE):
    """What keeps the block of a tape in a folder without a file."""
    (folder / FILE).unlink(missing_ok=True)
    kept = Interrupted(folder, tape)
    kept.zero = ZERO
    return kept


@pytest.mark.parametrize("outcome", ["alarm", "stopped", None])
def test_the_block_outlives_an_interruption(workdir, outcome):
    kept = kept_in(workdir)
    for block in (2, 3):
        kept.at(block)
    assert kept.over(outcome) == 3
    assert last(workdir, TAPE) == (3, ZERO)
    # The next run has not come to a block yet: what was kept stays.
    assert Interrupted(workdir, TAPE).over(outcome) == 0
    assert last(workdir, TAPE) == (3, ZERO)


def test_a_tape_that_has_ended_has_none(workdir):
    kept = kept_in(workdir)
    kept.at(2)
    kept.keep()
    assert kept.over("end") == 0
    with pytest.raises(UsageError, match="has no interrupted run"):
        last(workdir, TAPE)


def test_a_tape_that_was_rejected_leaves_the_block_of_the_one_before(workdir):
    kept = kept_in(workdir)
    kept.at(700)
    kept.over("alarm")
    wrong = Interrupted(workdir, OTHER)
    wrong.at(2)
    assert wrong.over("rejected") == 0
    assert last(workdir, TAPE) == (700, ZERO)


def test_it_is_written_at_once_and_then_now_and_then(workdir, monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(interrupted.time, "monotonic", lambda: clock[0])
    kept = kept_in(workdir)
    found = []
    # A short block and a long one behind it: the long one is written without a further block.
    for block, now in ((1, 100), (2, 100.1), (3, 100.3), (4, 100.4), (0, 100.6)):
        clock[0] = now
        if block:
            kept.at(block)
        kept.keep()
        found.append(last(workdir, TAPE)[0])
    assert found == [1, 1, 3, 3, 4]


def test_a_disk_that_is_full_ends_neither_the_cut_nor_its_report(workdir):
    kept = Interrupted(workdir / "missing", TAPE)
    kept.at(2)
    kept.keep()
    assert kept.over("alarm") == 0, "nothing is told of a block that is not kept"


GOOD = json.dumps({"block": 3, "tape_sha256": sha256(TAPE.rows).hexdigest(), "zero": ZERO})


@pytest.mark.parametrize("text", [
    "", "{}", "[]", "\x00", *(GOOD.replace(": 3", f": {block}") for block in (
        '"x"', "0", "-1", "100000000", "Infinity", "null")),
    GOOD.replace('"y"', '"u"'), GOOD.replace("1.5", "[]")])
def test_a_damaged_file_is_refused(workdir, text):
    (workdir / FILE).write_text(GOOD)
    assert last(workdir, TAPE) == (3, ZERO)
    (workdir / FILE).write_text(text)
    with pytest.raises(UsageError, match="cannot be read"):
        last(workdir, TAPE)


def test_another_tape_is_refused_with_the_block(workdir):
    kept = kept_in(workdir, OTHER)
    kept.at(2)
    kept.keep()
    with pytest.raises(UsageError, match=r"the tape has changed since .* in block 2; look where"):
        last(workdir, TAPE)


def test_it_is_not_the_start_of_the_machine(workdir):
    (workdir / "part.nc").write_text("%\nG21\nG01 X1\n(a comment)\nM02\n%\n")
    (workdir / FILE).write_text(GOOD)
    with pytest.raises(UsageError, match="--from last and --at-start: the machine stands where"):
        session.run_tape_at("socket://nowhere:1", workdir / "part.nc", baud=1, machine="sinker",
                            folder=workdir, mdi=[], until_s=None, clock_hz=None, at_start=True,
                            arm=False, reset=False, scope=None, console=None, start="LAST")


def test_a_zero_that_has_moved_is_refused_until_it_is_there_again():
    machine = machines.load("sinker")
    moved = {axis: (axis == "x") - place for axis, place in machine.start_mm.items()}

    def tried(*lines):
        machine_on = simulation.start(machine, clock_hz=machine.clock_hz, seed=1, trace=False,
                                      waves=None, progress=print)
        job = Run(machine, TAPE, machine_on, mdi=list(lines), from_block=3, zero=moved, arm=False)
        try:
            job.set_up()
        finally:
            machine_on.close()
        return job.offset

    with pytest.raises(UsageError, match=r"program zero is at X.* and was at X1\.0000") as refused:
        tried()
    line = re.search(r"--mdi '(G92 [^']*)'", str(refused.value))[1]
    assert tried(line) == pytest.approx(moved, abs=1e-4)


def test_without_a_file_it_is_not_the_start_of_the_machine_either(workdir):
    (workdir / "part.nc").write_text("%\nG21\nG01 X1\nM02\n%\n")
    (workdir / FILE).unlink(missing_ok=True)
    with pytest.raises(UsageError, match="--from last and --at-start: the machine stands where"):
        session.run_tape_at("socket://nowhere:1", workdir / "part.nc", baud=1, machine="sinker",
                            folder=workdir, mdi=[], until_s=None, clock_hz=None, at_start=True,
                            arm=False, reset=False, scope=None, console=None, start="LAST")


def test_the_controllers_own_record_leads_on():
    machine, tape = machines.load("sinker"), encode(LONG)
    machine_on = simulation.start(machine, clock_hz=machine.clock_hz, seed=1, trace=False,
                                  waves=None, progress=print)
    try:
        fresh = Run(machine, tape, machine_on, from_record=True)
        with pytest.raises(UsageError, match=r"\(--from last\) is refused .* no tape was int"):
            fresh.set_up()
        machine_on.write(RESET)
        said = []
        known = Run(machine, tape, machine_on, from_block=7, from_record=True, say=said.append)
        known.set_up()
        assert "(no tape was interrupted" in said[0]
        assert "block 7 counts" in said[0]
        assert not known.from_record, "the block of the folder counts then"
        machine_on.write(RESET)
        first = Run(machine, tape, machine_on, until_s=machine_on.time_s() + 1.5)
        assert first.execute() == "stopped"
        assert first.from_block == 0
        machine_on.write(RESET)
        asked = []
        second = Run(machine, tape, machine_on, at_start=False, from_record=True,
                     until_s=machine_on.time_s() + 1.5,
                     goes_on=lambda said: bool(asked.append(said)) or True)
        assert second.execute() == "stopped"
        assert second.from_block == 7
        assert [event["text"] for event in second.events if event["event"] == "block"] == [
            "N60 X2 F5"]
        place = re.match(r"block 7 was left at X([\d.]+) ", asked[0])
        assert 0.025 < float(place[1]) < 0.3
        at = next(event["pos"]["x"] for event in second.events if event["event"] == "block")
        assert at == pytest.approx(float(place[1]), abs=0.003)
    finally:
        machine_on.close()


def run(*options):
    return [sys.executable, "-m", "host.cli", "run", *map(str, options)]


def test_a_run_that_was_killed_goes_on_in_its_block(workdir):
    """Python can clean up nothing behind SIGKILL."""
    part, folder = workdir / "part.nc", workdir / "run"
    part.write_text(LONG)
    for path in folder.glob("*"):
        path.unlink()
    with subprocess.Popen(run(part, "--out", folder), stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT) as killed:
        end = time.monotonic() + 60
        while not (folder / FILE).exists() or last(folder, encode(LONG))[0] < 7:
            assert killed.poll() is None, killed.stdout.read()
            assert time.monotonic() < end, "the block did not come"
            time.sleep(0.05)
        killed.send_signal(signal.SIGKILL)
    assert not (folder / "summary.json").exists()

    done = subprocess.run(run(part, "--out", folder, "--from", "last", "--until", "1.5"),
                          capture_output=True, text=True, check=False, timeout=100)
    assert "Begun at block 7: the blocks before it only set modes and places." in done.stdout
    summary = json.loads((folder / "summary.json").read_text())
    assert (summary["outcome"], summary["from_block"]) == ("stopped", 7)
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert [event["text"] for event in events if event["event"] == "block"] == ["N60 X2 F5"]
    assert last(folder, encode(LONG))[0] == 7
