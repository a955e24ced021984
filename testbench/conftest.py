# SPDX-License-Identifier: Apache-2.0
"""Fixtures shared by every test: the seed, the simulator and where the waves go."""

import random
import re
from pathlib import Path

import pytest
from amaranth.hdl import Elaboratable
from amaranth.sim import Simulator

from host.run.simulation import Simulation
from testbench import seconds, tools
from testbench.quick import FOLDERS, is_quick

tools.use_packaged()

BUILD = Path(__file__).parents[1] / "build"
BEGAN = pytest.StashKey[float]()   # CPU seconds of the process when a test began


def pytest_addoption(parser):
    group = parser.getgroup("edm")
    group.addoption("--seed", type=int, default=1, help="seed of every random stimulus")
    group.addoption("--waves", action="store_true", help="write waves under build/tests/<test>/")


def pytest_collection_modifyitems(config, items):
    """Mark each test by its folder: quick, cosim, formal."""
    for item in items:
        place = item.path.relative_to(config.rootpath)
        if is_quick(place.as_posix()) and item.get_closest_marker("soak") is None:
            item.add_marker("quick")
        if marker := FOLDERS.get(place.parts[1]):
            item.add_marker(marker)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Note the CPU seconds of the process before a test's first fixture."""
    item.stash[BEGAN] = seconds.cpu_s()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Measure a test: its last report takes its CPU seconds to the process that prints them."""
    report = yield
    if report.when == "teardown":
        report.cpu_s = seconds.cpu_s() - item.stash[BEGAN]
    return report


def pytest_terminal_summary(terminalreporter):
    """Print the CPU seconds of every part, when there was more than one."""
    measured = [seconds.Measured(report.nodeid, report.cpu_s)
                for reports in terminalreporter.stats.values() for report in reports
                if hasattr(report, "cpu_s")]
    if len({seconds.part_of(one.test) for one in measured}) > 1:
        terminalreporter.section("CPU seconds")
        for line in seconds.table(measured):
            terminalreporter.write_line(line)


def pytest_report_header(config):
    return f"seed: {config.getoption('seed')}"


@pytest.fixture
def rng(request) -> random.Random:
    """Random source of one test. It depends on the seed and on the test's own name only."""
    return random.Random(f"{request.config.getoption('seed')}/{request.node.nodeid}")


@pytest.fixture
def workdir(request) -> Path:
    """A directory of this test's own under ``build/``; its name is the test's."""
    path = BUILD / "tests" / re.sub(r"[^\w.-]+", "_", request.node.nodeid)
    path.mkdir(parents=True, exist_ok=True)
    return path


@pytest.fixture
def waves(request, workdir) -> Path | None:
    """Folder for the waveforms of a whole controller, or None without ``--waves``."""
    return workdir if request.config.getoption("waves") else None


@pytest.fixture
def idle_simulation() -> Simulation:
    """A stand-in for a simulation that can only be closed, for tests with invented runs."""
    class Idle(Simulation):
        def __init__(self):
            pass

        def close(self):
            pass

    return Idle()


@pytest.fixture
def simulate(request, workdir):
    """Run testbenches against a design: ``simulate(dut, bench, ...)``.

    Clocks are given in hertz by domain. The run ends when every testbench has returned; one that
    still waits after ``deadline`` seconds of simulated time fails the test instead of hanging it.
    """

    def run(dut: Elaboratable, *benches, clocks=None, deadline=1e-3):
        async def watchdog(ctx):
            await ctx.delay(deadline)
            raise TimeoutError(f"testbench still waiting after {deadline} s")

        sim = Simulator(dut)
        for domain, frequency in (clocks or {"sync": 100e6}).items():
            sim.add_clock(1 / frequency, domain=domain)
        for bench in benches:
            sim.add_testbench(bench)
        sim.add_testbench(watchdog, background=True)
        if request.config.getoption("waves"):
            with sim.write_vcd(str(workdir / "waves.vcd")):
                sim.run()
        else:
            sim.run()

    return run
