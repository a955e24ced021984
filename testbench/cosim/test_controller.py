# SPDX-License-Identifier: Apache-2.0
"""The native simulation's controller beside Verilator's of the same gateware, in every clock.

Every tape is in the soak. In every run ``test_session.py`` also compares every pin and probe of a
program with a short with the same under cocotb, all but two of them in every clock.
"""

import pytest

from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from testbench.native import build, compiling, controller
from testbench.native.emission import Emission
from testbench.native.pair import difference, pair_library
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

# On a machine: a tape, and seconds of it. The first is past the first jump. 23 million clocks.
SOME = (("sinker", "sink_jump", 1.5), ("sinker", "sink_shallow_deep", 8.0),
        ("wire", "wire_slot", 2.0))
EVERY = sorted(path.stem for path in TAPES.glob("*.nc"))


def run(kind, tape, until_s):
    """A simulation that has run a tape, with all its inputs kept."""
    machine = machines.load(kind)
    native = Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1, trace=False)
    native.keep_inputs()
    Run(machine, load(TAPES / f"{tape}.nc"), Piped(native), until_s=until_s).execute()
    return machine, native


def pair_of(machine):
    """Library of a machine's controller and of Verilator's of the same options."""
    return pair_library(machine.clock_hz, build.options(machine.tables))


@pytest.mark.parametrize(("kind", "tape", "until_s"), SOME)
def test_every_pin_and_probe_is_that_of_verilators_controller(kind, tape, until_s):
    machine, native = run(kind, tape, until_s)
    with native:
        assert native.cycle > until_s * machine.clock_hz
        assert native.discharges()["ok"] > 100
        assert difference(native, pair_of(machine)) is None


@pytest.mark.soak
@pytest.mark.parametrize("tape", EVERY)
def test_every_pin_and_probe_over_every_tape(tape):
    finish = tape.startswith("wire_finish")
    kind = "wall" if finish else "wire" if tape.startswith("wire") else "sinker"
    machine, native = run(kind, tape, None)
    with native:
        assert sum(native.discharges().values()) > 100
        assert difference(native, pair_of(machine)) is None


def test_a_run_without_kept_inputs_is_no_comparison():
    with Simulation(machine=machines.load("sinker").tables, clock_hz=2_000_000, seed=1,
                    trace=False) as native, pytest.raises(ValueError, match="kept no inputs"):
        difference(native, build.HERE / "no.so")


@pytest.mark.soak
def test_a_reader_that_is_not_told_of_a_change_is_noticed(monkeypatch, tmp_path):
    emission = controller.read(build.flat(2_000_000, lambda _: None))
    silent, = (node.index for node in emission.nodes
               if node.kind == "register" and node.name == "soc.uart.transmitter.timer")
    told = Emission.marks
    monkeypatch.setattr(Emission, "marks",
                        lambda self, index: "" if index == silent else told(self, index))
    files = controller.write(emission, tmp_path)
    compiling.objects(files, tmp_path, [*build.STANDARD, *build.INSIDE, "-O0"])
    with Simulation(machine=machines.load("sinker").tables, clock_hz=2_000_000, seed=1,
                    trace=False) as native:
        native.keep_inputs()
        native.run(600_000)
        assert b"help]" in native.received()
        clock, name = difference(native, pair_library(2_000_000, model=tmp_path))
        assert clock < native.cycle
        assert name == "tx"
