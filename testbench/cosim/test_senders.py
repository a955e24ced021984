# SPDX-License-Identifier: Apache-2.0
"""Senders in the manner of four that we do not have, on the simulated machine as it lives."""

import math
import time
from contextlib import contextmanager

import pytest

from host.link.port import Port
from host.machines import machine as machines
from host.run import simulation
from softcore.tables.settings import SETTINGS
from testbench.live import serving
from testbench.senders import RESET, STYLES, Bcnc, Candle, Cncjs
from testbench.some import some

SINKER = machines.load("sinker")
NEAR_MM = 0.0005
CHORDS = 40
BOOTED_S = 0.3        # the greeting has been said, and nobody has heard it
RADIUS_MM = 0.5
LONG = "G01 X20 F300"       # of which a sender never sees the end
CANCEL = b"\x85"             # ends a jog


def start():
    return simulation.start(SINKER, clock_hz=SINKER.clock_hz, seed=1, waves=None, trace=False,
                            progress=print)


@contextmanager
def sending(style):
    """A sender of this style at a machine that lives as fast as it can be simulated."""
    machine = start()
    try:
        with serving(machine, arm=True, clock=machine.time_s) as (url, _):
            while machine.time_s() < BOOTED_S:
                time.sleep(0.01)
            port = Port(url)
            try:
                yield style(port, machine.time_s)
            finally:
                port.close()
    finally:
        machine.close()


def contour():
    """Half a circle in chords, in the manner of a post: it ends at 2 RADIUS_MM in X."""
    angles = [math.pi * number / CHORDS for number in range(1, CHORDS + 1)]
    return ["%", "(contour)", "G21 G90 G94", "G17 G40 G49 G54", "G01 F600",
            *(f"X{RADIUS_MM * (1 - math.cos(a)):.4f} Y{RADIUS_MM * math.sin(a):.4f}"
              for a in angles), "", "M05", "%"]


def prepare(sender):
    """Shake hands, and unlock: the only line that no sender has is that of the place."""
    sender.connect()
    assert sender.settings.items() >= {f"${one.number}": one.default for one in SETTINGS}.items()
    assert not sender.ask("G00 X1")
    assert sender.errors[0][1].endswith("error:9")
    assert sender.ask("$X")
    assert sender.ask("$POSITION=HERE")
    sender.rest()
    sender.errors.clear()


@pytest.mark.parametrize("style", some(STYLES, Candle))
def test_a_sender_connects_streams_stops_and_goes_on(style):
    with sending(style) as sender:
        prepare(sender)
        sender.stream(line for line in contour() if line or style is not Candle)
        sender.rest()
        assert not sender.errors
        assert sender.place == pytest.approx((2 * RADIUS_MM, 0, 0), abs=NEAR_MM)
        assert style is Cncjs or sender.ask("$G")     # which asks by itself
        sender.stream([LONG, *["X30", "X20"] * 20], lambda: sender.place[0] > 2)
        sender.stop()
        assert (sender.state, sender.alarms) == ("Idle", []), "a hold, and a reset at rest"
        place = sender.place
        assert 2 < place[0] < 20
        sender.errors.clear()
        assert sender.ask("G91 G00 X-1")
        sender.rest()
        assert sender.place == pytest.approx((place[0] - 1, *place[1:]), abs=NEAR_MM)


@pytest.mark.parametrize("style", some(STYLES, Cncjs))
def test_a_sender_jogs_there_and_ends_a_jog_on_the_way(style):
    with sending(style) as sender:
        prepare(sender)
        assert sender.ask("$J=G91 X1 F600")
        sender.rest()
        assert sender.place == pytest.approx((1, 0, 0), abs=NEAR_MM)
        assert sender.ask("$J=G91 X100 F600")
        sender.until(lambda: sender.place[0] > 2, "motion")
        assert sender.state == "Jog"
        sender.port.write(CANCEL)
        sender.rest()
        assert 2 < sender.place[0] < 20
        assert sender.alarms == []


@pytest.mark.parametrize("style", some(STYLES, Bcnc))
def test_a_sender_understands_a_refusal_and_an_alarm(style):
    with sending(style) as sender:
        prepare(sender)
        for line, number in (("$HX", 3), ("$J=G91 X1", 22), ("$C", 3), ("G41 D1", 20),
                             ("$130=1", 3), ("G38.1 Z-1 F5", 20), ("C900", 133)):
            assert not sender.ask(line)
            assert sender.errors[-1][1].endswith(f"error:{number}"), line
        sender.send(LONG)
        sender.until(lambda: sender.place[0] > 0.5, "motion")
        greetings = sender.greetings
        sender.port.write(RESET)
        sender.until(lambda: sender.greetings > greetings and sender.state == "Alarm", "Alarm")
        assert sender.alarms == ["3"]
        sender.until(lambda: sender.ask("$X"), "rest")
        sender.rest()
        assert sender.ask("G90 G00 X0")
        sender.rest()
        assert sender.place == pytest.approx((0, 0, 0), abs=NEAR_MM)
