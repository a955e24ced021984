# SPDX-License-Identifier: Apache-2.0
"""The panel without its page: who holds the controls, jogging, the session with a controller.

The controller is a script of answers, or the firmware compiled for this computer.
"""

import re
import threading
import time

import pytest

from host.errors import UserError
from host.link.framing import crc
from host.link.link import HOLD, RESET, STATUS
from host.machines.machine import Machine
from host.panel.heard import Heard
from host.panel.job import Job
from host.panel.session import CANCEL, Session
from host.panel.sharing import LEASE_S, SILENT_S, Jog, Sharing
from host.panel.wires import Remote
from host.run.events import Scale
from softcore.tables.settings import named
from testbench.live import serving
from testbench.piped import CLOCK_HZ, PULSES_PER_MM, Firmware
from testbench.punch import TAPES

MACHINE = Machine("model", {"clock_hz": CLOCK_HZ, "pulses_per_mm": PULSES_PER_MM,
                            "initial_gap_um": 50, "removal_scale": 1, "settings": {"408": 19}})
SETTING = named("repeats")
REPORT = ("<{state}|MPos:1.0000,2.0000,3.0000|Bf:56,255|Ln:0|FS:0.000,0|WCO:0.5000,0.0000,1.0000|"
          "Ov:100,100,100|Er:0,0,0|Rt:0,0|Gap:{gap}|Armed>")
DEADLINE_S = 20.0


class Clock:
    """A clock that is set by hand."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


class Frozen:
    """The computer's clock, which can be stopped: then no time-out does what an order should do."""

    stopped = None

    def __call__(self):
        return time.monotonic() if self.stopped is None else self.stopped

    def stop(self):
        self.stopped = time.monotonic()


class Script:
    """A controller that takes every line but those that ``refuses`` names."""

    simulated, clock_hz, pace = True, CLOCK_HZ, ""
    armed = False

    def __init__(self, refuses=""):
        self.refuses, self.lines, self.bytes, self.state = refuses, [], b"", "Idle"
        self.answers = b"Grbl 1.1h ['$' for help]\r\n"
        self._rest = b""

    def write(self, data):
        for byte in (STATUS, HOLD, RESET, CANCEL):
            self.bytes += byte * data.count(byte)
        if STATUS in data:
            self.say(REPORT.format(state=self.state, gap="0,0,0,0"))
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            told, _, check = line.rpartition(b"*")
            if not told:
                continue
            told = told[told.index(b"@"):]
            assert int(check, 16) == crc(told)
            number, _, text = told.decode().partition(" ")
            self.lines.append(text)
            if self.refuses and text.startswith(self.refuses):
                self.say("[MSG:this controller does not jog.]")
                self.say(f"error:20 {number}")
            else:
                self.say(f"ok {number}")

    def say(self, line):
        self.answers += line.encode() + b"\r\n"

    def read(self, timeout_s):
        time.sleep(min(timeout_s, 0.002))
        said, self.answers = self.answers, b""
        return said

    def time_s(self):
        return time.monotonic()

    def arm(self):
        self.armed = True

    def voltage(self):
        return 40.0

    def close(self):
        self.closed = True


class Board(Firmware):
    """The firmware on this computer, slowly enough that a test can act while it works."""

    simulated, pace = True, ""

    def read(self, timeout_s):
        time.sleep(0.001)
        return super().read(min(timeout_s, 0.005))

    def arm(self):
        self.press_arm()

    def voltage(self):
        return None

    def close(self):
        pass


@pytest.fixture
def serve():
    """Begin a session with a wire; it ends with the test."""
    begun = []

    def begin(wire, clock=time.monotonic):
        session = Session(MACHINE, lambda say: wire, clock)
        begun.append(session)
        session.start()
        until(lambda: session.link != "starting")
        assert session.link == "connected", session.notice
        until(lambda: session.heard.state)
        return session

    yield begin
    for session in begun:
        session.close()


def until(condition, seen=lambda: None):
    """Wait for a condition; ``seen`` is called meanwhile, as a page would."""
    end = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < end, "it has not happened in time"
        seen()
        time.sleep(0.01)


# ---- sharing

def test_one_page_holds_the_controls_and_nobody_is_robbed_of_them():
    sharing = Sharing(Clock())
    assert sharing.holder is None
    assert sharing.take("a")
    assert not sharing.take("b")
    assert sharing.take("a")
    sharing.let_go("b")
    assert sharing.holder == "a"
    sharing.let_go("a")
    assert sharing.take("b")
    assert sharing.pages == 2


