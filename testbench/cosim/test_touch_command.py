# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper touch`` on the simulated machine: its lock, its alarms, and an end by Ctrl-C."""

import _thread
import signal
import threading
import time

import pytest
from rich.console import Console

from host.errors import ALARM
from host.link.link import Link, RefusedError
from host.link.lock import LockedError
from host.link.port import Port
from host.machines import machine as machines
from host.run.controller import Controller
from host.touch.command import touch
from host.touch.cycles import Probe, edge
from host.touch.ending import AlarmError
from testbench.live import Client, switched_on

SINKER = machines.load("sinker")
BAUD = 1_000_000


class Screen(Console):
    """A terminal; ``seen`` is called with each line that is shown."""

    def __init__(self, seen=lambda text: None):
        super().__init__(record=True, width=300)
        self.seen = seen

    def print(self, *texts, **options):
        super().print(*texts, **options)
        self.seen(str(texts[0]))


def enter(url, *lines):
    """Enter lines by hand, and wait for rest; return the fields of a status report then."""
    port = Port(url, BAUD)
    try:
        controller = Controller(port, SINKER, clock_hz=SINKER.clock_hz, say=print)
        controller.identify(reset=False)
        link = Link(controller, print)
        link.await_greeting()
        for line in lines:
            link.command(line)
        while (told := link.status())["state"] == "Run":
            link.poll(0.05)
        return told
    finally:
        port.close()


def raw(url, line):
    """What is answered to a line without a number, as a terminal sends it."""
    client = Client(Port(url, BAUD))
    try:
        return client.ask(line)[-1]
    finally:
        client.port.close()


def touched(url, probe, *, unlock=False, screen=None, system=None):
    return touch(url, edge(probe, "Z", -1), probe, baud=BAUD, machine="sinker", known=None,
                 system=system, unlock=unlock, console=screen or Screen())


def test_a_locked_machine_is_neither_unlocked_nor_moved_unasked():
    with switched_on(SINKER) as (url, machine):
        before = machine.positions()
        with pytest.raises(LockedError, match=r"is locked.* Look at the machine .* with \$X"):
            touched(url, Probe())
        with pytest.raises(RefusedError, match="position") as refused:
            touched(url, Probe(), unlock=True)
        assert "locked" not in str(refused.value)
        assert raw(url, "$X") == "ok", "a terminal may send lines again"
        assert machine.positions() == before


@pytest.mark.parametrize(("start", "number", "said"), [
    ("G01 Z1 F600", 5, "without contact"), ("G38.2 Z-1 F60", 4, "touches the work before")])
def test_an_alarm_is_named_with_what_to_do(start, number, said):
    with switched_on(SINKER) as (url, _):
        enter(url, "$X", "$POSITION=HERE", f"G91 G94 {start}")
        with pytest.raises(AlarmError, match=f"^alarm {number}: .*{said}") as ended:
            touched(url, Probe(reach=0.5))
        assert ended.value.status == ALARM
        # The remedy of the alarms' table follows.
        assert ("Check clamping" if number == 5 else "move away from the work") in str(ended.value)
        with pytest.raises(LockedError):
            touched(url, Probe(reach=0.5))
        assert raw(url, "$X") == "ok"


def test_a_zero_is_set_and_stays():
    with switched_on(SINKER) as (url, _):
        enter(url, "$X", "$POSITION=HERE", "G92 Z7.5")
        screen = Screen()
        found = touched(url, Probe(), screen=screen, system=2)
        assert "zero of G55 set: G10 L20 P2 Z" in screen.export_text()
        assert raw(url, "G21") == "ok"
        zero = float(enter(url, "G55")["WCO"].split(",")[2])
        assert found.places["Z"] - zero == pytest.approx(0, abs=2.01e-4)


@pytest.fixture
def interrupts():
    """Ctrl-C is heard, also where a shell has started the tests in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interrupts")
def test_ctrl_c_in_a_touch_holds_the_machine():
    with switched_on(SINKER) as (url, machine):
        enter(url, "$X", "$POSITION=HERE", "G91 G94 G01 Z3 F600")
        before = machine.positions()["z"]

        def interrupt():
            while machine.positions()["z"] > before - 2_000:
                time.sleep(0.01)
            _thread.interrupt_main()

        def seen(text):
            if "G38.2" in text:
                threading.Thread(target=interrupt, daemon=True).start()

        screen = Screen(seen)
        with pytest.raises(KeyboardInterrupt):
            touched(url, Probe(reach=2.5), screen=screen)
        place = machine.positions()["z"]
        assert before - 25_000 < place < before, "it was to be in motion"
        assert "The machine is held and stands" in screen.export_text()
        end = machine.time_s() + 0.5
        while machine.time_s() < end:
            time.sleep(0.01)
        assert abs(machine.positions()["z"] - place) <= 2
        assert enter(url)["state"] == "Idle"    # the position is known still
