# SPDX-License-Identifier: Apache-2.0
"""The status report and the overrides of the simulated controller, compared with its machine."""

import math
import re
from collections import Counter

import pytest

from host.link.link import fields_of
from host.machines import machine as machines
from softcore.linkmap import DOOR, OVERRIDE_BYTES, REALTIME
from softcore.tables.faults import error_line
from softcore.tables.settings import assign, named
from testbench.native.simulation import Simulation
from testbench.some import some

MACHINE = machines.load("sinker")
MM = 10_000             # pulses
DRIVE_S = 4.096e-3      # lag of a drive in the controller's model of it
REST_PULSES = 2         # that an axis may still creep when it is at rest,
REST_MM_S = 0.02        # or by its speed
PATIENCE_S = 20.0
LINK_STEP = 6500        # clocks of the link's task, of the watchdog's 10 000
DATA = "G36 R300 L20 H600 E60 Q0.05"    # a limit further away than any retraction here lasts
ACTING = {one.byte: one.name for one in REALTIME} | {DOOR: "hold"}
OVERRIDES = {one.byte for one in OVERRIDE_BYTES}


class Hand:
    """A terminal, without numbers and checks, and an operator's hands and eyes at the machine."""

    def __init__(self, session):
        self.session = session
        self.text = ""
        session.set("force.short", 0)
        session.set("force.gap_um", 30.0)
        self.until("Grbl ")
        self.unlock()

    def until(self, *ends):
        """Wait until one of some beginnings of lines has come, whole; that line."""
        end = self.session.cycle + PATIENCE_S * self.session.clock_hz
        while True:
            *lines, self.text = self.text.split("\n")
            for number, line in enumerate(lines):
                if line.startswith(ends):
                    self.text = "\n".join([*lines[number + 1:], self.text])
                    return line.strip()
            assert self.session.cycle < end, f"{ends} did not come"
            self.text += self.session.receive(2000).decode("ascii")

    def enter(self, *lines):
        """Send lines, each when the one before has been answered; none is refused."""
        for line in lines:
            self.session.send(line.encode() + b"\n")
            assert self.until("ok", "error:") == "ok", line

    def unlock(self):
        self.enter("$X")
        self.session.press_arm()
        self.enter("$POSITION=HERE", "G91 G94")

    def press(self, *data):
        self.session.send(bytes(data))
        self.run(0.005)

    def run(self, seconds):
        self.session.run(round(seconds * self.session.clock_hz))

    def report(self):
        self.session.send(b"?")
        line = self.until("<")
        return fields_of(line) | {"state": line[1:].partition("|")[0]}

    @property
    def speed(self):
        """Of the axes, mm/s: of the fastest."""
        return max(abs(self.session.get(f"read.{axis}_speed_mm_s")) for axis in "xyz")

    def pace(self, seconds=0.2):
        """Speed along the path, mm/min."""
        at = self.session.probe("path_position")
        self.run(seconds)
        return (self.session.probe("path_position") - at) / MM / seconds * 60

    def rest(self):
        for _ in range(2000):
            if self.report()["state"] == "Idle":
                return
            self.run(0.01)
        raise TimeoutError(self.report())


@pytest.fixture
def hand():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        yield Hand(session)


@pytest.mark.parametrize("line", ["$130=200", "$C", "G41 D1", "$ES=", "$RESUMED", "#1=2"])
def test_a_refusal_takes_no_longer_than_other_steps(hand, line):
    """Its reason in words is told apart from the work of finding it."""
    def longest():
        hand.session.send(b"$P\n")
        return int(re.search(r"link (\d+)", hand.until("[PRF"))[1])

    longest()
    hand.session.send(line.encode() + b"\n")
    hand.until("error:")
    assert longest() < LINK_STEP


def test_what_guards_the_machine_stays_while_an_axis_creeps(hand):
    """Below the start/stop speed the ramp is at rest between two pulses; the axis is not."""
    hand.enter("G01 Z0.3 F60")
    for setting, value in (("step_axes", 1), ("reversed_encoders", 1), ("follow_moving", 1),
                           ("loop_gain", 10)):
        hand.session.send(f"{assign(setting, value)}\n".encode())
        assert hand.until("ok", "error:") == error_line("busy"), setting
    while hand.report()["state"] != "Idle":
        hand.run(0.05)
    hand.enter(assign("follow_moving", 5000))


@pytest.mark.parametrize("move", some(
    ["G00 X2 Y-1", "G01 Z0.2 F300", "G02 X1 Y1 I1 J0 F900"]))
