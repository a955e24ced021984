# SPDX-License-Identifier: Apache-2.0
"""The command line: its messages, its files and its exit status; never a traceback."""

import json
import os
import re
import signal
import subprocess
import sys

import numpy as np
import pytest

from host.errors import UsageError
from host.machines.machine import BUILT_IN, load
from host.tape.codes import EIA
from host.tape.tape import encode
from softcore.tables.faults import alarm_number
from softcore.tables.settings import named
from testbench.command import gapkeeper
from testbench.punch import TAPES

SINKER = (BUILT_IN / "sinker.toml").read_text(encoding="utf-8")
PROGRAM = "%\nG21 G90\nM02\n%\n"


@pytest.fixture
def program(workdir):
    path = workdir / "program.nc"
    path.write_text(PROGRAM)
    return path


@pytest.mark.parametrize(("command", "words"), [
    ([], ["run", "simulate", "tape", "plan", "experiment", "build", "bench"]),
    (["plan"], ["--electrode", "--workpiece", "--area", "--undersize", "--depth", "--taper",
                 "--finish", "--step", "--seed", "--series", "--jumps", "-o", "--plot",
                 "--data", "--load", "--baud"]),
    (["experiment"], ["fluid", "gap", "removal", "roughing", "networks"]),
    (["experiment", "networks"], ["--jobs", "--out"]),
    (["experiment", "fluid"], ["--seeds", "--out"]),
    (["experiment", "gap"], ["--seeds", "--depth", "--out"]),
    (["experiment", "removal"], ["--seeds", "--way", "--out"]),
    (["run"], ["--machine", "--seed", "--waves", "--out", "--mdi", "--until", "--clock", "--port",
               "--baud", "--at-start", "--no-arm", "--reset", "--scope", "--flash"]),
    (["simulate"], ["--tcp", "--pty", "--machine", "--arm", "--seed", "--clock", "--flash"]),
    (["tape"], ["encode", "decode", "check"]),
    (["tape", "encode"], ["--code", "iso|eia", "-o"]),
    (["tape", "decode"], ["-o"]),
    (["tape", "check"], ["firmware", "--mdi"]),
    (["build"], ["BOARD", "bitstream"]), (["bench"], ["table"]),
])
def test_help_names_everything(command, words):
    result = gapkeeper(*command, "--help")
    assert result.returncode == 0
    assert not [word for word in words if word not in result.stdout]


def test_it_starts_in_a_process_of_its_own():
    result = subprocess.run([sys.executable, "-m", "host.cli", "--help"], capture_output=True,
                            text=True, timeout=600, check=False,
                            env=os.environ | {"COLUMNS": "100"})
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout == gapkeeper("--help").stdout


@pytest.mark.parametrize("name", ["send", "serve"])
def test_commands_to_come_are_not_there_yet(name):
    assert gapkeeper(name).returncode == 2
    assert f" {name} " not in gapkeeper("--help").stdout


@pytest.mark.parametrize(("arguments", "message"), [
    (["run"],                                "Missing argument 'TAPE'"),
    (["run", "absent.nc"],                   "file 'absent.nc' does not exist"),
    (["nonsense"],                           "No such command 'nonsense'"),
    (["run", "--seed", "x", __file__],       "should be a valid integer"),
    (["run", "--seed", "-1", __file__],      "a seed is 0 to 18446744073709551615."),
    (["run", "--seed", 2**64, __file__],     "a seed is 0 to 18446744073709551615."),
    (["tape", "encode", "absent.nc", "-o", "x.ptp"], "file 'absent.nc' does not exist"),
    (["tape", "decode"],                     "Missing argument 'IN'"),
    (["run", "--out", "", __file__],         "an empty name names no folder."),
    (["build"],                              "Missing argument 'BOARD'"),
])
def test_wrong_usage_is_status_2(arguments, message):
    result = gapkeeper(*arguments)
    assert (result.returncode, result.stdout) == (2, "")
    assert message in result.stderr
    assert "Traceback" not in result.stderr


def test_unknown_board_is_refused_with_the_known_ones():
    result = gapkeeper("build", "nosuch")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == ('gapkeeper: there is no board "nosuch"; there are: '
                             "colorlight_i9, ulx3s, ulx3s_45f.\n")


