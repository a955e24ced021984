# SPDX-License-Identifier: Apache-2.0
"""The whole controller under G95 P2 to P4, with gaps of forced width."""

from statistics import mean

import pytest

from host.machines import machine as machines
from softcore.tables.settings import assign
from testbench.cosim.job import MM, Data, Job, program
from testbench.models import removal
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
CLOCK_HZ = MACHINE.clock_hz
FEED = 5                                # mm/min
VOLTAGE, DROP = 25, 5                   # Vs and Es, V; no load is 30 V
ROW = f"G10 C900 I1 P15 Q25 E80 V{VOLTAGE} U{DROP}"
FULL_V = 100                            # of the converter
WIDE_UM, USUAL_UM, NARROW_UM = 40, 30, 22
PROBES = ("no_load", "voltage_mean", "voltage_drop", "status_ratio", "in_force")


@pytest.fixture
def begin():
    """Begin a cut in a feed mode, with settings; return the job. All are closed at the end."""
    open_sessions = []

    def under(mode, *settings):
        session = Simulation(machine=MACHINE.tables, clock_hz=CLOCK_HZ, seed=1, trace=False)
        open_sessions.append(session.__enter__())
        job = Job(session, *settings, watched=("path_command",))
        session.set("force.gap_um", USUAL_UM)
        job.start(program(ROW, "C900", Data(), f"G95 P{mode}", f"G01 Z-0.9 F{FEED}"))
        job.until(lambda: job.probe("feed_status_windows") >= 2, "two means", step=2000)
        return job

    yield under
    for session in open_sessions:
        session.__exit__(None, None, None)


def look(job):
    """Values used by the feed mode, right after a mean."""
    windows = job.probe("feed_status_windows")
    job.until(lambda: job.probe("feed_status_windows") != windows, "a mean")
    job.run(200)
    return {name: job.probe(f"feed_{name}") for name in PROBES}


def over(job, width_um, means):
    """Values at the next means over a gap (the first two do not count), and the feed, mm/min."""
    job.session.set("force.gap_um", width_um)
    look(job)
    look(job)
    start, cycle = job.probe("path_command"), job.session.cycle
    found = [look(job) for _ in range(means)]
    minutes = (job.session.cycle - cycle) / CLOCK_HZ / 60
    return found, (job.probe("path_command") - start) / MM / minutes


def volts(found, name):
    return mean(one[name] for one in found) * FULL_V / 65536


def speed(rate):
    """mm/min of a rate."""
    return rate / 2**32 * CLOCK_HZ * 60 / MM


def test_constant_removal(begin):
    job = begin(4)
    for width in (USUAL_UM, NARROW_UM, WIDE_UM):
        found, feed = over(job, width, 4 if width == NARROW_UM else 8)
        for one in found:
            assert one["no_load"] == 30 * 65536 // FULL_V
            assert one["voltage_drop"] == one["no_load"] - one["voltage_mean"]
            assert one["status_ratio"] == removal.ratio_of(
                one["voltage_drop"], DROP * 65536 // FULL_V, 1024, 16384)
            assert speed(one["in_force"]) == pytest.approx(
                FEED * one["status_ratio"] / 4096, rel=1e-3)
        feeds = [speed(one["in_force"]) for one in found]
        assert 0.9 * min(feeds) < feed < 1.1 * max(feeds)
        # The removal rate by the mode's own measure: feed times Ex.
        assert feed * volts(found, "voltage_drop") == pytest.approx(FEED * DROP, rel=0.25)


def test_a_short_is_left_along_the_path_and_the_ratio_stays(begin):
    job = begin(4)
    ratio = over(job, NARROW_UM, 2)[0][-1]["status_ratio"]
    assert ratio < 4096
    windows, front = job.probe("feed_status_windows"), job.probe("path_front")
    job.short(True)
    job.until(lambda: job.probe("path_command") < front - 1000, "the way back")
    job.short(False)
    job.wait("resume")
    assert job.probe("path_command") >= front
    assert job.probe("feed_status_ratio") == ratio
    assert job.probe("feed_status_windows") == windows
    assert speed(job.probe("feed_in_force")) == pytest.approx(FEED * ratio / 4096, rel=1e-3)


def test_zero_feed_at_the_reference_goes_both_ways(begin):
    job = begin(2, assign("feed_mode_gain_zero", 1000))
    for width, sign in ((WIDE_UM, 1), (NARROW_UM, -1), (WIDE_UM, 1)):
        found, feed = over(job, width, 20)
        wanted = volts(found, "voltage_mean") - VOLTAGE     # at 1 mm/min for a volt
        assert sign * wanted > 1
        assert feed == pytest.approx(wanted, rel=0.1)
    assert not job.told("alarm")


def test_feed_at_the_reference(begin):
    job = begin(3, assign("feed_mode_gain_feed", 500))
    for width, sign in ((WIDE_UM, 1), (NARROW_UM, -1)):
        found, feed = over(job, width, 20)
        wanted = FEED + 0.5 * (volts(found, "voltage_mean") - VOLTAGE)
        assert sign * (wanted - FEED) > 0.5
        assert feed == pytest.approx(wanted, rel=0.05)
        for one in found:
            volt = one["voltage_mean"] * FULL_V / 65536
            assert speed(one["in_force"]) == pytest.approx(FEED + 0.5 * (volt - VOLTAGE), abs=0.005)
