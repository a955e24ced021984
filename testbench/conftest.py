# SPDX-License-Identifier: Apache-2.0
"""Fixtures shared by every test: the seed, the simulator and where the waves go."""

import gc
import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from amaranth.hdl import Elaboratable

from host.run.simulation import Simulation
from testbench import seconds, tools
from testbench.quick import FOLDERS, is_quick
from testbench.simulators import blocks
from testbench.simulators import choice as simulators
from testbench.simulators.isolated import Simulator

tools.use_packaged()

BUILD = Path(__file__).parents[1] / "build"
BEGAN = pytest.StashKey[float]()   # CPU seconds of the process when a test began
SIM = pytest.StashKey[str]()       # simulator of a test
SHARE = 5   # one in so many random cases is taken without --all-cases

# Objects made between two searches for garbage, and searches of a younger generation before one of
# an older. A design has hundreds of thousands of objects that live as long as it does: with
# Python's own thresholds, to look for garbage takes half of its elaboration.
gc.set_threshold(50_000, 10, 5)


def pytest_addoption(parser):
    group = parser.getgroup("edm")
    group.addoption("--seed", type=int, default=1, help="seed of every random stimulus")
    group.addoption("--sim", choices=["both", "cocotb", "amaranth"], default="both",
                    help="simulator of a block: cocotb on its Verilog, or Amaranth's own; both: "
                         "cocotb for the first parameters of each test, Amaranth's for the others")
    group.addoption("--all-cases", action="store_true",
                    help="random tests take all their cases, not a share of them")
    group.addoption("--waves", action="store_true", help="write waves under build/tests/<test>/")


def pytest_collection_modifyitems(config, items):
    """Mark each test by its folder, and those that count random cases. Choose its simulator."""
    met = set()
    for item in items:
        test = item.path, getattr(item, "originalname", item.name)
        first = "cocotb" if test not in met else "amaranth"
        met.add(test)
        sim = config.getoption("sim")
        item.stash[SIM] = first if sim == "both" else sim
        place = item.path.relative_to(config.rootpath)
        if is_quick(place.as_posix()) and item.get_closest_marker("soak") is None:
            item.add_marker("quick")
        if marker := FOLDERS.get(place.parts[1]):
            item.add_marker(marker)
        if item.stash[SIM] == "cocotb" and "simulate" in item.fixturenames:
            item.add_marker("cocotb")
        if "cases" in item.fixturenames:
            item.add_marker("counted")


def pytest_collection_finish():
    """Keep what lives as long as the run out of every search for garbage.

    The tests alone are a quarter of a million objects. Tests under cocotb look for garbage twice,
    each in a fork of its own, which would copy them, too.
    """
    gc.collect()
    gc.freeze()


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
        report.blocks = blocks.taken()
    return report


def pytest_terminal_summary(terminalreporter):
    """Print the CPU seconds of every part, when there was more than one, and the blocks."""
    measured = [seconds.Measured(report.nodeid, report.cpu_s)
                for reports in terminalreporter.stats.values() for report in reports
                if hasattr(report, "cpu_s")]
    if len({seconds.part_of(one.test) for one in measured}) > 1:
        terminalreporter.section("CPU seconds")
        for line in seconds.table(measured):
            terminalreporter.write_line(line)
    if _whole(terminalreporter.config):
        ran = _reached(terminalreporter)
        terminalreporter.section("blocks")
        for line in blocks.table(ran):
            terminalreporter.write_line(line)
        for name in blocks.gaps(ran):
            terminalreporter.write_line(f"no test has run {name} under cocotb", red=True)


def pytest_sessionfinish(session):
    """A block that no test has run under cocotb fails the whole run."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if _whole(session.config) and blocks.gaps(_reached(reporter)) and session.exitstatus == 0:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _whole(config):
    """Whether this is the process that reports, and every block was to run under cocotb."""
    return (not hasattr(config, "workerinput") and config.getoption("sim") != "amaranth"
            and config.args_source is pytest.Config.ArgsSource.TESTPATHS
            and not config.option.keyword and config.option.markexpr == "not soak"
            and not config.option.collectonly
            and not (config.option.lf or config.option.deselect or config.option.ignore))


def _reached(reporter):
    """Blocks that each passed test has reached."""
    passed = {report.nodeid for report in reporter.stats.get("passed", ())}
    return [report.blocks for reports in reporter.stats.values() for report in reports
            if hasattr(report, "blocks") and report.nodeid in passed]


def pytest_report_header(config):
    return f"seed: {config.getoption('seed')}"


@pytest.fixture
def rng(request) -> random.Random:
    """Random source of one test. It depends on the seed and on the test's own name only."""
    return random.Random(f"{request.config.getoption('seed')}/{request.node.nodeid}")


@pytest.fixture
def cases(request) -> Callable[[int], int]:
    """Number of random cases to take of so many: a fifth of them; all in the soak."""
    if request.config.getoption("all_cases"):
        return lambda count: count
    return lambda count: -(-count // SHARE)


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
def simulator(request, workdir):
    """Simulator of this test under cocotb; None if the test runs in Amaranth's."""
    if request.node.stash[SIM] == "amaranth":
        return None
    return Simulator(workdir, seed=request.config.getoption("seed"),
                     waves=request.config.getoption("waves"))


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    """Run a test that simulates a block under cocotb in a process of its own."""
    simulator = pyfuncitem.funcargs.get("simulator")
    if simulator is None:
        return None
    simulators.run_isolated(pyfuncitem, simulator)
    return True


@pytest.fixture
def simulate(request, workdir, simulator):
    """Run testbenches against a design: ``simulate(dut, bench, ...)``; returns what they return.

    The run ends when every testbench has returned; one that still waits after ``deadline`` seconds
    of simulated time, at 100 MHz, fails the test instead of hanging it. A test that simulates more
    than once says ``apart=True`` each time; then nothing but what the benches return comes back.
    """

    def run(dut: Elaboratable, *benches, deadline=1e-3, apart=False):
        if simulator is None:
            waves = workdir / "waves.vcd" if request.config.getoption("waves") else None
            return simulators.in_amaranth(dut, benches, deadline=deadline, waves=waves)
        return simulators.under_cocotb(dut, benches, simulator, deadline=deadline, apart=apart)

    return run