@pytest.mark.parametrize(("failure", "message"), [
    ("KeyboardInterrupt", "gapkeeper: interrupted.\n"),
    pytest.param("BuildError('no such pin.')", "gapkeeper: no such pin.\n", marks=pytest.mark.soak),
])
def test_a_build_that_ends_half_way_warns_of_nothing(failure, message):
    """Amaranth would warn of every block of gateware that was made and not yet used."""
    script = ("import sys\n"
              "from host import cli\n"
              "from softcore import top\n"
              "from softcore.build import BuildError\n"
              "whole = top.Top.elaborate\n"
              "def half(self, platform):\n"
              "    whole(self, platform)\n"
              f"    raise {failure}\n"
              "top.Top.elaborate = half\n"
              "sys.argv = ['gapkeeper', 'build', 'ulx3s']\n"
              "cli.main()\n")
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True,
                            timeout=600, check=False)
    assert (result.returncode, result.stderr) == (1, message)


def test_unknown_machine_is_named(program, workdir):
    result = gapkeeper("run", program, "--machine", "lathe", "--out", workdir / "out")
    assert result.returncode == 2
    assert result.stderr == ('gapkeeper: there is no machine "lathe": give a TOML file, or one of: '
                             "cavity, half, relaxation, sinker, small, stepper, wall, wire.\n")
    assert not (workdir / "out").exists()


@pytest.mark.parametrize(("line", "message"), [
    ("",          "an empty line cannot be entered by hand."),
    ("?",         'the line "?" cannot be entered by hand: "?" is no character of a block.'),
    ("G9\n",      r'the line "G9\n" cannot be entered by hand: "\n" is no character of a block.'),
])
def test_what_is_no_line_by_hand_is_refused_before_the_start(program, workdir, line, message):
    result = gapkeeper("run", program, "--mdi", line, "--out", workdir / "out")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == f"gapkeeper: {message}\n"
    assert not (workdir / "out").exists()


def test_a_line_by_hand_that_the_controller_refuses_is_usage(program, workdir):
    result = gapkeeper("run", program, "--mdi", "g77", "--out", workdir)
    assert result.returncode == 2
    assert result.stderr == ('gapkeeper: the line "g77" entered by hand is refused by the '
                             "controller: MDI, character 1: the code G77 is unknown.\n")


def test_a_refused_line_by_hand_leaves_the_last_report_alone(program, workdir):
    folder = workdir / "out"
    assert gapkeeper("run", program, "--out", folder).returncode == 0
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert {"events.jsonl", "summary.json", "trace.npz", "report.html"} <= before.keys()
    assert gapkeeper("run", program, "--mdi", "g77", "--out", folder).returncode == 2
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_ctrl_c_ends_a_run_as_its_time_would(workdir):
    program, folder = workdir / "long.nc", workdir / "out"
    program.write_text("%\nG21 G90 G94\nG01 Z0.05 F0.1\nM02\n")
    for name in ("summary.json", "report.html"):
        (folder / name).unlink(missing_ok=True)
    script = ("import sys\n"
              "from host import cli\n"
              "from host.run import session\n"
              "class Told(session.Watch):\n"
              "    def __call__(self, run):\n"
              "        if run.began and run.events:\n"
              "            print('begun', flush=True)\n"
              "session.Watch = Told\n"
              f"sys.argv = ['gapkeeper', 'run', {str(program)!r}, '--out', {str(folder)!r}]\n"
              "cli.main()\n")
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True) as started:
        while "begun" not in started.stdout.readline():
            assert started.poll() is None
        started.send_signal(signal.SIGINT)
        said, wrong = started.communicate(timeout=600)
    assert (started.returncode, wrong) == (0, "")
    assert "stopped" in said
    assert json.loads((folder / "summary.json").read_text())["outcome"] == "stopped"
    assert (folder / "report.html").exists()


