# SPDX-License-Identifier: Apache-2.0
"""Event lines of the controller become the objects of ``events.jsonl``; runs are put together."""

import json
import tomllib

import pytest

from host.errors import UsageError
from host.link.link import POLL_S, LinkError
from host.machines.machine import Machine
from host.run.events import EventError, Scale, parse
from host.run.retractions import collect, most_telling
from host.run.run import Run, count_retractions, write_events
from host.tape.codes import ISO
from host.tape.tape import encode
from softcore.tables.faults import alarm_line, error_line
from softcore.tables.settings import assign
from testbench.models.controller import Controller, Pipe

SCALE = Scale(clock_hz=2_000_000)
HEAD = {"cycle": 4_000_000, "t": 2.0}
PLACE = {"line": 7, "pos": {"x": 0.0, "y": -1.5, "z": 0.0003}}


@pytest.mark.parametrize(("line", "expected"), [
    ("start,4000000,7,0,-15000,3,O12", {"event": "program_start"}),
    ("start,4000000,7,0,-15000,3,", {"event": "program_start"}),
    ("start,4000000,7,0,-15000,3", {"event": "program_start"}),
    ("block,4000000,7,0,-15000,3,G01 X1 (A, B)", {"event": "block", "text": "G01 X1 (A, B)"}),
    ("set,4000000,7,0,-15000,3,300000,5000,600000,60000,1000,-,t",
     {"event": "retraction_set", "speed": 300.0, "limit": 0.5, "high": 600.0, "low": 60.0,
      "changeover": 0.1, "ceiling": None, "source": "tape"}),
    ("set,4000000,7,0,-15000,3,300500,5000,600000,60000,0,-20000,m",
     {"event": "retraction_set", "speed": 300.5, "limit": 0.5, "high": 600.0, "low": 60.0,
      "changeover": 0.0, "ceiling": -2.0, "source": "mdi"}),
    ("condition,4000000,7,0,-15000,3,130,6000",
     {"event": "condition", "number": 130, "ip": 6, "by": "program"}),
    ("condition,4000000,7,0,-15000,3,108,5333,-22300",
     {"event": "condition", "number": 108, "ip": 5.333, "by": "series", "depth": -2.23}),
    ("aux,4000000,7,0,-15000,3,M,3", {"event": "aux", "letter": "M", "code": 3}),
    ("retract,4000000,7,0,-15000,3,s,6000,5",
     {"event": "retraction_start", "cause": "short", "speed": 6.0, "latency_cycles": 5}),
    ("retract,4000000,7,0,-15000,3,j,6000,0",
     {"event": "retraction_start", "cause": "jump", "speed": 6.0}),
    ("back,4000000,7,0,-15000,3,c,4123,299998,12",
     {"event": "retraction_end", "reason": "cleared", "distance": 0.4123, "speed": 299.998,
      "overshoot": 0.0012}),
    ("back,4000000,7,0,-15000,3,l,5000,300000,0",
     {"event": "retraction_end", "reason": "limit", "distance": 0.5, "speed": 300.0,
      "overshoot": 0.0}),
    ("back,4000000,7,0,-15000,3,p,3,-,0",
     {"event": "retraction_end", "reason": "path_start", "distance": 0.0003, "speed": None,
      "overshoot": 0.0}),
    ("advance,4000000,7,0,-15000,3,h,4123,1000,600000",
     {"event": "readvance", "phase": "high", "from": 0.4123, "to": 0.1, "speed": 600.0}),
    ("resume,4000000,7,0,-15000,3", {"event": "resume"}),
    ("alarm,4000000,7,0,-15000,3,132,Block 7 (N40), character 5: L is 0, and must not be.",
     {"event": "alarm", "code": 132,
      "text": "Block 7 (N40), character 5: L is 0, and must not be."}),
    ("end,4000000,7,0,-15000,3", {"event": "program_end"}),
])
def test_line_becomes_object(line, expected):
    event = parse(f"[E:{line}]", SCALE)
    assert event == HEAD | PLACE | expected
    assert list(event)[:5] == ["cycle", "t", "event", "line", "pos"]
    assert json.loads(json.dumps(event)) == event


@pytest.mark.parametrize("line", [
    "[E:]", "[E:end]", "[E:end,1,2]", "[E:end,x,7,0,0,0]", "[E:end,1,7,0,0,0", "[E:no,1,7,0,0,0]",
    "[E:set,1,7,0,0,0,1,2,3]", "[E:back,1,7,0,0,0,x,1,-,0]", "[E:resume,1,7,0,0,0,5]",
])
def test_nonsense_is_refused(line):
    with pytest.raises(EventError, match="cannot be read"):
        parse(line, SCALE)


