# SPDX-License-Identifier: Apache-2.0
"""A bit in a guarded register inverts in the middle of a cut.

The unit tests of the blocks show that every such bit is detected; these tests show the effect.
Verilator allows a change only in registers that lead to no port: they stand for all others of their
guard.
"""

import pytest

from host.machines import machine as machines
from softcore.tables.faults import alarm_number
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import pace
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
CLOCKS = 6          # from the change to safe outputs
AWAY_UM = 110       # at 300 mm/min: the lag, and the distance that the axis coasts


@pytest.mark.parametrize(("register", "bit", "said"), [
    ("guard_command", 5, "axis Z"), ("window_offset", 29, "the place on the path"),
    ("window_parity", 0, "the segment at work"), ("guard_apart", 0, "path pulses on their way"),
    ("axis_y_low", 20, "a setting of axis Y"),
    ("fluid_parity", 0, "whether low fluid trips"),
    ("axis_x_mode_step_parity", 0, "a setting of axis X"),
    ("axis_y_mode_swap_parity", 0, "a setting of axis Y"),
    ("axis_z_gear_steps_parity", 0, "a setting of axis Z"),
    ("axis_x_backlash_size_parity", 0, "a setting of axis X"),
    ("pitch_x_parity", 0, "a setting of axis X"),
    ("latch_double", 3, "the latch of the interlock")])
def test_a_bit_trips_with_its_reason(register, bit, said):
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        job = Job(session, watched=("safe",))
        job.start(program(Data(), "G01 Z-0.9 F300"))
        job.reach(2000, pace(session, 300))
        place = session.get("read.z_pulses")
        session.poke(register, job.probe(register) ^ 1 << bit)
        begun = session.cycle
        alarm = job.alarm()
        assert alarm["code"] == alarm_number("trip")
        assert alarm["text"].endswith("a guarded register of the gateware is damaged "
                                      f"({said}); the position is lost.")
        assert job.record.rises("safe", begun)[0] - begun <= CLOCKS
        assert abs(session.get("read.z_pulses") - place) / 10 <= AWAY_UM
        # The path begins anew and the registers are written, so that no damage remains.
        job.run(session.clock_hz // 10)
        job.link.command("$X")
        assert not job.probe("safety_status_safe")


def turned_over(session, register, bit, said, *, feed, path, fast):
    """A bit of a register turns over in a cut, at ``path``: a trip with its reason; the job."""
    at, = (index for index, (name, _) in enumerate(session.state()) if name == register)
    job = Job(session, watched=("safe",))
    job.start(program(Data(), f"G01 Z-0.9 F{feed}"))
    job.reach(path, pace(session, feed))
    assert (job.probe("ramp_above") > 0) == fast
    session.turn_over(at, bit)
    begun = session.cycle
    alarm = job.alarm()
    assert alarm["text"].endswith("a guarded register of the gateware is damaged "
                                  f"({said}); the position is lost.")
    assert job.record.rises("safe", begun)[0] - begun <= CLOCKS
    return job


@pytest.mark.parametrize("bit", [31, pytest.param(24, marks=pytest.mark.soak)])
def test_a_bit_of_the_ramps_rate_trips_above_the_start_stop_speed(bit):
    """Without a guard its top bit let the axis run into a short six times as far."""
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        turned_over(session, "soc.controller.motion.ramp.quarters", bit, "the rate of the ramp",
                    feed=1200, path=4000, fast=True)


@pytest.mark.parametrize("bit", [12, pytest.param(5, marks=pytest.mark.soak)])
def test_a_bit_of_what_the_backlash_has_taken_up_trips(bit):
    """Without a guard the axis went 0.4 mm from its way, and told the wrong place."""
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        job = turned_over(session, "soc.fields__axis_x__backlash_taken_up", bit, "axis X",
                          feed=300, path=2000, fast=False)
        assert abs(session.get("read.x_pulses")) / 10 <= 0.2
        job.run(session.clock_hz // 10)
        job.make_ready()
        job.link.command("G01 X0.1 F300")
        job.until(lambda: job.link.status()["state"] == "Idle", "the end of the motion",
                  step=10_000)
        assert job.probe("axis_x_command") == 1000
        assert abs(session.get("read.x_pulses") - 1000) < 2