@pytest.mark.parametrize(("arguments", "message"), [
    (["simulate", "--tcp", "--pty"], "--tcp and --pty: the controller has one line only."),
    (["simulate", "--tcp", "a:b"], '"a:b" is no address: give HOST:PORT, such as 127.0.0.1:3333.'),
    (["run", __file__, "--at-start"], "--baud, --at-start, --no-arm and --reset are for a "
                                      "controller at a --port."),
    (["run", __file__, "--port", "x", "--waves"], "--seed, --waves and --flash are for the "
                                                  "simulated machine: a port has none."),
    (["run", TAPES / "sink_jump.nc", "--port", "ftp://x:1"],
     '"ftp://x:1" names no port: give a device such as /dev/ttyUSB0, or socket://HOST:PORT.'),
])
def test_a_port_that_makes_no_sense_is_usage(arguments, message):
    result = gapkeeper(*arguments)
    assert (result.returncode, result.stdout, result.stderr) == (2, "", f"gapkeeper: {message}\n")


def test_an_unknown_setting_is_usage(program, workdir):
    machine = workdir / "odd.toml"
    machine.write_text(SINKER + "99 = 1\n")
    result = gapkeeper("run", program, "--machine", machine, "--out", workdir)
    assert result.returncode == 2
    assert result.stderr == ("gapkeeper: machine odd: settings.99 is no setting of the controller; "
                             "docs/reference/settings.md lists them.\n")


@pytest.mark.parametrize("code", ["iso", "eia"])
def test_tape_goes_out_and_comes_back(program, workdir, code):
    punched, text = workdir / f"{code}.ptp", workdir / f"{code}.nc"
    assert gapkeeper("tape", "encode", "--code", code, "-o", punched, program).returncode == 0
    assert gapkeeper("tape", "decode", "-o", text, punched).returncode == 0
    assert text.read_text() == PROGRAM
    assert gapkeeper("tape", "decode", punched).stdout == PROGRAM


@pytest.mark.parametrize("command", ["encode", "decode"])
@pytest.mark.parametrize("link", ["", "hardlink_to", "symlink_to"])
def test_a_tape_is_not_written_over_its_source(workdir, command, link):
    source = target = workdir / "part"
    data = PROGRAM.encode() if command == "encode" else encode(PROGRAM).rows
    source.write_bytes(data)
    if link:
        target = workdir / "other"
        target.unlink(missing_ok=True)
        getattr(target, link)(source)
    result = gapkeeper("tape", command, "-o", target, source)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == (f"gapkeeper: {target} is the file that is read, and would be "
                             "lost.\n")
    assert source.read_bytes() == data


def test_lines_by_hand_complete_the_data_of_a_checked_tape(program):
    program.write_text("%\nG36 R300\nM02\n")
    alone = gapkeeper("tape", "check", program)
    assert (alone.returncode, alone.stdout) == (4, "")
    given = gapkeeper("tape", "check", program, "--mdi", "g36 l0.5 h600", "--mdi", "G36 E60 Q0.1")
    assert (given.returncode, given.stderr) == (0, "")
    assert given.stdout == (f"{program}: 2 blocks, no fault found; travel not judged "
                            "(--machine)\n")


@pytest.mark.parametrize(("line", "message"), [
    ("g77", 'the line "g77" entered by hand is refused by the controller: MDI, character 1: the '
            "code G77 is unknown."),
    ("",    "an empty line cannot be entered by hand."),
])
def test_a_line_by_hand_that_is_none_is_usage_of_a_check(program, line, message):
    result = gapkeeper("tape", "check", program, "--mdi", line)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == f"gapkeeper: {message}\n"


def test_a_mark_of_the_byte_order_is_no_character(program, workdir):
    """Windows' editor begins every text with one."""
    punched = [workdir / name for name in ("plain.ptp", "marked.ptp")]
    assert gapkeeper("tape", "encode", "-o", punched[0], program).returncode == 0
    program.write_bytes(b"\xef\xbb\xbf" + program.read_bytes())
    assert gapkeeper("tape", "encode", "-o", punched[1], program).returncode == 0
    assert punched[0].read_bytes() == punched[1].read_bytes()


@pytest.mark.parametrize("below", [".", "deep", "deep/er"])
def test_a_file_is_no_folder_for_a_run(program, workdir, below):
    folder = workdir / "file" / below
    (workdir / "file").write_text("")
    result = gapkeeper("run", program, "--out", folder)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == (f"gapkeeper: {folder} can be no folder: it is a file, or would stand "
                             "in one.\n")


