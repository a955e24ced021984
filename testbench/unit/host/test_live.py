# SPDX-License-Identifier: Apache-2.0
"""A controller that runs behind a line, a run at a port, and any client.

The controller is the firmware compiled for this computer, in a thread behind TCP.
"""

import random
import re
import socket

import numpy as np
import pytest

from host.errors import UsageError
from host.link.link import LinkError
from host.link.port import Port, PortError
from host.machines.machine import Machine
from host.run.controller import Controller
from host.run.live import FORGIVEN_S, STEP_S, TELL_S, Live
from host.run.run import Run
from host.run.summary import columns_of, summary_of_controller
from host.tape.tape import encode
from testbench.live import Client, serving
from testbench.piped import CLOCK_HZ, PULSES_PER_MM, Machinery

MACHINE = Machine("model", {"clock_hz": CLOCK_HZ, "pulses_per_mm": PULSES_PER_MM,
                            "initial_gap_um": 50, "removal_scale": 1})
PROGRAM = "%\nG21 G90\nG36 R300 L0.5 H600 E60 Q0.1\nG01 X0.5 F600\nG00 X0\nM02\n%\n"
LONG = "%\nG91\nG01 X2 F60\nM02\n"    # 10 s where a pass of the firmware moves a pulse
ANSWER = re.compile(r"ok|error:\d+.*")


class Still:
    """A machine that sends nothing and whose time passes; it keeps the bytes that it gets."""

    byte_s = STEP_S / 20

    def __init__(self):
        self.now, self.came, self.moves, self.is_armed = 0.0, b"", [], False

    def write(self, data):
        self.came += data

    def read(self, timeout_s):
        self.now += timeout_s
        return b""

    def time_s(self):
        return self.now

    def button_arm(self, down):
        self.moves.append(down)
        self.is_armed = True

    def armed(self):
        return self.is_armed


class Quiet:
    """A line that records the waiting times in ``waits``."""

    url, gone = "none", 0

    def __init__(self, data=b""):
        self.data, self.waited = data, 0.0

    def take(self, most):
        now, self.data = self.data[:most], self.data[most:]
        return now

    def give(self, data):
        raise AssertionError("nothing was said")

    def wait(self, timeout_s):
        self.waited += timeout_s

    def close(self):
        pass


def firmware(**options):
    machine = Machinery(**options)
    machine.read(0.1)   # its greeting, to nobody
    return machine


def controller_at(url, **options):
    return Controller(Port(url), MACHINE, clock_hz=CLOCK_HZ, say=lambda text: None, **options)


def run_at(url, text=PROGRAM, **options):
    controller = controller_at(url)
    try:
        controller.identify(reset=False)
        job = Run(MACHINE, encode(text), controller, arm=False, **options)
        job.execute()
    finally:
        controller.port.close()
    return job


# ---- a machine that lives

def test_the_line_takes_no_more_than_it_carries():
    machine, line = Still(), Quiet(bytes(1000))
    live = Live(machine, line, print, clock=machine.time_s)
    for _ in range(10):
        live.step()
    assert 200 <= len(machine.came) <= 220


def test_a_machine_keeps_to_real_time():
    machine, line, now = Still(), Quiet(), [0.0]
    live = Live(machine, line, print, clock=lambda: now[0], sleep=lambda s: None)
    live.step()
    assert line.waited == pytest.approx(STEP_S)


def test_a_client_that_never_pauses_cannot_drive_the_machine_ahead():
    """Waiting for a client that sends takes no time, so the machine must wait for real time."""
    machine, line, now = Still(), Quiet(), [0.0]

    def sleep(seconds):
        now[0] += seconds

    live = Live(machine, line, print, clock=lambda: now[0], sleep=sleep)
    for _ in range(1000):
        live.step()
    assert machine.now == pytest.approx(1.0)
    assert now[0] == pytest.approx(1.0, abs=0.01)


def test_a_machine_that_cannot_keep_up_says_so_and_makes_nothing_up():
    machine, line, now, said = Still(), Quiet(), [0.0], []
    live = Live(machine, line, said.append, clock=lambda: now[0], sleep=lambda s: None)
    while not said:
        now[0] += 4 * STEP_S
        live.step()
    assert now[0] == pytest.approx(TELL_S, rel=0.01)
    assert said == ["the machine's time goes at 25 % of real time: this computer simulates no "
                    "faster."]
    then = machine.now
    while not line.waited:
        live.step()
    assert machine.now - then <= FORGIVEN_S + 2 * STEP_S
    while len(said) < 2:
        now[0] += STEP_S
        live.step()
    assert said[1] == "the machine's time keeps up with real time again."


