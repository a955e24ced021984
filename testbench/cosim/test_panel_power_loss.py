# SPDX-License-Identifier: Apache-2.0
"""A tape that lost the controller's power goes on from the panel, without its page."""

import time

import pytest

from host.link.link import LinkError
from host.machines.machine import Machine
from host.panel.job import Job
from host.panel.session import Session
from host.panel.wires import Bench
from host.tape.start import LAST
from softcore.tables.settings import assign
from testbench.cosim.power_loss import CAVITY, OFF_S, SWITCH_MM

DEADLINE_S = 120.0
TABLES = CAVITY.machine.tables
NEAR = Machine(CAVITY.machine.name, TABLES | {"side": TABLES["side"] | {
    "limit_low_mm": -SWITCH_MM, "limit_high_mm": SWITCH_MM, "limit_scatter_um": 0.0}})
HOMED = [assign("home_pull_off_um", 100), assign("home_slow_mm_min", 60), "$H"]


class Powered(Bench):
    """A machine whose controller can lose its power; the panel takes it for a real one."""

    simulated = False
    cut = False

    def read(self, timeout_s):
        if self.cut:
            self.cut = False
            self._machine._native.power_off_and_on(OFF_S)
            raise LinkError("the cable is dead.")
        return super().read(timeout_s)

    def write(self, data):
        if not self.cut:
            super().write(data)

    def close(self):
        """The machine stays where it is."""

    def electrode_mm(self):
        """Height of the electrode above the workpiece."""
        return self._machine.get("read.electrode_um") / 1000


@pytest.fixture
def bench():
    bench = Powered(NEAR, clock_hz=NEAR.clock_hz, seed=1, say=print)
    yield bench
    Bench.close(bench)


@pytest.mark.soak
def test_a_tape_goes_on_where_the_power_was_lost(bench, tmp_path):
    session = Session(NEAR, lambda say: bench)
    path = tmp_path / "cavity.nc"
    path.write_text(CAVITY.tape)

    def until(condition):
        end = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < end, list(session.notices)[-5:]
            session.seen("page")
            time.sleep(0.02)

    def entered(*lines):
        for line in lines:
            def taken(line=line):
                return sum(text == f"{line}: ok" for _, text in session.notices)
            before = taken()
            assert session.order("page", "line", line) == ""
            until(lambda taken=taken, before=before: taken() > before)

    def ready():
        until(lambda: session.link == "connected" and session.heard.state)
        session.take("page")
        entered(*HOMED)
        bench.arm()
        until(lambda: session.heard.state == "Idle" and "Armed" in session.heard.fields)

    session.start()
    try:
        ready()
        entered(f"G10 L20 P1 X0 Y0 Z{bench.electrode_mm():.4f}")
        time.sleep(1.0)     # the journal keeps it
        session.order("page", "choose", Job.of(path))
        assert session.order("page", "run") == ""
        until(lambda: session.heard.line >= CAVITY.blocks[7])
        bench.cut = True
        until(lambda: session.link == "lost")
        assert session.order("page", "connect") == ""
        until(lambda: session.link == "connected")
        told = [text for _, text in session.notices if "interrupted in block" in text]
        assert len(told) == 1, session.notices
        block = int(told[0].split("block ")[1].split(":")[0])
        assert CAVITY.blocks[0] < block <= CAVITY.blocks[7]
        ready()
        assert session.order("page", "run", LAST) == ""
        until(lambda: session.heard.state == "Hold:0")
        until(lambda: f"Block {block} begins at " in session.notice)
        assert session.order("page", "resume") == ""
        until(lambda: session.heard.ended)
        assert session.heard.ended == "end", session.notices
        depth = bench._machine.get("read.depth_um")
        print(f"interrupted in block {block}; {depth:.1f} um deep")
        assert 350 < depth < 380     # as in testbench.cosim.power_loss
    finally:
        session.close()