def test_what_cannot_be_punched_is_one_sentence(workdir):
    program = workdir / "bad.nc"
    program.write_text("%\nG01 ; FAST\nM02\n")
    result = gapkeeper("tape", "encode", "--code", "eia", "-o", workdir / "bad.ptp", program)
    assert (result.returncode, result.stdout) == (4, "")
    assert result.stderr == ('gapkeeper: Line 2, character 5: EIA RS-244 tape has no code for '
                             '";".\n')
    assert not (workdir / "bad.ptp").exists()


def test_damaged_tape_is_one_sentence(workdir):
    punched = workdir / "bad.ptp"
    rows = encode(PROGRAM, EIA).rows
    punched.write_bytes(rows.replace(bytes([EIA.punch["G"]]), bytes([EIA.punch["G"] ^ 0x10]), 1))
    result = gapkeeper("tape", "decode", punched)
    assert result.returncode == 4
    assert result.stderr == "gapkeeper: Block 2, character 1: parity error (TH) in the byte 77.\n"
    checked = gapkeeper("tape", "check", punched)
    assert (checked.returncode, checked.stderr) == (4, result.stderr)


def test_names_of_files_may_be_in_capitals_and_one_is_one(workdir):
    source, punched = workdir / "PART.NC", workdir / "PART.PTP"
    source.write_text("M02\n")
    assert gapkeeper("tape", "encode", "-o", punched, source).returncode == 0
    for path in (source, punched):
        said = gapkeeper("tape", "check", path).stdout
        assert said == f"{path}: 1 block, no fault found; travel not judged (--machine)\n"
    run = gapkeeper("run", punched, "--out", workdir / "out")
    assert run.returncode == 0
    assert "</span>M02" in (workdir / "out" / "report.html").read_text(encoding="utf-8")


def test_a_text_that_cannot_be_punched_is_a_rejected_run(workdir):
    program = workdir / "bad.nc"
    program.write_text("%\nG01 \u00e4\nM02\n")
    result = gapkeeper("run", program, "--out", workdir / "out")
    assert result.returncode == 4
    summary = json.loads((workdir / "out" / "summary.json").read_text())
    assert summary["outcome"] == "rejected"
    assert summary["alarm"]["text"].startswith("Line 2, character 5: ISO 840 tape has no code")


def test_a_fault_of_the_program_is_no_traceback(workdir):
    """A file that is no machine's file is refused."""
    machine = workdir / "odd.toml"
    machine.write_text("clock_hz = 'fast'\n")
    program = workdir / "p.nc"
    program.write_text(PROGRAM)
    result = gapkeeper("run", program, "--machine", machine, "--out", workdir / "out")
    assert result.returncode == 2
    assert result.stderr == "gapkeeper: machine odd: clock_hz is no number.\n"


SUMMARY = {"outcome", "alarm", "time_s", "cycles", "wall_s", "cycles_per_s", "discharges",
           "retractions", "pos", "max_depth_mm", "pressed_mm", "removed_mm3",
           "clear_of_shorts", "guards_off", "short_by", "from_block", "seed", "clock_hz",
           "removal_scale", "versions"}


