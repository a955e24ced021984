# SPDX-License-Identifier: Apache-2.0
"""grbl-streamer, an unmodified third-party sender for grbl, drives the simulated machine."""

import math
import os
import time
from collections import Counter
from contextlib import contextmanager

import grbl_streamer
import numpy as np
import pytest

from host.link.serve import Pty
from host.machines import machine as machines
from host.run import simulation
from softcore.tables.grbl import GRBL_SETTINGS
from softcore.tables.settings import FIRST, SETTINGS
from testbench.live import serving
from testbench.punch import TAPES

SINKER = machines.load("sinker")
PULSES_PER_MM = 10_000
RADIUS_MM = 4.0
COURSE_MM = 0.0015      # from the commanded course and from the end
HELD_S = 0.2            # of the machine's time that the feed is held
SETTLED_S = 0.05        # from the state Hold to rest
TRACE_S = 1e-3
PATIENCE_S = 600        # of a computer that is busy; 45 s of one that is idle
FEED_DOWN = 0x92        # "feed -10 %" of grbl
# Codes of this control that grbl does not have; the sender turns unknown codes into comments.
OURS = (36, 39, 41, 42, 95)


class Sender:
    """The sender at a terminal, and the messages that it has got so far."""

    def __init__(self, url):
        self.url, self.lines, self.counts, self.states = url, [], Counter(), []
        self.streamer = grbl_streamer.GrblStreamer(self._told)
        self.counts.clear()

    def _told(self, event, *data):
        self.counts[event] += 1
        if event == "on_read":
            self.lines.append(data[0])
        elif event == "on_stateupdate":
            self.states.append(data[0])
        elif event == "on_error":
            self.lines.append(f"{data[0]} to {data[1]}")

    def until(self, holds):
        """Wait until ``holds()``; an error or an alarm is a failure."""
        end = time.monotonic() + PATIENCE_S
        while not holds():
            assert not self.counts["on_error"], self.lines[-5:]
            assert not self.counts["on_alarm"], self.lines[-5:]
            assert time.monotonic() < end, (self.lines[-5:], self.states[-5:], self.counts)
            time.sleep(0.01)

    def told(self, text):
        """Lines that begin with ``text``."""
        return [line for line in self.lines if line.startswith(text)]

    def connect(self):
        """Connect, and wait for the downloads that the sender starts by itself."""
        self.streamer.cnect(self.url, 250_000)
        self.until(self.streamer.is_connected)
        self.streamer.poll_start()
        self.until(lambda: self.told("[GC:") and self.told("[PRB:"))

    def beside(self, data):
        """Write bytes to the terminal, as a second program, that the sender cannot write."""
        terminal = os.open(self.url, os.O_WRONLY | os.O_NOCTTY)
        os.write(terminal, data)
        os.close(terminal)

    def prepare(self):
        """Unlock the controller and declare its place.

        At the first report of Idle the sender asks for the parser's state. That answer must be
        there before a program begins: the sender takes any ``ok`` for one of the program's.
        """
        self.streamer.killalarm()
        asked = len(self.told("[GC:"))
        # The sender would break this line at its T.
        self.beside(b"$POSITION=HERE\n")
        self.until(lambda: len(self.told("[GC:")) > asked)
        self.rest()

    def begin(self, text):
        """Begin to stream a program."""
        self.streamer.job_new()
        self.streamer.write(text)
        self.counts["on_processed_command"] = 0
        self.streamer.job_run()

    def rest(self):
        """Wait for two reports of Idle: the sender notes the state of one before its place."""
        for _ in range(2):
            self.streamer.cmode = "not known"
            self.until(lambda: self.streamer.cmode == "Idle")


@contextmanager
def sending(machine):
    """A sender, connected to a machine that lives as fast as this computer can simulate it."""
    line = Pty(lambda text: None)
    with serving(machine, line, arm=True, clock=machine.time_s):
        sender = Sender(line.url)
        try:
            sender.connect()
            yield sender
        finally:
            sender.streamer.connected = True    # or it would leave its threads behind
            sender.streamer.disconnect()


def start(trace):
    return simulation.start(SINKER, clock_hz=SINKER.clock_hz, seed=1, waves=None, trace=trace,
                            progress=print)