@pytest.mark.parametrize("leaves", [True, False])
def test_a_page_that_goes_or_falls_silent_lets_go_of_the_controls(leaves):
    clock = Clock()
    sharing = Sharing(clock)
    sharing.take("a")
    clock.now = SILENT_S
    assert sharing.holder == "a"
    if leaves:
        sharing.gone("a")
    else:
        clock.now = SILENT_S + 0.01
    assert sharing.holder is None
    assert sharing.pages == 0
    assert sharing.take("b")


# ---- jogging

@pytest.mark.parametrize("feed", [0.1, 10, 59.9, 600])
def test_a_jog_is_ordered_in_segments_that_end_by_themselves(feed):
    """At any moment at most 0.2 s of motion are still to be made; the lengths add up."""
    clock = Clock()
    jog = Jog("X", -1, feed, clock=clock, machine_s=clock)
    way, ordered_s = 0.0, 0.0
    while clock.now < 3:
        assert jog.renew("X", -1, feed)
        while line := jog.segment():
            match = re.fullmatch(r"\$J=G91 G21 X-(\d+\.\d{4}) F(\S+)", line)
            assert float(match[2]) == feed
            way += float(match[1])
            ordered_s += jog.SEGMENT_S
            assert ordered_s <= clock.now + 0.2 + 1e-9
        assert ordered_s >= clock.now   # and the motion has no pause
        clock.now += 0.01
    assert way == pytest.approx(ordered_s * feed / 60, abs=1e-4)


def test_a_jog_that_nobody_renews_ends():
    clock = Clock()
    jog = Jog("Z", 1, 60, clock=clock, machine_s=clock)
    assert jog.segment() == "$J=G91 G21 Z0.1000 F60"
    assert not jog.renew("Z", -1, 60)
    assert not jog.renew("X", 1, 60)
    clock.now = LEASE_S + 0.01
    assert jog.over
    assert not jog.renew("Z", 1, 60)
    assert jog.segment() is None


def _jogging(serve, wire, clock=time.monotonic):
    session = serve(wire, clock)
    assert session.take("a")
    assert session.order("a", "jog", "X", 1, 60.0) == ""
    return session


def jogs(wire):
    return [line for line in wire.lines if line.startswith("$J=")]


@pytest.mark.parametrize("how", ["release", "silence", "gone", "hold", "let go"])
def test_a_jog_is_cancelled_and_no_segment_follows(serve, how):
    wire, clock = Script(), Frozen()
    session = _jogging(serve, wire, clock)

    def renew():
        session.order("a", "jog", "X", 1, 60.0)

    until(lambda: len(jogs(wire)) > 4, renew)
    assert not wire.bytes.count(CANCEL)
    if how != "silence":
        clock.stop()
    {"release": lambda: session.order("a", "jog_end"), "silence": lambda: None,
     "gone": lambda: session.gone("a"), "hold": lambda: session.order("a", "hold"),
     "let go": lambda: session.let_go("a")}[how]()
    until(lambda: wire.bytes.count(CANCEL))
    sent = len(jogs(wire))
    time.sleep(0.3)
    assert len(jogs(wire)) == sent
    assert wire.bytes.count(CANCEL) == 1
    assert wire.bytes.count(HOLD) == (how == "hold")


@pytest.mark.parametrize("leaves", [Session.gone, Session.let_go])
def test_a_jog_that_was_typed_ends_with_its_page(serve, leaves):
    wire = Script()
    session = serve(wire)
    session.take("a")
    session.order("a", "line", "$j=g91 x100 f60")
    until(lambda: jogs(wire), lambda: session.seen("a"))
    assert CANCEL not in wire.bytes
    leaves(session, "a")
    until(lambda: CANCEL in wire.bytes)


def test_a_controller_that_knows_no_jog_says_so_in_one_line(serve):
    wire = Script(refuses="$J=")
    session = _jogging(serve, wire)
    until(lambda: "refused" in session.notice)
    time.sleep(0.3)
    assert len(jogs(wire)) == 1
    assert [text for _, text in session.notices if "refused" in text] == [
        "$J=G91 G21 X0.1000 F60 is refused: this controller does not jog."]


