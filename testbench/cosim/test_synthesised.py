# SPDX-License-Identifier: Apache-2.0
"""The controller after synthesis, of the device's cells, beside the Verilog before it."""

import pytest

from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from testbench.native import synthesised
from testbench.native.pair import difference, pair_library
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

MACHINE = machines.load("sinker")
UNTIL_S = 1.8   # 3.6 million clocks


PARTS = [
    pytest.param("controller.motion", {"LUT4": 4000, "TRELLIS_FF": 3000}, id="motion"),
    pytest.param("", {"LUT4": 12_000, "TRELLIS_FF": 9000, "DP16KD": 100, "MULT18X18D": 4},
                 id="whole", marks=pytest.mark.soak),
]


@pytest.mark.parametrize(("part", "least"), PARTS)
def test_the_cells_of_the_device_run_a_tape_like_the_verilog(part, least):
    """A jump, a short and its retraction, every pin in every clock."""
    made = synthesised.netlist(MACHINE.clock_hz, part)
    found = synthesised.cells(made)
    assert {kind for kind, count in least.items() if found[kind] < count} == set(), found
    library = pair_library(MACHINE.clock_hz, model=synthesised.model(made))
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as native:
        native.keep_inputs()
        seen = []

        def shorted(run):
            """After the first jump, a short until the electrode backs."""
            for event in run.events[len(seen):]:
                seen.append(event.get("cause", event["event"]))
                if seen[-1] in {"resume", "short"}:
                    native.set("force.short", int(seen[-1] == "resume" and "short" not in seen))

        Run(MACHINE, load(TAPES / "sink_jump.nc"), Piped(native), until_s=UNTIL_S,
            watch=shorted).execute()
        assert [cause for cause in seen if cause in {"jump", "short", "resume"}] == [
            "jump", "resume", "short", "resume"]
        assert difference(native, library) is None
