# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper tune`` on the simulated machine: drives whose true constants are known."""

import re

import pytest
from rich.console import Console

from host.link.link import Link
from host.link.lock import LockedError
from host.link.port import Port
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run.controller import Controller
from host.tune.command import tune
from softcore.tables.settings import NO_OFFSET, PULSES_PER_MM, assign, named
from testbench.live import switched_on

SINKER = machines.load("sinker")
AXIS = SINKER.tables["axis"]
GAIN = named("loop_gain").default


def axis(gain, **more):
    """The axes of the sinker, their drives with another gain than the setting says."""
    usual = SINKER.tables["axis"]
    return usual | {"full_speed_mm_s": gain * usual["full_speed_mm_s"]} | more


def ready(url):
    """The operator has unlocked the machine, and accepts the counted position.

    A drive with friction may stand beside its place.
    """
    port = Port(url, 1_000_000)
    try:
        Controller(port, SINKER, clock_hz=SINKER.clock_hz, say=print).identify(reset=False)
        link = Link(port, print)
        link.await_greeting()
        for line in (assign("window", 63), "$X", "$POSITION=HERE"):
            link.command(line)
    finally:
        port.close()


def tuned(ways, workdir, gain, travel=2.0, **more):
    """Proposal, and what was told, for a machine whose drives have a gain."""
    machine = Machine(SINKER.name, SINKER.tables | {"axis": axis(gain, **more)})
    picture, console = workdir / "tune.svg", Console(record=True, width=200)
    with switched_on(machine) as (url, _):
        ready(url)
        wanted = tune(url, ways, travel_mm=travel, baud=1_000_000, machine="sinker",
                      picture=picture, unlock=False, console=console)
        return wanted, console.export_text(), picture.read_text(encoding="utf-8")


def test_a_locked_machine_is_neither_unlocked_nor_moved(tmp_path):
    with switched_on(SINKER) as (url, machine):
        before = machine.positions()
        with pytest.raises(LockedError, match=r"Look at the machine .* with \$X"):
            tune(url, "Z+", travel_mm=2.0, baud=1_000_000, machine="sinker",
                 picture=tmp_path / "tune.svg", unlock=False, console=Console())
        assert machine.positions() == before


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


@pytest.mark.soak
@pytest.mark.parametrize(("gain", "offset"), [(0.7, 0.05), (1.3, -0.05)])
def test_a_drive_with_offset_friction_and_dead_time_is_found(gain, offset, tmp_path):
    wanted, told, _ = tuned("Z+", tmp_path, gain, 3.0, offset_mm_s=offset, friction_mm_s=0.1,
                            dead_time_ms=2.0)
    print(told)
    step = gain * GAIN / PULSES_PER_MM      # mm/s
    values = wanted.values
    assert values["loop_gain"] == pytest.approx(gain * GAIN, abs=0.6)
    assert values["drive_offset_z"] == pytest.approx(NO_OFFSET - offset / step, abs=1)
    assert values["drive_friction_z"] == pytest.approx(0.1 / step, abs=2)
    lag_us = 1e6 * sum(AXIS[name] for name in ("speed_loop_ms", "filter_ms")) / 1000 + 2000
    assert values["drive_lag_us"] == pytest.approx(lag_us, rel=0.06)
    assert 0.85 * lag_us < values["model_lag_z_us"] < lag_us
