# SPDX-License-Identifier: Apache-2.0
"""The simulated machine behind a line: a client gets the same as a run within one program."""

import json
import re
import signal
import subprocess
import sys

import pytest

from host.link.port import Port
from host.link.serve import Pty, Tcp
from host.machines import machine as machines
from host.run import simulation
from host.run.controller import Controller
from host.run.live import Live
from host.run.run import Run
from host.tape.tape import encode, load
from testbench.live import Client, serving
from testbench.punch import TAPES

SINKER = machines.load("sinker")
# Motion, retraction data, a condition, an auxiliary function, another zero; the gap stays wide. All
# of the tape is there before the dwell ends.
PROGRAM = """%
N10 G21 G90 G94
N20 G36 R300 L0.5 H600 E60 Q0.1
N30 C130 M08
N35 G04 P300
N40 G01 Z0.12 F30
N50 G91
N60 G01 X0.03 Y-0.01
N70 G92 X0
N80 G90 G04 P20
N90 B2
M02
%
"""


def heed_ctrl_c():
    """Let Ctrl-C end a process also where a shell has started the tests in its background."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def start(seed=1):
    return simulation.start(SINKER, clock_hz=SINKER.clock_hz, seed=seed, waves=None, trace=False,
                            progress=print)


class Lockstep:
    """A pipe over a line; the machine runs only while this end waits, so that no time is lost."""

    def __init__(self, machine, line):
        self.machine, self.port = machine, Port(line.url)
        self.live = Live(machine, line, print, clock=machine.time_s)
        self.clock_hz, self.positions = machine.clock_hz, machine.positions
        self.errors, self.front = machine.errors, machine.front
        self.press_arm, self.time_s = machine.press_arm, machine.time_s
        line.take(0 if isinstance(line, Pty) else 1)   # the client is let in

    @property
    def cycle(self):
        return self.machine.cycle

    def write(self, data):
        self.port.write(data)

    def read(self, timeout_s):
        self.live.step(timeout_s)
        return self.port.read(0)


@pytest.mark.parametrize("kind", ["tcp", "pty"])
def test_in_lockstep_a_line_changes_no_byte(kind):
    """Discharges, retraction and alarm of a whole tape, to the clock."""
    tape = load(TAPES / "sink_persistent_short.nc")
    alone = start(seed=5)
    here = Run(SINKER, tape, alone)
    here.execute()
    alone.close()
    line = Tcp("127.0.0.1", 0, print) if kind == "tcp" else Pty(print)
    behind = start(seed=5)
    pipe = Lockstep(behind, line)
    there = Run(SINKER, tape, pipe)
    there.execute()
    pipe.port.close()
    behind.close()
    line.close()
    assert here.outcome == "alarm"
    assert len(here.events) > 10
    assert there.events == here.events


def assert_same(there, here):
    """Check that events agree in all but time.

    A block begins during motion, when the firmware comes to it. So its place may be that of some
    milliseconds sooner or later, at 0.5 mm/s.
    """
    assert len(there) == len(here)
    for one, other in zip(there, here, strict=True):
        assert one["pos"] == pytest.approx(other["pos"], abs=0.002), other
        apart = ("cycle", "t", "pos")
        assert ({name: value for name, value in one.items() if name not in apart}
                == {name: value for name, value in other.items() if name not in apart})


def test_a_run_at_a_port_tells_what_a_run_in_simulation_tells():
    """The client comes, goes, leaves half a line, and comes again: the run is the same."""
    tape = encode(PROGRAM)
    alone = start()
    here = Run(SINKER, tape, alone)
    here.execute()
    alone.close()
    behind = start()
    with serving(behind, arm=True) as (url, _):
        before = Client(Port(url))
        before.lines_until(lambda lines: lines)     # its greeting
        before.send("?")
        before.lines_until(lambda lines: any(line.startswith("<") for line in lines))
        before.send("G01 X9")
        before.port.close()
        controller = Controller(Port(url), SINKER, clock_hz=SINKER.clock_hz, say=print)
        controller.identify(reset=False)
        there = Run(SINKER, tape, controller)
        there.execute()
        controller.port.close()
    behind.close()
    assert here.outcome == there.outcome == "alarm"
    assert here.alarm["text"] == (
        "Block 11 (N90), line 11, character 5: the word B is unknown.")
    assert {"retraction_set", "condition", "aux", "block"} <= {e["event"] for e in here.events}
    assert_same(there.events, here.events)
    assert controller.front() > 100


def test_the_two_commands_find_each_other(workdir):
    """``simulate``, two runs on it one after the other, one without its zero, and Ctrl-C."""
    command = [sys.executable, "-m", "host.cli"]
    (workdir / "part.nc").write_text(PROGRAM.replace("N90 B2\n", ""))
    folder = workdir / "out"
    for path in folder.glob("*"):
        path.unlink()
    with subprocess.Popen([*command, "simulate", "--tcp", "127.0.0.1:0", "--arm"],
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          preexec_fn=heed_ctrl_c) as started:
        said = ""
        while "Ctrl-C" not in said:
            assert started.poll() is None, started.stderr.read()
            said += started.stdout.readline()
        url = re.search(r"socket://127\.0\.0\.1:\d+", said)[0]
        runs = [subprocess.run([*command, "run", workdir / "part.nc", "--port", url, "--out",
                                folder, *options],
                               capture_output=True, text=True, check=False, timeout=300)
                for options in ([], ["--at-start"])]
        started.send_signal(signal.SIGINT)
        rest, wrong = started.communicate(timeout=60)
    assert "Only programs on this computer can connect." in said
    assert (started.returncode, wrong) == (0, "")
    assert re.search(r"^switched off after \d+\.\d s of the machine's time\.$", rest, re.M)
    assert runs[0].returncode == 2
    assert runs[0].stderr.startswith("gapkeeper: the controller does not know where its axes are: ")
    assert (runs[1].returncode, runs[1].stderr) == (0, "")
    assert "not known, as no controller tells it: pressed_mm, removed_mm3" in runs[1].stdout
    summary = json.loads((folder / "summary.json").read_text())
    assert (summary["outcome"], summary["port"]) == ("end", url)
    assert summary["pos"]["z"] == pytest.approx(0.12, abs=0.001)
    assert "removed_mm3" not in summary
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert f"controller at <b>{url}</b>" in page
    assert "seed" not in page