def contour(blocks):
    """Three quarters of a circle in so many chords, as a CAM post writes them."""
    places = [(RADIUS_MM * (1 - math.cos(angle)), RADIUS_MM * math.sin(angle))
              for angle in (1.5 * math.pi * number / blocks for number in range(1, blocks + 1))]
    return "\n".join(["%", "(contour)", "G21 G90 G94", "", "G17 G40 G49 G54", "G00 Z1.", "G01 F300",
                      *(f"X{x:.4f} Y{y:.4f}" for x, y in places), "", "%", ""])


def assert_downloaded(sender):
    """Settings, stored places and the parser's state are what the controller has at power-on."""
    # Like the parser's state: it takes them apart in the form of grbl 0.9 alone.
    read = dict(line[1:].split("=") for line in sender.told("$"))
    assert read.items() >= {str(one.number): str(one.default) for one in SETTINGS}.items()
    assert {str(one.number) for one in GRBL_SETTINGS} == {
        number for number in read if int(number) < FIRST}
    places = sender.streamer.settings_hash
    assert set(places) == {*(f"G{number}" for number in (*range(54, 60), 28, 30, 92)),
                           "TLO", "PRB"}
    assert all(set(place) == {0.0} for place in places.values())
    assert sender.told("[GC:") == ["[GC:G80 G54 G17 G21 G90 G94 M5 M9 T0 F0.000 S0]"]


def held(sender, machine):
    """Hold the feed for ``HELD_S`` and resume it; machine's times between which it is at rest."""
    sender.streamer.hold()
    sender.until(lambda: sender.streamer.cmode.startswith("Hold"))
    since = machine.time_s()
    sender.until(lambda: machine.time_s() > since + SETTLED_S + HELD_S)
    until = machine.time_s()
    sender.streamer.resume()
    sender.until(lambda: sender.streamer.cmode == "Run")
    return since + SETTLED_S, until


@pytest.mark.parametrize("blocks", [250, pytest.param(1000, marks=pytest.mark.soak)])
def test_a_contour_of_short_blocks_with_a_hold_and_an_override_byte(blocks):
    machine = start(trace=True)
    with sending(machine) as sender:
        assert_downloaded(sender)
        sender.prepare()
        sender.begin(contour(blocks))
        sender.until(lambda: sender.counts["on_processed_command"] > blocks // 4)
        sender.beside(bytes([FEED_DOWN]))
        sender.until(lambda: sender.counts["on_processed_command"] > blocks // 2)
        since, until = held(sender, machine)
        sender.until(lambda: sender.streamer.job_finished)
        sender.rest()
        assert sender.counts["on_processed_command"] == sender.streamer.buffer_size > blocks
        assert sender.streamer.cmpos == pytest.approx((RADIUS_MM, -RADIUS_MM, 1), abs=COURSE_MM)
    trace = machine.trace()
    machine.close()
    assert machine.positions() == {
        name: pytest.approx(place * PULSES_PER_MM, abs=COURSE_MM * PULSES_PER_MM)
        for name, place in {"x": RADIUS_MM, "y": -RADIUS_MM, "z": 1}.items()}
    assert not any(machine.discharges().values())
    path = trace["path"]
    assert (np.diff(path) >= 0).all(), "it was drawn back"
    radius = np.hypot(trace["x"] / PULSES_PER_MM - RADIUS_MM, trace["y"] / PULSES_PER_MM)
    assert radius == pytest.approx(RADIUS_MM, abs=COURSE_MM)
    rest = path[(trace["t"] >= since) & (trace["t"] <= until)]
    assert len(rest) > 0.9 * HELD_S / TRACE_S
    assert rest[0] == rest[-1]
    assert 0.4 * path[-1] < rest[0] < 0.7 * path[-1]


@pytest.mark.soak
def test_a_tape_that_machines():
    """Retraction data, a condition, jumps: the sender knows none of these codes by itself."""
    machine = start(trace=True)
    with sending(machine) as sender:
        sender.streamer.preprocessor.whitelist_commands["G"].extend(OURS)
        sender.prepare()
        sender.begin((TAPES / "sink_jump.nc").read_text(encoding="ascii"))
        sender.until(lambda: sender.streamer.job_finished)
        sender.rest()
    trace = machine.trace()
    machine.close()
    assert machine.positions() == {
        name: pytest.approx(place * PULSES_PER_MM, abs=COURSE_MM * PULSES_PER_MM)
        for name, place in {"x": 0, "y": 0, "z": 2}.items()}
    assert trace["z"].min() == pytest.approx(-2 * PULSES_PER_MM, abs=COURSE_MM * PULSES_PER_MM)
    assert (np.diff(trace["path"]) < 0).any(), "no jump"
    assert machine.discharges()["ok"] > 1000