def test_the_button_is_pressed_and_let_go():
    machine, line = Still(), Quiet()
    live = Live(machine, line, print, clock=machine.time_s)
    for _ in range(100):
        live.step()
    assert machine.moves == []
    live.press()
    for _ in range(100):
        live.step()
    assert machine.moves == [True, False]
    live = Live(machine := Still(), line, print, arm=True, clock=machine.time_s)
    for _ in range(200):
        live.step()
    assert machine.moves == [True, False]


# ---- who is there

def answering(answers):
    """A TCP port whose other end answers with ``answers(bytes)``."""
    class Other:
        url = "socket://other:1"
        now = 0.0
        sent = b""

        def write(self, data):
            self.sent += data

        def read(self, timeout_s):
            self.now += timeout_s
            return answers(self)

        def time_s(self):
            return self.now

    return Other()


REPORT = "<Idle|MPos:0,0,0|WCO:0,0,0|Ln:0|Er:0,0,0|Rt:0,0|Gap:0,0,0,0>\r\n"


@pytest.mark.parametrize(("says", "message"), [
    ("", "nobody answers at socket://other:1: the controller is off, a cable is unplugged, or the "
         "baud rate is wrong."),
    ("login: ", "the other end of socket://other:1 is not Gapkeeper: asked for its status, it says "
                "'login: login: login:'."),
    ("<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n",
     "the other end of socket://other:1 is not Gapkeeper: its status report has no Gapkeeper "
     "fields."),
    (REPORT.replace("Idle", "Run"),
     "the controller at socket://other:1 is at work (Run): wait until it ends, or end it with "
     "--reset."),
])
def test_who_is_not_ours_or_at_work_is_told_and_never_reset(says, message):
    other = answering(lambda other: says.encode())
    controller = Controller(other, MACHINE, clock_hz=1, say=print)
    with pytest.raises(LinkError) as caught:
        controller.identify(reset=False)
    assert str(caught.value) == message
    assert set(other.sent) == {ord("?")}


@pytest.mark.parametrize(("state", "reset"), [("Idle", False), ("Alarm", False), ("Run", True)])
def test_one_of_ours_is_reset(state, reset):
    other = answering(lambda other: REPORT.replace("Idle", state).encode())
    Controller(other, MACHINE, clock_hz=1, say=print).identify(reset=reset)
    assert other.sent == b"?\x18"


# ---- what a controller tells

def test_reports_become_columns_in_the_controllers_time():
    other = answering(lambda other: b"")
    controller = Controller(other, MACHINE, clock_hz=1, say=print)
    for at, z, sparks in ((1.0, 0.0, 100), (2.0, -0.5, 200), (3.0, -1.0, 500)):
        other.now = at
        controller.report(f"<Run|MPos:0,0,{z}|WCO:0,0,0|Ln:3|Er:0,0,7|Rt:1,0|Gap:1,{sparks},0,0>")
    controller.report("<Run|MPos:0,0|bent>")
    assert controller.positions() == {"x": 0, "y": 0, "z": -10_000}
    assert controller.errors() == {"x": 0, "y": 0, "z": 7}
    assert controller.discharges() == {"open": 0, "ok": 400, "dame": 0, "short": 0}
    assert controller.front() == 10_000
    trace = controller.trace(lambda heard: heard + 100)
    assert trace["t"] == pytest.approx(np.arange(101, 103.05, 0.1))
    assert trace["z"][5] == pytest.approx(-2500)
    assert trace["ok"].sum() == pytest.approx(400)
    assert trace["ok"][1:11] == pytest.approx([10] * 10)


def test_a_controller_that_has_told_nothing_has_an_empty_trace():
    controller = Controller(answering(lambda other: b""), MACHINE, clock_hz=1, say=print)
    assert controller.front() == 0
    assert len(controller.trace(lambda heard: heard)["t"]) == 1
    assert sum(controller.discharges().values()) == 0