def test_idle_is_told_at_rest_only(hand, move):
    hand.rest()
    hand.enter(move)
    seen, place = Counter(), ""
    while seen["Idle"] < 20:
        told = hand.report()
        seen[told["state"]] += 1
        if told["state"] == "Idle":
            place = place or told["MPos"]
            assert max(abs(int(error)) for error in told["Er"].split(",")) <= REST_PULSES
        else:
            assert (told["state"], seen["Idle"]) == ("Run", 0)
    assert seen["Run"] > 5
    hand.run(0.5)
    for then, now in zip(place.split(","), hand.report()["MPos"].split(","), strict=True):
        assert abs(float(then) - float(now)) <= REST_PULSES / MM + 1e-9


def test_never_idle_while_it_burns(hand):
    hand.enter("C100", "M03")
    hand.run(0.1)
    sparks = hand.session.discharges()
    for _ in range(20):
        told = hand.report()
        assert (told["state"], told["A"]) == ("Run", "S")
        hand.run(0.002)
    assert hand.session.discharges() != sparks
    hand.enter("M05")
    hand.rest()


def test_a_hold_is_complete_at_rest(hand):
    hand.enter("G00 X5")
    hand.run(0.05)
    assert hand.speed > 5
    hand.press(0x21)
    seen = []
    while not seen or seen[-1] != "Hold:0":
        before = hand.speed
        seen.append(hand.report()["state"])
        assert seen[-1] in ("Hold:1", "Hold:0")
        if before > 1:
            assert seen[-1] == "Hold:1"
    assert hand.speed < REST_MM_S
    assert seen.count("Hold:1") > 2
    assert 0 < hand.session.probe("path_position") < 5 * MM
    hand.press(0x7E)
    assert hand.report()["state"] == "Run"
    hand.rest()
    assert hand.report()["MPos"].startswith("5.000")


def test_the_feed_is_told_as_it_is(hand):
    hand.enter("G01 X50 F150")
    hand.run(1.0)
    assert float(hand.report()["FS"].split(",")[0]) == pytest.approx(150, rel=0.02)
    hand.press(0x92, 0x92)
    hand.run(1.0)
    assert float(hand.report()["FS"].split(",")[0]) == pytest.approx(120, rel=0.02)


def test_overrides_act_in_the_block_under_way(hand):
    """The feed of a long line, above the start/stop speed as well; then a rapid's."""
    hand.enter("G01 X100 F500")
    hand.run(0.1)
    for presses, percent in (((), 100), ((0x91,) * 3, 130), ((0x91,) * 20, 200), ((0x94,), 199),
                             ((0x92,) * 19, 10), ((0x90,), 100)):
        hand.press(*presses)
        hand.run(0.05)
        assert hand.report()["Ov"] == f"{percent},100,100"
        assert hand.pace() == pytest.approx(5 * percent, rel=0.01)
    hand.press(0x97)
    assert hand.pace() == pytest.approx(500, rel=0.01), "the rapids' does not scale a feed"
    hand.press(0x18)
    hand.until("Grbl ")
    assert hand.report()["Ov"] == "100,100,100"
    hand.unlock()
    hand.enter("G00 X100")
    hand.run(0.5)
    fast = hand.pace(0.1)
    hand.press(0x92)
    assert hand.pace(0.1) == pytest.approx(fast, rel=0.01), "the feed's does not scale a rapid"
    for byte, share in ((0x96, 0.5), (0x97, 0.25), (0x95, 1)):
        hand.press(byte)
        hand.run(0.5)
        assert hand.pace(0.1) == pytest.approx(share * fast, rel=0.01)


def test_an_arc_goes_as_fast_as_the_lag_of_the_axes_allows(hand):
    """F1200 on a radius of 3 mm: the root of twice radius times deviation, times a gain.

    The gain is that of a loop of first order that would leave the arc as far as the loop as
    delivered does, feed-forward and a drive a tenth slower than set: 1.72 times ``$456``.
    """
    radius_mm, deviation_mm = 3, named("arc_deviation_nm").default / 1e6
    gain, slow = named("loop_gain").default, 0.9
    lag = gain * DRIVE_S
    gain /= math.sqrt(((1 + lag) / slow) ** 2 - 2 * lag / slow - 1)
    bound = 60 * gain * math.sqrt(2 * radius_mm * deviation_mm)
    assert bound == pytest.approx(566.2, abs=0.1)
    hand.rest()
    start = hand.session.positions()
    hand.enter("G02 I3 F1200")
    hand.press(0x91, 0x91)
    hand.run(0.3)
    assert hand.pace(0.5) == pytest.approx(bound, rel=0.005)
    assert float(hand.report()["FS"].split(",")[0]) == pytest.approx(bound, rel=0.01)
    inside = []
    for _ in range(100):
        place = hand.session.positions()
        inside.append(radius_mm - math.hypot(place["x"] - start["x"] - radius_mm * MM,
                                             place["y"] - start["y"]) / MM)
        hand.run(0.01)
    assert 0 < max(inside) < deviation_mm + REST_PULSES / MM
    hand.rest()


