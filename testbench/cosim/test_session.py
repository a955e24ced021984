# SPDX-License-Identifier: Apache-2.0
"""The two simulations agree: one netlist, one plant, one firmware, two ways to run them."""


import pytest

from host.machines.machine import load
from rtl.states import State
from softcore.image import target_image
from testbench.cosim.runner import cosimulate
from testbench.native.probes import PROBES
from testbench.native.simulation import Simulation

MACHINE = load("sinker").tables
# Every pin and probe of the controller, and those but two that change in nearly every clock.
ALL = [probe.name for probe in PROBES if probe.scope]
SLOWER = [name for name in ALL if name not in ("gap_reference", "sleep_left")]
READY = ["$X", "$POSITION=HERE"]
LINES = ["G92 X0 Y0 Z0.1", "G36 R300 L1 H600 E60 Q0.05", "C130", "M08", "M03", "G95 P1 F30",
         "G01 X0.02 Y0.01 Z-0.2"]


def command(session, line):
    """Send a line; return what came up to its answer."""
    session.send(line.encode() + b"\n")
    said = b""
    while not said.endswith(b"ok\r\n") and b"error:" not in said:
        more = session.receive(session.clock_hz // 2)
        assert more, f"no answer to {line!r}: {said!r}"
        said += more
    return said.decode()


def greeting(session):
    """Wait for the greeting; bytes sent before it would be lost."""
    said = b""
    while not said.endswith(b"help]\r\n"):
        more = session.receive(session.clock_hz // 2)
        assert more, said
        said += more
    return said.decode()


def machining(session, clocks=600_000):
    """Start machining, force a short and clear it; return everything visible."""
    session.watch(SLOWER)
    said = [greeting(session)]
    said += [command(session, line) for line in READY]
    session.press_arm()
    said += [command(session, line) for line in LINES]
    session.run(clocks // 4)
    session.set("force.short", 1)
    session.watch(ALL)
    session.run(20_000)
    session.watch(SLOWER)
    session.set("force.short", -1)
    session.poke("sleep_left", 700)  # the processor stands still for so long
    end = session.cycle + clocks
    while session.cycle < end:
        said.append(session.receive(end - session.cycle).decode())
    session.set("force.estop", 1)
    session.run(20_000)
    return {"said": said, "cycle": session.cycle, "positions": session.positions(),
            "errors": session.errors(), "discharges": session.discharges(),
            "gap": [session.get(f"read.{name}") for name in ("gap_um", "depth_um", "debris")],
            "changes": [list(change) for change in session.changes()],
            "auxiliaries": [list(row) for row in session.auxiliaries()],
            "framing": session.framing_errors()}


def broken(session):
    """Fail, as a scenario that finds a fault."""
    session.run(1000)
    assert session.cycle == 1001, "a planted fault"


@pytest.mark.cocotb
def test_native_and_cocotb_agree_to_the_clock(workdir, rng):
    seed = rng.getrandbits(32)
    image = target_image()
    with Simulation(machine=MACHINE, clock_hz=int(MACHINE["clock_hz"]), seed=seed,
                    image=image) as simulation:
        native = machining(simulation)
    assert native["discharges"]["ok"] > 50
    assert any("retract" in text for text in native["said"])
    assert native["framing"] == 0
    seen = {name for _, name, _ in native["changes"]}
    assert seen == set(ALL)
    moved = {name for name in seen
             if len({value for _, one, value in native["changes"] if one == name}) > 1}
    assert len(moved) > 80, f"the others stand still: {sorted(seen - moved)}"
    assert cosimulate(machining, workdir, machine=MACHINE, seed=seed, image=image) == native


def test_the_netlist_alone_does_the_same_on_the_same_inputs(rng):
    def simulation():
        return Simulation(machine=MACHINE, clock_hz=int(MACHINE["clock_hz"]),
                          seed=rng.getrandbits(32))

    with simulation() as kept, simulation() as alone:
        kept.keep_inputs()
        greeting(kept)
        for line in READY:
            command(kept, line)
        kept.press_arm()
        for line in LINES:
            command(kept, line)
        kept.run(200_000)
        kept.set("force.short", 1)
        kept.run(20_000)
        assert kept.discharges()["ok"] > 5
        assert State(kept.probe("path_status_state")) is State.RETRACTING
        alone.replay(kept)
        for probe in PROBES:
            if probe.scope:
                assert alone.probe(probe.name) == kept.probe(probe.name), probe.name


def test_a_failed_scenario_fails(workdir):
    with pytest.raises(AssertionError, match="a planted fault"):
        cosimulate(broken, workdir, machine=MACHINE, seed=1)
