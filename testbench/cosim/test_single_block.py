# SPDX-License-Identifier: Apache-2.0
"""Single block and dry run on the whole simulated machine."""

from host.link.link import RESUME
from host.machines import machine as machines
from softcore.tables.settings import assign
from testbench.cosim.job import HEIGHT_MM, MM, Data, Job, program
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
BLOCKS = ("G91 G01 X0.02 F600", "G02 X0.02 Y0.02 I0.02 J0", "G00 Y0.03")
PLACES = ((0, 0), (200, 0), (400, 200), (400, 500))     # pulses
CONTACT = 152


def test_a_tape_stops_after_each_block_and_its_discharge_with_it():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        job = Job(session, assign("single_block", 1))
        job.start(program(Data(), *BLOCKS))
        stops, burns = [], []
        while not job.told("program_end"):
            job.until(lambda: len(job.told("pause")) > len(stops) or job.told("program_end"),
                      "a stop", step=2000)
            if not job.told("program_end"):
                at = session.probe("axis_x_command"), session.probe("axis_y_command")
                job.run(40_000)
                assert at == (session.probe("axis_x_command"), session.probe("axis_y_command"))
                stops.append(at)
                burns.append(job.link.status().get("A", ""))
                job.press(RESUME)
        assert len(stops) == 9, "head 4, G36, three moves, M05; not M02"
        assert tuple(stops[4:8]) == PLACES
        assert not any("S" in on for on in burns), "the discharge is off at each stop"


def test_a_dry_run_has_no_pulse_and_its_own_feed():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        job = Job(session, assign("dry_run_mm_min", 300))
        before = job.link.status()["Gap"]
        job.start(program(Data(), "G91 G01 X0.5 F1"))
        job.until(lambda: session.probe("axis_x_command") > 1000, "the motion")
        began, at = session.cycle, session.probe("axis_x_command")
        job.run(session.clock_hz // 50)
        speed = (session.probe("axis_x_command") - at) / MM / (
            session.cycle - began) * session.clock_hz * 60
        assert abs(speed - 300) < 6, speed
        job.finish()
        assert job.link.status()["Gap"] == before, "no pulse was counted"
        assert session.probe("axis_x_command") == 5000


def test_a_dry_run_into_the_work_is_stopped_by_the_contact_guard():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        job = Job(session, assign("dry_run_mm_min", 300))
        job.start(program(Data(), "G01 Z-0.5 F1"))
        job.until(lambda: session.probe("axis_z_command") < MM * HEIGHT_MM, "the motion")
        job.short(True)
        job.until(lambda: job.told("alarm"), "the alarm")
        assert job.told("alarm")[0]["code"] == CONTACT
