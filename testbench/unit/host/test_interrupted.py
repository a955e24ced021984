# SPDX-License-Identifier: Apache-2.0
"""The block in which a run was interrupted: kept while it runs, and found by ``--from last``."""

import json
import signal
import subprocess
import sys
import time

import pytest

from host.errors import UsageError
from host.run import interrupted
from host.run.interrupted import FILE, Interrupted, block_of_last
from host.tape.tape import encode

TAPE = encode("%\nG21\nG01 X1\n(a comment)\nM02\n%\n")
OTHER = encode("%\nG21\nG01 X2\nM02\n%\n")
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


@pytest.mark.parametrize("outcome", ["alarm", "stopped", "rejected", None])
def test_the_block_outlives_an_interruption(workdir, outcome):
    kept = Interrupted(workdir, TAPE)
    for block in (2, 3):
        kept.at(block)
    assert kept.over(outcome) == 3
    assert block_of_last(workdir, TAPE) == 3
    # The next run has not come to a block yet: what was kept stays.
    assert Interrupted(workdir, TAPE).over(outcome) == 0
    assert block_of_last(workdir, TAPE) == 3


def test_a_tape_that_has_ended_has_none(workdir):
    kept = Interrupted(workdir, TAPE)
    kept.at(2)
    assert kept.over("end") == 0
    with pytest.raises(UsageError, match="was interrupted in a block"):
        block_of_last(workdir, TAPE)


def test_it_is_written_at_once_and_then_now_and_then(workdir, monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(interrupted.time, "monotonic", lambda: clock[0])
    kept = Interrupted(workdir, TAPE)
    found = []
    # A short block and a long one behind it: the long one is written without a further block.
    for block, now in ((1, 100), (2, 100.1), (3, 100.3), (4, 100.4), (0, 100.6)):
        clock[0] = now
        if block:
            kept.at(block)
        kept.keep()
        found.append(block_of_last(workdir, TAPE))
    assert found == [1, 1, 3, 3, 4]


def test_a_disk_that_is_full_does_not_end_the_cut(workdir):
    kept = Interrupted(workdir / "missing", TAPE)
    kept.at(2)
    kept.keep()


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"block": "x", "tape_sha256": ""}', "\x00"])
def test_a_damaged_file_is_refused(workdir, text):
    (workdir / FILE).write_text(text)
    with pytest.raises(UsageError, match="cannot be read"):
        block_of_last(workdir, TAPE)


def test_another_tape_is_refused(workdir):
    other = Interrupted(workdir, OTHER)
    other.at(2)
    other.keep()
    with pytest.raises(UsageError, match="was one of another tape; give the block itself"):
        block_of_last(workdir, TAPE)


def run(*options):
    return [sys.executable, "-m", "host.cli", "run", *map(str, options)]


def test_a_run_that_was_killed_goes_on_in_its_block(workdir):
    """Not even Python can clean up behind SIGKILL, as behind a power cut."""
    part, folder = workdir / "part.nc", workdir / "run"
    part.write_text(LONG)
    for path in folder.glob("*"):
        path.unlink()
    with subprocess.Popen(run(part, "--out", folder), stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT) as killed:
        end = time.monotonic() + 60
        while not (folder / FILE).exists() or block_of_last(folder, encode(LONG)) < 7:
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
    assert block_of_last(folder, encode(LONG)) == 7