def test_the_firmware_jogs_as_long_as_the_button_is_pressed(serve):
    board = Board(pulses_per_pass=20)
    session = serve(board)
    session.take("a")
    session.order("a", "line", "$POSITION=HERE")
    until(lambda: session.notice == "$POSITION=HERE: ok", lambda: session.seen("a"))
    before = board.positions()

    def pressed():
        session.seen("a")
        session.order("a", "jog", "X", -1, 600.0)

    until(lambda: session.heard.state == "Jog", pressed)
    until(lambda: board.positions()["x"] < before["x"] - 5000, pressed)
    session.order("a", "jog_end")
    until(lambda: session.heard.state == "Idle", lambda: session.seen("a"))
    at = board.positions()
    time.sleep(0.3)
    assert board.positions() == at
    assert all(at[axis] == before[axis] for axis in "yz")
    assert at["x"] > before["x"] - 20_000, "it has gone on after the release"


# ---- the session

@pytest.mark.parametrize("order", [("hold",), ("resume",), ("retract",), ("stop",), ("arm",),
                                   ("line", "G00 X1"), ("jog", "X", 1, 60.0), ("run",),
                                   ("jog_end",), ("choose", None), ("connect",)])
def test_a_page_that_watches_can_touch_nothing(serve, order):
    wire = Script()
    session = serve(wire)
    assert session.take("a")
    job, asked = session.job, wire.bytes.replace(STATUS, b"")
    assert session.order("b", *order).startswith("This page only watches")
    time.sleep(0.1)
    assert wire.bytes.replace(STATUS, b"") == asked
    assert not wire.armed
    assert session.job is job
    assert "G00 X1" not in wire.lines
    assert not jogs(wire)
    assert session.link == "connected"


def test_a_stop_holds_first_and_resets_at_rest(serve):
    wire = Script()
    session = serve(wire)
    session.take("a")
    wire.state = "Run"
    until(lambda: session.heard.state == "Run")
    wire.state = "Hold:1"
    session.order("a", "stop")
    until(lambda: HOLD in wire.bytes)
    time.sleep(0.5)
    assert RESET not in wire.bytes
    wire.state = "Hold:0"
    until(lambda: RESET in wire.bytes)


def test_a_line_that_is_no_line_is_not_sent(serve):
    wire = Script()
    session = serve(wire)
    session.take("a")
    assert "no character of a block" in session.order("a", "line", "G00 X?")
    assert "empty" in session.order("a", "line", " ")
    assert session.order("a", "line", "g00 x2") == ""
    until(lambda: "G00 X2" in wire.lines)
    until(lambda: session.notice == "G00 X2: ok")


def test_a_failure_to_connect_is_one_sentence_and_is_tried_again_by_order():
    tries = []

    def connect(say):
        tries.append(say)
        if len(tries) == 1:
            raise UserError("nobody listens.")
        return Script()

    session = Session(MACHINE, connect)
    session.start()
    until(lambda: session.link == "lost")
    assert session.notice == "Nobody listens."
    session.take("a")
    assert session.order("a", "hold") == "There is no connection to the controller."
    assert session.order("a", "connect") == ""
    until(lambda: session.link == "connected")
    session.close()


def test_an_end_in_motion_holds_waits_for_rest_and_resets(serve):
    wire = Script()
    session = serve(wire)
    wire.state = "Run"
    until(lambda: session.heard.state == "Run")

    def rest_after_hold():
        if HOLD in wire.bytes and wire.state == "Run":
            wire.state = "Hold:0"
        assert RESET not in wire.bytes or wire.state == "Hold:0"

    session._over.set()
    until(lambda: RESET in wire.bytes, rest_after_hold)
    assert wire.bytes.index(HOLD) < wire.bytes.index(RESET)
    session.close()
    assert wire.closed


def test_a_controller_at_a_port_is_asked_who_it_is_and_keeps_its_lock(serve):
    class Machinery(Board):
        byte_s = 1e-5

        def button_arm(self, down):
            pass

        def armed(self):
            return False

    with serving(Machinery()) as (url, _):
        said = []
        session = serve(Remote(url, MACHINE, baud=1_000_000, clock_hz=CLOCK_HZ, say=said.append))
        assert not session.simulated
        assert session.heard.state == "Alarm"   # locked: nobody has unlocked it
        assert session.heard.settings[SETTING.number] == str(SETTING.default)
        assert session.take("a")
        assert session.order("a", "line", "$X") == ""
        until(lambda: session.notice == "$X: ok", lambda: session.seen("a"))
        session.close()