def test_blocks_are_counted_as_lines_of_the_source():
    tape = encode("N40 G01 Z-1\n" * 7)
    scale = Scale(1, source=tape.line, told=tape.told)
    event = parse("[E:alarm,1,7,0,0,0,115,Block 7 (N40), character 5: no. 12 is unknown.]", scale)
    assert (event["line"], event["text"]) == (
        6, "Block 7 (N40), line 6, character 5: no. 12 is unknown.")
    assert parse("[E:end,1,0,0,0,0]", scale)["line"] == 0, "0 is no block of the tape"


MACHINE = Machine("test", tomllib.loads(
    "clock_hz = 2000000\npulses_per_mm = 10000\ninitial_gap_um = 50\nremoval_scale = 1\n"
    "[settings]\n400 = 4\n"))
TAPE = encode("%\nG01 Z-1\nM02\n")


class Simulated(Pipe):
    """The model of the controller as a simulated machine; the test moves it."""

    clock_hz = 2_000_000

    def __init__(self, controller, **options):
        super().__init__(controller, **options)
        self.place = self.path = 0
        self.armed = False

    def press_arm(self):
        self.armed = True

    @property
    def cycle(self):
        return round(self.now * self.clock_hz)

    def positions(self):
        return {"x": 0, "y": 0, "z": self.place}

    def front(self):
        return self.path

    def errors(self):
        return dict.fromkeys("xyz", 0)

    def discharges(self):
        return dict.fromkeys(("open", "ok", "dame", "short"), 0)


def ended_by(*lines):
    """A machine that sends ``lines`` when the tape has come."""
    def finish(controller):
        for line in lines:
            controller.say(line)
    controller = Controller(on_finish=finish)
    return controller, Simulated(controller)


def test_run_sets_up_as_an_operator_would():
    controller, machine = ended_by("[E:end,5,3,0,0,0]")
    run = Run(MACHINE, TAPE, machine, mdi=["g36 r300", "G21"])
    assert run.execute() == "end"
    assert machine.armed
    assert controller.lines == ["$X", assign("short_needed", 4), "$POSITION=HERE",
                                "G92 X0 Y0 Z0.0500", "G36 R300",
                                "G21"]
    assert controller.tape == TAPE.rows
    assert [event["event"] for event in run.events] == ["program_end"]


def test_alarm_before_motion_is_a_rejected_tape():
    _, machine = ended_by("[E:alarm,5,2,0,0,0,115,Block 2: no.]", alarm_line("unknown"))
    run = Run(MACHINE, TAPE, machine)
    assert run.execute() == "rejected"
    assert run.alarm == {"code": 115, "text": "Block 2, line 2: no."}
    assert len(run.events) == 1


def test_an_alarm_without_its_event_is_a_whole_event():
    _, machine = ended_by("[E:block,5,2,0,0,0,G01 Z-1]", "[MSG:Still short.]",
                          alarm_line("halt_limit"))
    machine.place = -4
    run = Run(MACHINE, TAPE, machine)
    assert run.execute() == "alarm"
    assert list(run.events[-1]) == [*parse("[E:alarm,5,2,0,0,0,141,x]", SCALE)]
    assert run.events[-1] | {"cycle": 0, "t": 0} == {
        "cycle": 0, "t": 0, "event": "alarm", "line": 2, "pos": {"x": 0.0, "y": 0.0, "z": 0.0496},
        "code": 141, "text": "Still short."}


def test_a_held_processor_is_an_alarm_of_the_machine():
    _, machine = ended_by("[E:block,5,2,0,0,0,G01 Z-1]", "[E:block,9",
                          "ALARM:155 memory parity at 0x00012340")
    run = Run(MACHINE, TAPE, machine)
    assert run.execute() == "alarm"
    assert run.alarm == {"code": 155, "text": "memory parity at 0x00012340: the processor is held "
                                              "until the controller is switched off and on."}
    assert [event["event"] for event in run.events] == ["block", "alarm"]
    assert run.events[-1]["line"] == 2


@pytest.mark.parametrize(("place", "path", "code", "outcome"), [
    (0,   0, 115, "rejected"),
    (100, 0, 115, "rejected"),   # an encoder trembles; no block has asked for that
    (0,   1, 115, "alarm"),      # one pulse, which the axis has not followed yet
    (0,   0, 141, "alarm"),     # no fault of the tape's
    (0,   0, 2, "rejected"),    # a number of grbl: the target is beyond the travel
    (0,   0, 3, "alarm"),       # ... and the operator's reset
])
def test_a_tape_is_rejected_only_before_its_first_pulse(place, path, code, outcome):
    _, machine = ended_by(f"[E:alarm,5,2,0,0,0,{code},Block 2: no.]")
    machine.place, machine.path = place, path
    assert Run(MACHINE, TAPE, machine).execute() == outcome


def test_programmed_stop_is_resumed():
    controller, machine = ended_by("[E:pause,4,3,0,0,0]", "[E:end,5,3,0,0,0]")
    run = Run(MACHINE, TAPE, machine)
    assert run.execute() == "end"
    assert controller.lines.count("$RESUME") == 1
    assert set(controller.realtime) <= {ord("?")}, "a real-time byte may be noise"
    assert len(run.events) == 1


