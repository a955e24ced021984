# SPDX-License-Identifier: Apache-2.0
"""The command line: what it says, what it writes, and its exit status; never a traceback."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest

from host.codes import EIA
from host.errors import UsageError
from host.machine import load
from host.tape import encode
from testbench.punch import TAPES

PROGRAM = "%\nG21 G90\nM02\n%\n"


def gapkeeper(*arguments):
    return subprocess.run([sys.executable, "-m", "host.cli", *map(str, arguments)],
                          capture_output=True, text=True, timeout=600, check=False,
                          env=os.environ | {"COLUMNS": "100"})


@pytest.fixture
def program(workdir):
    path = workdir / "program.nc"
    path.write_text(PROGRAM)
    return path


@pytest.mark.parametrize(("command", "words"), [
    ([], ["run", "tape", "build", "bench"]),
    (["run"], ["--machine", "--seed", "--waves", "--out", "--mdi", "--until", "--clock"]),
    (["tape"], ["encode", "decode", "check"]),
    (["tape", "encode"], ["--code", "iso|eia", "-o"]),
    (["tape", "decode"], ["-o"]),
    (["tape", "check"], ["firmware"]),
    (["build"], ["BOARD", "bitstream"]),
    (["bench"], ["table"]),
])
def test_help_names_everything(command, words):
    result = gapkeeper(*command, "--help")
    assert result.returncode == 0
    assert not [word for word in words if word not in result.stdout]


@pytest.mark.parametrize("name", ["plan", "experiment", "send", "serve"])
def test_commands_to_come_are_not_there_yet(name):
    assert gapkeeper(name).returncode == 2
    assert f" {name} " not in gapkeeper("--help").stdout


@pytest.mark.parametrize("arguments", [
    ["run"], ["run", "absent.nc"], ["nonsense"], ["run", "--seed", "x", "absent.nc"],
    ["tape", "encode", "absent.nc", "-o", "x.ptp"], ["tape", "decode"], ["build"],
])
def test_wrong_usage_is_status_2(arguments):
    result = gapkeeper(*arguments)
    assert result.returncode == 2
    assert result.stderr
    assert "Traceback" not in result.stderr


def test_unknown_machine_is_named(program, workdir):
    result = gapkeeper("run", program, "--machine", "lathe", "--out", workdir / "out")
    assert result.returncode == 2
    assert result.stderr.startswith('gapkeeper: there is no machine "lathe": give a TOML file, or')


@pytest.mark.parametrize("code", ["iso", "eia"])
def test_tape_goes_out_and_comes_back(program, workdir, code):
    punched, text = workdir / f"{code}.ptp", workdir / f"{code}.nc"
    assert gapkeeper("tape", "encode", "--code", code, "-o", punched, program).returncode == 0
    assert gapkeeper("tape", "decode", "-o", text, punched).returncode == 0
    assert text.read_text() == PROGRAM
    assert gapkeeper("tape", "decode", punched).stdout == PROGRAM


def test_what_cannot_be_punched_is_one_sentence(workdir):
    program = workdir / "bad.nc"
    program.write_text("%\nG01 ; FAST\nM02\n")
    result = gapkeeper("tape", "encode", "--code", "eia", "-o", workdir / "bad.ptp", program)
    assert (result.returncode, result.stdout) == (4, "")
    assert result.stderr == ('gapkeeper: block 2, character 5: EIA RS-244 tape has no code for '
                             '";".\n')
    assert not (workdir / "bad.ptp").exists()


def test_damaged_tape_is_one_sentence(workdir):
    punched = workdir / "bad.ptp"
    rows = encode(PROGRAM, EIA).rows
    punched.write_bytes(rows.replace(bytes([EIA.punch["G"]]), bytes([EIA.punch["G"] ^ 0x10]), 1))
    result = gapkeeper("tape", "decode", punched)
    assert result.returncode == 4
    assert result.stderr.startswith("gapkeeper: block 2, character 1: parity error")
    assert result.stderr.count("\n") == 1


def test_a_text_that_cannot_be_punched_is_a_rejected_run(workdir):
    program = workdir / "bad.nc"
    program.write_text("%\nG01 \u00e4\nM02\n")
    result = gapkeeper("run", program, "--out", workdir / "out")
    assert result.returncode == 4
    summary = json.loads((workdir / "out" / "summary.json").read_text())
    assert summary["outcome"] == "rejected"
    assert summary["alarm"]["text"].startswith("block 2, character 5: ISO 840 tape has no code")


def test_a_fault_of_the_program_is_no_traceback(workdir):
    """A folder where a file is wanted is caught; this one is not a file of machine tables."""
    machine = workdir / "odd.toml"
    machine.write_text("clock_hz = 'fast'\n")
    program = workdir / "p.nc"
    program.write_text(PROGRAM)
    result = gapkeeper("run", program, "--machine", machine, "--out", workdir / "out")
    assert result.returncode == 2
    assert result.stderr == "gapkeeper: machine odd: clock_hz is no number.\n"


SUMMARY = {"outcome", "alarm", "time_s", "cycles", "wall_s", "cycles_per_s", "discharges",
           "retractions", "pos", "max_depth_mm", "seed", "clock_hz", "removal_scale", "versions"}


@pytest.mark.parametrize(("tape", "options", "status", "outcome"), [
    ("sink_persistent_short.nc",       ["--seed", 5],    3, "alarm"),
    ("sink_persistent_short.eia.ptp",  ["--until", 0.3], 0, "stopped"),
    ("broken/fault_after_motion.ptp",  [],               3, "alarm"),
    ("broken/parity_flip.ptp",         [],               4, "rejected"),
])
def test_run_writes_its_folder_and_says_how_it_ended(workdir, tape, options, status, outcome):
    folder = workdir / tape.replace("/", "_")
    result = gapkeeper("run", TAPES / tape, "--out", folder, *options)
    assert (result.returncode, result.stderr) == (status, "")
    summary = json.loads((folder / "summary.json").read_text())
    assert set(summary) == SUMMARY
    assert summary["outcome"] == outcome
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert [event["cycle"] for event in events] == sorted(event["cycle"] for event in events)
    if summary["alarm"]:
        assert events[-1]["event"] == "alarm"
        assert summary["alarm"]["text"] == events[-1]["text"]
        assert events[-1]["text"] in " ".join(result.stdout.split())
    assert "</html>" in (folder / "report.html").read_text()
    with np.load(folder / "trace.npz") as trace:
        assert len({len(trace[name]) for name in trace.files}) == 1


def test_same_seed_is_the_same_run(workdir):
    for name in ("first", "second"):
        gapkeeper("run", TAPES / "sink_persistent_short.nc", "--seed", 9, "--out", workdir / name)
    first, second = ((workdir / name / "events.jsonl").read_bytes() for name in ("first", "second"))
    assert first
    assert first == second


@pytest.mark.parametrize(("line", "message"), [
    ("clock_hz = 0", "clock_hz must be above 0, not 0"),
    ("clock_hz = 1_000_000", "clock_hz must be 2000000 to 100000000, not 1000000"),
    ("pulses_per_mm = -1", "pulses_per_mm must be above 0, not -1"),
    ("removal_scale = nan", "removal_scale must be finite, not nan"),
    ("[gap]\narea_mm2 = true", "gap.area_mm2 is no number"),
])
def test_an_impossible_machine_is_refused(workdir, line, message):
    path = workdir / "impossible.toml"
    path.write_text(line + "\n")
    with pytest.raises(UsageError, match=re.escape(message)):
        load(str(path))
