# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper tune`` on the simulated machine: drives whose true constants are known."""

import re
import time

import pytest
from rich.console import Console

from host.link.link import Link
from host.link.port import Port
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run import simulation
from host.run.controller import Controller
from host.tune.command import tune
from softcore.tables.settings import named
from testbench.live import serving

SINKER = machines.load("sinker")
BOOTED_S = 0.3
GAIN = named("loop_gain").default


def axis(gain):
    """The axes of the sinker, their drives with another gain than the setting says."""
    usual = SINKER.tables["axis"]
    return usual | {"full_speed_mm_s": gain * usual["full_speed_mm_s"]}


def ready(url):
    """The operator has unlocked the machine, and accepts the counted position."""
    port = Port(url, 1_000_000)
    try:
        Controller(port, SINKER, clock_hz=SINKER.clock_hz, say=print).identify(reset=False)
        link = Link(port, print)
        link.await_greeting()
        for line in ("$X", "$POSITION=HERE"):
            link.command(line)
    finally:
        port.close()


def tuned(ways, workdir, gain, travel=2.0):
    """Proposal, and what was told, for a machine whose drives have a gain."""
    machine = simulation.start(Machine(SINKER.name, SINKER.tables | {"axis": axis(gain)}),
                               clock_hz=SINKER.clock_hz, seed=1, waves=None, trace=False,
                               progress=print)
    picture = workdir / "tune.svg"
    try:
        console = Console(record=True, width=200)
        with serving(machine, arm=True, clock=machine.time_s) as (url, _):
            while machine.time_s() < BOOTED_S:
                time.sleep(0.01)
            ready(url)
            wanted = tune(url, ways, travel_mm=travel, baud=1_000_000, machine="sinker",
                          picture=picture, console=console)
            return wanted, console.export_text(), picture.read_text(encoding="utf-8")
    finally:
        machine.close()


@pytest.mark.soak
@pytest.mark.parametrize("gain", [0.7, 1.0, 1.3])
def test_the_drives_of_the_simulated_machine_are_found(gain, tmp_path):
    wanted, told, picture = tuned("Z+", tmp_path, gain)
    assert wanted.values["loop_gain"] == pytest.approx(gain * GAIN, abs=0.6)
    assert wanted.values["feed_forward"] == 100
    # The drive can do 5000 mm/s2. A turn from 10 to -10 mm/s may show less, but no more.
    least = re.search(r"acceleration (?:at least )?(\d+)", told)
    print(told)
    assert 0.5 * min(1, gain) * 5000 <= int(least[1]) <= 5000
    assert "it is for all axes, so measure X, Y, too" in told
    assert "nothing has been changed" in told
    assert f"${named('loop_gain').number}={wanted.values['loop_gain']}" in told
    assert "Z: following error" in picture