def test_an_axis_that_trembles_has_not_moved():
    controller = Controller(answering(lambda other: b""), MACHINE, clock_hz=1, say=print)
    for z in (0.0, 0.0002, -0.0001):
        controller.report(f"<Idle|MPos:0,0,{z}|WCO:0,0,0|Ln:3|Er:0,0,0|Rt:0,0|Gap:0,0,0,0>")
    assert controller.front() == 0


def test_the_button_is_waited_for():
    said, fields = [], ["", "", "|Armed"]
    controller = Controller(answering(lambda other: b""), MACHINE, clock_hz=1, say=said.append)

    def poll():
        controller.report(REPORT.strip().replace(">", f"{fields.pop(0)}>"))

    controller.press_arm(poll)
    assert said == ['press the button "arm" at the machine']
    assert not fields


def test_a_button_that_nobody_presses_ends_the_wait():
    other = answering(lambda other: b"")
    controller = Controller(other, MACHINE, clock_hz=1, say=print)

    def poll():
        other.now += 1
        controller.report(REPORT.strip())

    with pytest.raises(UsageError, match=r'^nobody has pressed the button "arm" within 60 s; '):
        controller.press_arm(poll)


# ---- a run

def plain(events):
    return [{name: value for name, value in event.items() if name not in ("cycle", "t")}
            for event in events]


def test_a_run_at_a_port_tells_what_a_run_in_simulation_tells():
    """The model of the hardware has nothing random: all but the times is the same."""
    machine = Machinery()
    here = Run(MACHINE, encode(PROGRAM), machine)
    here.execute()
    with serving(firmware()) as (url, _):
        there = run_at(url)
        again = run_at(url)
    assert len(here.events) > 6
    assert there.outcome == again.outcome == here.outcome == "end"
    assert plain(there.events) == plain(here.events)
    assert plain(again.events) == plain(here.events)
    # The trace counts time as the events do: from the controller's start, not the connection's.
    trace = columns_of(again, again.simulation)
    assert trace["t"][0] > there.events[-1]["t"]
    assert trace["t"][-1] == pytest.approx(again.events[-1]["t"], abs=0.3)


@pytest.mark.parametrize("refused", [False, True])
def test_behind_a_run_anybody_may_talk_to_the_controller(refused):
    """Without numbers, as senders do; also where the run has not begun."""
    with serving(firmware()) as (url, _):
        if refused:
            with pytest.raises(UsageError, match="does not know where"):
                run_at(url, at_start=False)
        else:
            assert run_at(url).outcome == "end"
        client = Client(Port(url))
        assert client.ask("$I")[-1] == "ok"
        assert client.ask("G91 G00 X0.1")[-1] == ("error:154" if refused else "ok")
        client.port.close()


def test_without_a_declared_start_the_controllers_zero_holds():
    with serving(firmware()) as (url, _):
        with pytest.raises(UsageError, match=r"^the controller does not know where its axes are: "):
            run_at(url, at_start=False)
        first = run_at(url)
        job = run_at(url, at_start=False, mdi=["G92 X5"])
    assert first.events[-1]["pos"]["x"] == 0
    assert job.offset["x"] == pytest.approx(-5)


def test_a_programmed_stop_waits_until_it_is_resumed():
    asked = []

    def goes_on(_):
        asked.append(True)
        return len(asked) > 3

    with serving(firmware()) as (url, _):
        job = run_at(url, "%\nG90\nM00\nG00 X0.1\nM02\n", goes_on=goes_on)
    assert (job.outcome, len(asked)) == ("end", 4)


def test_an_interrupted_run_is_held_reported_and_leaves_the_controller_free():
    with serving(firmware(pulses_per_pass=1)) as (url, _):
        controller = controller_at(url)
        controller.identify(reset=False)
        job = Run(MACHINE, encode(LONG), controller, arm=False)
        job.watch = lambda run: run.interrupt() if run.simulation.front() > 100 else None
        assert job.execute() == "stopped"
        controller.port.close()
        summary = summary_of_controller(job, controller, columns_of(job, controller))
        assert summary["pos"]["x"] > 0.01
        assert summary["port"] == url
        assert run_at(url).outcome == "end"