def test_run_is_stopped_at_its_time():
    _, machine = ended_by()
    assert Run(MACHINE, TAPE, machine, until_s=3.0).execute() == "stopped"
    assert 3.0 <= machine.time_s() < 3.0 + 2 * machine.STEP_S


def test_run_is_stopped_at_its_time_while_the_tape_waits():
    """A controller whose buffer stays full for as long as its machine cuts."""
    machine = Simulated(Controller(room=64), per_ms=0)
    read = machine.read

    def silent(timeout_s):
        if not machine.controller.out:
            machine.now += max(0.0, timeout_s - machine.STEP_S)
        return read(timeout_s)

    machine.read = silent
    assert Run(MACHINE, TAPE, machine, until_s=3.0).execute() == "stopped"
    assert 3.0 <= machine.time_s() <= 3.0 + POLL_S
    assert machine.controller.realtime[-1] == ord("!")


def test_lines_by_hand_may_declare_another_zero():
    controller, machine = ended_by("[E:end,5,3,0,0,0]")
    run = Run(MACHINE, TAPE, machine)
    run.execute()
    assert run.offset == {"x": 0.0, "y": 0.0, "z": -0.05}
    assert controller.realtime == [ord("?")]
    controller, machine = ended_by("[E:end,5,3,0,0,0]")
    controller.offset = "0.0000,1.5000,-0.2000"
    run = Run(MACHINE, TAPE, machine, mdi=["G92 Y-1.5 Z0.2"])
    run.execute()
    assert run.offset == {"x": 0.0, "y": 1.5, "z": -0.2}


def test_refused_set_up_says_why():
    def script(controller, line):
        if line.startswith("$400"):
            controller.say("[MSG:setting 400 is out of range]")
            return error_line("setting")
        return "ok"
    with pytest.raises(UsageError, match=r"^machine test: settings\.400 is refused by the "
                                         r"controller: setting 400 is out of range$"):
        Run(MACHINE, TAPE, Simulated(Controller(script=script))).execute()


def test_a_refused_line_by_hand_says_why():
    def script(controller, line):
        if line == "G77":
            controller.say("[MSG:MDI, character 1: the code G77 is unknown.]")
            return error_line("unknown")
        return "ok"
    with pytest.raises(UsageError, match=r'^the line "g77" entered by hand is refused by the '
                                         r"controller: MDI, character 1: the code G77 is unknown"):
        Run(MACHINE, TAPE, Simulated(Controller(script=script)), mdi=["G90", "g77"]).execute()


@pytest.mark.parametrize(("break_it", "message"), [
    (lambda controller: controller.say("Grbl 1.1h ['$' for help]"), "started anew"),
    (lambda controller: setattr(controller, "feed", lambda data: None), "fallen silent"),
])
def test_a_dead_controller_is_noticed(break_it, message):
    controller, machine = ended_by()
    controller.on_finish = break_it
    with pytest.raises(LinkError, match=message):
        Run(MACHINE, TAPE, machine).execute()


def event(name, t=0.0, **fields):
    return {"cycle": 0, "t": t, "event": name, "line": 1, "pos": {"z": 0.0}, **fields}


RETRACTIONS = [
    event("retraction_set", limit=0.5),
    event("retraction_start", 1.0, cause="short"), event("retraction_end", 1.1, distance=0.3),
    event("readvance", 1.1, phase="high"), event("readvance", 1.2, phase="low"),
    event("retraction_start", 1.3, cause="short"), event("retraction_end", 1.4, distance=0.5),
    event("readvance", 1.4, phase="low"), event("resume", 1.6),
    event("retraction_set", limit=2.0),
    event("retraction_start", 3.0, cause="jump"), event("retraction_end", 3.1, distance=0.2),
    event("readvance", 3.2, phase="high"), event("readvance", 3.3, phase="low"),
    event("resume", 3.4),
    event("retraction_start", 5.0, cause="short"),
]


def test_retractions_are_put_together():
    first, second, third, last = collect(RETRACTIONS)
    assert (first.limit, first.distance, first.resume) == (0.5, 0.3, None)
    assert second.seconds == pytest.approx(0.3)
    assert (third.limit, third.phase("low")["t"]) == (None, 3.3)
    assert (last.end, last.distance, last.seconds) == (None, 0.0, None)
    assert most_telling([first, second, third, last]) is third
    assert count_retractions(RETRACTIONS) == {"count": 4, "short": 3, "jump": 1, "operator": 0}


def test_events_are_written_one_a_line(workdir):
    path = workdir / "events.jsonl"
    write_events(RETRACTIONS, path)
    assert [json.loads(line) for line in path.read_text().splitlines()] == RETRACTIONS
    assert TAPE.code is ISO