def test_a_slower_feed_ahead_is_reached_at_its_border(hand):
    """Rapids are faster than the feed behind them, whatever the overrides say."""
    hand.press(*(0x91,) * 10)
    hand.enter("G00 X2", "G01 X2 F300")
    hand.run(0.05)
    hand.press(*(0x92,) * 15, 0x96)
    while hand.session.probe("path_position") < 2 * MM + 100:
        hand.run(0.001)
    assert hand.pace(0.05) == pytest.approx(300 * 0.5, rel=0.02)
    hand.rest()


def test_a_retraction_keeps_its_speed(hand):
    """With the feed at 200 % and at 10 %: R, H and E are unchanged."""
    found = []
    for byte in (0x90, 0x91, 0x92):
        hand.enter(DATA, "C100", "M03")
        hand.press(*(byte,) * 20)
        hand.enter("G01 X2 F60")
        hand.run(0.5)
        at = hand.session.cycle
        hand.session.set("force.short", 1)
        hand.run(0.03)
        back = hand.pace(0.02)
        hand.session.set("force.short", 0)
        hand.run(0.002)
        line = hand.until("[E:back")
        found.append(round(back))
        assert back == pytest.approx(-300, rel=0.02), line
        assert hand.session.cycle > at
        hand.press(0x18)
        hand.until("Grbl ")
        hand.unlock()
    assert max(found) - min(found) <= 3


def test_the_spindle_stop_puts_the_discharge_off_in_a_hold_alone(hand):
    hand.enter(DATA, "C100", "M03", "G01 X2 F60")
    hand.run(0.2)

    def sparks(seconds=0.05):
        before = sum(hand.session.discharges().values())
        hand.run(seconds)
        return sum(hand.session.discharges().values()) - before

    hand.press(0x9E)
    assert sparks()
    hand.press(0x21)
    while hand.report()["state"] != "Hold:0":
        pass
    assert sparks()
    for _ in range(2):
        hand.press(0x9E)
        assert not sparks()
        assert "A" not in hand.report()
    at = hand.session.probe("path_position")
    hand.press(0x7E)
    assert sparks()
    assert hand.session.probe("path_position") > at


def scene(hand, name):
    """Bring the machine into a state."""
    if name == "Idle":
        hand.rest()
        return
    hand.enter(DATA, "C100", "M03", "G01 X80 F60")
    hand.run(0.1)
    if name == "Hold:0":
        hand.press(0x21)
        while hand.report()["state"] != name:
            hand.run(0.005)
    if name == "Alarm":
        hand.session.set("force.estop", 1)
        hand.until("ALARM:")
        hand.session.set("force.estop", 0)
    if name == "retraction":
        hand.session.set("force.short", 1)
        hand.run(0.01)


SOME = pytest.param(7, id="some")
ALL = pytest.param(1, id="all", marks=pytest.mark.soak)


@pytest.mark.parametrize("step", [SOME, ALL])
@pytest.mark.parametrize("name", ["Idle", "Run", "Hold:0", "Alarm", "retraction"])
def test_every_byte_in_every_state(hand, name, step):
    """A row of bytes that are no orders: a motion goes on, and a machine at rest stays so."""
    inert = [byte for byte in range(0x80, 0x100) if byte not in ACTING][::step]
    scene(hand, name)
    discharging = hand.session.probe("power_control_machining")
    feed = 0
    for byte in inert:
        at = hand.session.probe("path_position")
        hand.press(byte)
        moved = hand.session.probe("path_position") - at
        if name in ("Idle", "Hold:0", "Alarm"):
            assert moved == 0, f"0x{byte:02X}"
        elif name == "Run":
            assert 0 <= moved <= 2.1 * 60 / 60 * MM * 0.006, f"0x{byte:02X}"
            feed += moved
        elif hand.session.probe("path_status_state") == 2:
            assert -300 / 60 * MM * 0.006 <= moved <= 0, f"0x{byte:02X}"
        assert hand.session.probe("power_control_machining") == discharging
        hand.press(0x90, 0x95)
    if name != "retraction":
        assert hand.report()["state"] == name
    assert feed > 0 or name != "Run"