def test_a_connection_lost_in_the_middle_of_a_run_is_one_sentence():
    with serving(firmware(pulses_per_pass=1)) as (url, said):
        controller = controller_at(url)
        controller.identify(reset=False)
        job = Run(MACHINE, encode(LONG), controller, arm=False)

        def cut(run):
            if run.simulation.front():
                controller.port._serial._socket.shutdown(socket.SHUT_RDWR)

        job.watch = cut
        with pytest.raises(PortError, match=rf"^the connection over {url} is lost: "):
            job.execute()
        assert job.began
        assert job.events
        controller.port.close()
        with pytest.raises(LinkError, match="is at work"):
            run_at(url)
    assert "the client has gone." in said


def test_a_second_client_is_told_why_it_has_no_controller():
    with serving(firmware()) as (url, said):
        first = Client(Port(url))
        assert first.ask("$I")[-1] == "ok"
        with pytest.raises(PortError, match=rf"^{url} closes the connection at once: it may have "
                                            r"another client\.$"):
            run_at(url)
        assert first.ask("$I")[-1] == "ok"
        first.port.close()
    assert "a client is turned away: there is one already." in said


# ---- any client

def test_half_a_line_waits_for_its_other_half():
    with serving(firmware()) as (url, _):
        client = Client(Port(url))
        client.send("$")
        assert client.port.read(0.3) == b""
        assert client.ask("I")[-1] == "ok"
        client.port.close()


MOVE = "G91 G01 X0.01 F600"
WORDS = [MOVE, MOVE, MOVE, MOVE, "$X", "$#", "$L", "$$", "G21", "(a comment)", "G77", "$Q", "M99",
         "G04 P1", "$POSITION=HERE", "@7 broken*0000", "G01 Y", "X0.5.5", "M05"]


@pytest.mark.parametrize("left", ["G91 G01 F600 X1", "G91 G01 F600 X", "\x02\x05\x01AB"])
def test_the_next_client_completes_nothing_that_one_has_left(left):
    """A sender for grbl begins with a line end, which would complete half a motion's line."""
    machine = firmware()
    with serving(machine) as (url, _):
        client = Client(Port(url))
        for line in ("$X", "$POSITION=HERE"):
            assert client.ask(line)[-1] == "ok"
        client.send(left)
        client.port.close()
        client = Client(Port(url))
        client.send("\n5\n")
        client.lines_until(lambda lines: sum(bool(ANSWER.fullmatch(one)) for one in lines) == 2)
        assert client.ask("G04 P20")[-1] == "ok"
        client.port.close()
    assert set(machine.positions().values()) == {0}


@pytest.mark.parametrize("seed", range(3))
def test_a_random_client_gets_one_answer_a_line_and_the_motion_that_it_asked_for(seed):
    """Whole and half lines, nonsense, `?` `!` `~` anywhere, leaving and coming back."""
    rng = random.Random(seed)
    moves = 0

    def all_answered(came):
        done = "[FIRMWARE:" in "".join(came[-2:-1])
        if not done:
            client.send("~")    # one that came with a `!` has done nothing: the hold wins
        return done

    with serving(firmware()) as (url, _):
        client = Client(Port(url))
        for line in ("$X", "$POSITION=HERE"):
            assert client.ask(line)[-1] == "ok"
        for _ in range(60):
            lines = rng.choices(WORDS, k=rng.randint(1, 3))
            text = "".join(f"{line}\n" for line in lines)
            if rng.random() < 0.2:      # half a line, by a client that is gone then
                half = len(lines[0]) // 2
                client.send(text[:half])
                text = text[half:]
                client.port.close()
                client = Client(Port(url))
            for char in text:
                client.send(char)
                if rng.random() < 0.05:
                    client.send(rng.choice("??!~"))
            client.send("~$I\n")    # whose answer is the last one
            came = client.lines_until(all_answered)
            answers = [line for line in came if ANSWER.fullmatch(line)]
            assert len(answers) == len(lines) + 1, (lines, came)
            moves += sum(answer == "ok" and line == MOVE
                         for answer, line in zip(answers, [*lines, "$I"], strict=True))
        report = [""]
        for _ in range(60):
            if report[-1].startswith("<Idle"):
                break   # before that it is still on its way, or held by a `!`
            client.send("~?")
            report = client.lines_until(lambda came: any(line.startswith("<") for line in came))
        client.port.close()
    assert moves > 10
    assert f"MPos:{moves * 0.01:.4f}," in report[-1]