@pytest.mark.parametrize(("tape", "options", "status", "outcome"), [
    ("sink_persistent_short.nc",       ["--seed", 5],    3, "alarm"),
    ("sink_persistent_short.eia.ptp",  ["--until", 0.2], 0, "stopped"),
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
    assert summary["time_s"] == pytest.approx(summary["cycles"] / summary["clock_hz"],
                                              abs=1e-6)
    assert (summary["pos"]["z"] < 0.0999) is (outcome == "alarm")
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert [event["cycle"] for event in events] == sorted(event["cycle"] for event in events)
    if summary["alarm"]:
        assert events[-1]["event"] == "alarm"
        assert summary["alarm"]["text"] == events[-1]["text"]
        assert events[-1]["text"] in " ".join(result.stdout.split())
    assert "</html>" in (folder / "report.html").read_text()
    with np.load(folder / "trace.npz") as trace:
        assert len({len(trace[name]) for name in trace.files}) == 1
        # One each millisecond from 0 on, and none at the very clock at which the run ends.
        assert len(trace["t"]) == -(-summary["cycles"] * 1000 // summary["clock_hz"])
        assert trace["z"][-1] == pytest.approx(summary["pos"]["z"], abs=0.001)
        # The encoder trembles: where the run ends may be a pulse deeper than any sample.
        deepest = min(trace["z"].min(), summary["pos"]["z"])
        assert summary["max_depth_mm"] == pytest.approx(max(0, -deepest), abs=1e-6)


def test_same_seed_is_the_same_run(workdir):
    for name, seed in (("first", 9), ("second", 9), ("other", 10)):
        result = gapkeeper("run", TAPES / "sink_persistent_short.nc", "--seed", seed,
                           "--out", workdir / name)
        assert result.returncode == 3
    assert "compiling" not in result.stdout  # nothing has changed since the first run
    first, second = ((workdir / name / "events.jsonl").read_bytes() for name in ("first", "second"))
    assert first.count(b"\n") > 10
    assert first == second
    volts = []
    for name in ("first", "second", "other"):
        with np.load(workdir / name / "trace.npz") as trace:
            volts.append(trace["gap_v"])
    assert np.array_equal(volts[0], volts[1])
    assert not np.array_equal(volts[0], volts[2])


def run_text(workdir, text, *options):
    """Run a part program; exit status, terminal, summary, events and trace."""
    program, folder = workdir / "p.nc", workdir / "run"
    program.write_text(text)
    result = gapkeeper("run", program, "--out", folder, *options)
    summary = json.loads((folder / "summary.json").read_text())
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    with np.load(folder / "trace.npz") as trace:
        return result, summary, events, dict(trace)


def test_a_run_stops_at_its_time(workdir):
    """The run ends within a poll of 10 ms, with the axes at rest."""
    text = "%\nG21 G90 G94\nG01 Z0.05 F6\nM02\n"
    result, summary, _, trace = run_text(workdir, text, "--until", 0.35)
    assert (result.returncode, summary["outcome"]) == (0, "stopped")
    path = trace["path"]
    assert path[-1] > path[340]
    assert (path[361:] == path[-1]).all()
    assert 0.35 <= summary["time_s"] < 0.5


@pytest.mark.parametrize(("height", "status", "outcome"), [("0.1", 4, "rejected"),
                                                           ("0.0999", 3, "alarm")])
def test_one_pulse_of_motion_tells_an_alarm_from_a_rejected_tape(workdir, height, status, outcome):
    result, summary, events, _ = run_text(workdir, f"%\nG90\nG00 Z{height}\nG04 P50\nB2\nM02\n")
    assert (result.returncode, summary["outcome"]) == (status, outcome)
    assert events[-1]["text"] == "Block 5, line 5, character 1: the word B is unknown."


def test_depth_and_trace_keep_the_frame_in_which_the_program_began(workdir):
    text = "%\nG90\nG00 Z0.05\nG92 Z-1.\nG04 P20\nM02\n"
    _, summary, events, trace = run_text(workdir, text)
    assert events[-1]["pos"]["z"] == pytest.approx(-1.0, abs=0.0005)
    assert summary["pos"]["z"] == pytest.approx(0.05, abs=0.0005)
    assert summary["max_depth_mm"] == 0.0
    assert trace["z"][0] == pytest.approx(0.1, abs=0.0005)
    assert trace["z"][-1] == pytest.approx(0.05, abs=0.0005)


@pytest.mark.parametrize("options", [[], ["--mdi", "G92 Z5.1"]])
def test_an_electrode_pushed_into_solid_work_is_told(workdir, options):
    """Machining is off, so nothing is removed. Contact is an alarm.

    The command ends at the touch. The electrode goes on to it, and with feed-forward by the 4 ms of
    its drive.
    """
    share = named("feed_forward").default / 100
    lag_mm = 10 * ((1 - share) / named("loop_gain").default + share * 4e-3)
    height = 4.8 if options else -0.2
    result, summary, events, trace = run_text(
        workdir, f"%\nG90\nG01 Z{height} F600\nM02\n", *options)
    assert (result.returncode, summary["outcome"]) == (3, "alarm")
    assert summary["alarm"]["code"] == alarm_number("contact")
    assert events[-1]["text"].startswith("Block 3, line 3: contact with the discharge off;")
    assert lag_mm / 2 < summary["pressed_mm"] <= lag_mm + 0.004
    assert summary["pressed_mm"] == pytest.approx(-trace["gap_um"].min() / 1000, abs=1e-6)
    said = f"The electrode was pressed {summary['pressed_mm']:.3f} mm into the workpiece: "
    assert said + "on a real machine, a collision." in result.stdout.splitlines()


@pytest.mark.parametrize(("line", "message"), [
    ("clock_hz = 0", "clock_hz must be 2000000 to 100000000, not 0."),
    ("clock_hz = 1_000_000", "clock_hz must be 2000000 to 100000000, not 1000000."),
    ("pulses_per_mm = 5000", "pulses_per_mm must be 10000, not 5000."),
    ("removal_scale = nan", "removal_scale must be 0.001 to 1000000, not nan."),
    ("initial_gap_um = 1e9", "initial_gap_um must be 0 to 100000, not 1000000000.0."),
    ("tick_us = 1e9", "tick_us must be 1 to 100, not 1000000000.0."),
    ("[axis]\nspeed_loop_ms = 0", "axis.speed_loop_ms must be 0.001 to 1000000000, not 0."),
    ("[axis]\nfull_speed_mm_s = 0", "axis.full_speed_mm_s must be 1 to 1000, not 0."),
    ("[axis]\nmax_acceleration_mm_s2 = -1", "axis.max_acceleration_mm_s2 must be 1 to 1000000, "
                                            "not -1."),
    ("[gap]\nignition_slope_um = 0", "gap.ignition_slope_um must be 0.001 to 1000000000, not 0."),
    ("[gap]\ncontact_um = -2", "gap.contact_um must be 0 to 1000000000, not -2."),
    ("[side]\nlimit_high_mm = -1", "side.limit_high_mm must be 0.1 to 10000, not -1."),
    ("[gap]\narea_mm2 = true", "gap.area_mm2 is no number"),
    ("[settings]\nbaud = 9600", "settings.baud = 9600 is no setting"),
    ("[settings]\n408 = 1.5", "settings.408 = 1.5 is no setting"),
    ("[settings]\n408 = -1", "settings.408 = -1 is no setting"),
    (f"[settings]\n408 = {10**10}", f"settings.408 = {10**10} is no setting"),
    ("[settings]\n'\u0668' = 1", "settings.\u0668 = 1 is no setting"),
])
def test_an_impossible_machine_is_refused(workdir, line, message):
    path = workdir / "impossible.toml"
    path.write_text(line + "\n")
    with pytest.raises(UsageError, match=re.escape(message)):
        load(str(path))


@pytest.mark.parametrize("key", re.findall(r"^([a-z]\w*) = [-\d]", SINKER, re.M))
def test_no_number_of_a_machine_is_without_bounds(workdir, key):
    path = workdir / "far.toml"
    for value in ("nan", "inf", "-inf", 10**400, -10**12):
        path.write_text(re.sub(rf"^{key} = \S+", f"{key} = {value}", SINKER, flags=re.M))
        with pytest.raises(UsageError, match=rf"^machine far: (\w+\.)?{key} must be .*, not "):
            load(str(path))


@pytest.mark.parametrize("key", re.findall(r"(?m)^([a-z]\w*) = [-\d]", re.sub(  # may be left out:
    r"(?m)^\[([xyz]|relaxation)\].*\n([^[].*\n|\n)*|^(dead|offset|friction)_.*", "", SINKER)))
def test_a_machine_that_lacks_a_number_is_refused(workdir, key):
    path = workdir / "part.toml"
    path.write_text(re.sub(rf"^{key} = .*\n", "", SINKER, flags=re.M))
    with pytest.raises(UsageError, match=rf"^machine part: (\w+\.)?{key} is missing; a machine's "):
        load(str(path))


@pytest.mark.parametrize(("text", "key"), [
    (SINKER.replace("[gap]", "[gap]\ncolour = 3"), "gap.colour"),
    ("strange = 1\n" + SINKER, "strange"),
    ("settings = 3\n" + SINKER.partition("[settings]")[0], "settings"),
])
def test_a_number_that_no_machine_has_is_refused(workdir, text, key):
    path = workdir / "strange.toml"
    path.write_text(text)
    with pytest.raises(UsageError, match=rf"^machine strange: {key} is no number of a machine\.$"):
        load(str(path))