def test_a_start_that_takes_long_does_not_keep_the_panel_from_closing():
    waits = threading.Event()
    session = Session(MACHINE, lambda say: waits.wait(DEADLINE_S))
    session.start()
    began = time.monotonic()
    session.close()
    assert time.monotonic() - began < DEADLINE_S / 2
    waits.set()


def test_a_setting_is_changed_and_read_back_from_the_firmware(serve):
    session = serve(Board())
    session.take("a")
    assert session.heard.settings[SETTING.number] == "19"   # of the machine's file
    session.order("a", "line", f"${SETTING.number}=12")
    until(lambda: session.heard.settings[SETTING.number] == "12", lambda: session.seen("a"))
    session.order("a", "line", f"${SETTING.number}={SETTING.highest + 1}")
    until(lambda: "refused" in session.notice, lambda: session.seen("a"))


def test_a_run_is_begun_held_resumed_and_watched_to_its_end(serve):
    session = serve(Board(pulses_per_pass=20))
    session.take("a")
    assert session.order("a", "run") == "No tape is chosen."
    job = Job.of(TAPES / "sink_shallow_deep.nc")
    assert session.order("a", "choose", job) == ""
    assert "not armed" in session.order("a", "run")
    session.order("a", "arm")
    until(lambda: "Armed" in session.heard.fields, lambda: session.seen("a"))
    assert session.order("a", "run") == ""
    until(lambda: session.heard.place[2] < -0.2, lambda: session.seen("a"))
    assert session.order("a", "choose", job) == "A tape is running."
    assert "starts from Idle" in session.order("a", "jog", "X", 1, 60.0)
    session.order("a", "hold")
    until(lambda: session.heard.state == "Hold:0", lambda: session.seen("a"))
    deep = session.heard.place[2]
    time.sleep(0.2)
    assert session.heard.place[2] == deep
    session.order("a", "resume")
    until(lambda: not session.running, lambda: session.seen("a"))
    assert session.heard.ended == "end"
    told = [text for _, text in session.heard.record]
    assert told[0] == "The program has begun."
    assert told[-1] == "The program has ended."
    assert session.heard.block.startswith("N") or "M02" in session.heard.block
    assert job.lines[session.heard.line - 1].strip() == session.heard.block


# ---- what is heard

def test_a_report_gives_places_in_the_frame_of_the_program_and_shares_of_new_pulses():
    heard = Heard(Scale(CLOCK_HZ, PULSES_PER_MM))
    heard.hear(REPORT.format(state="Hold:1", gap="4294967295,10,0,0"), 0.0, 41.0)
    heard.hear(REPORT.format(state="Hold:1", gap="1,14,0,2"), 0.1, 42.0)
    assert heard.place == (0.5, 2.0, 2.0)
    assert heard.state == "Hold:1"
    assert "retracting" in heard.meaning
    last = heard.samples[-1]
    assert (last.pulses, last.volts) == (8, 42.0)
    assert last.shares == pytest.approx((0.25, 0.5, 0.0, 0.25))
    assert len(heard.trail) == 1    # a machine at rest leaves no trail


@pytest.mark.parametrize("line", ["<Run|MPos:1,2", "<Run>", "<Run|MPos:1,2,x|FS:|Gap:1>", "[E:bloc",
                                  "[E:nothing,1,2,3,4,5]", "$=", "$x=1", ""])
def test_a_damaged_line_changes_no_picture(line):
    heard = Heard(Scale(CLOCK_HZ, PULSES_PER_MM))
    heard.hear(line, 0.0)
    assert not heard.samples
    assert not heard.settings
    assert heard.place in ((), (1.0, 2.0)) or not heard.place


def test_an_alarm_stays_until_the_machine_is_unlocked():
    heard = Heard(Scale(CLOCK_HZ, PULSES_PER_MM))
    heard.hear("[MSG:The limit switch of X is pressed.]", 0.0)
    heard.hear("ALARM:1", 0.0)
    heard.hear(REPORT.format(state="Alarm", gap="0,0,0,0"), 0.1)
    assert heard.alarm == (1, "The limit switch of X is pressed.")
    assert heard.ended == "alarm"
    heard.hear(REPORT.format(state="Idle", gap="0,0,0,0"), 0.2)
    assert heard.alarm is None
