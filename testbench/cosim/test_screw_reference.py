# SPDX-License-Identifier: Apache-2.0
"""A table of the pitch error moves no axis by itself: on a switch, in homing, when entered."""

import pytest

from host.link.link import RefusedError
from softcore.tables.settings import NO_PITCH_ERROR, assign
from testbench.cosim import homing
from testbench.cosim.test_coarse_homing import machine, rests

FINE = 10_000           # edges per mm: an edge is a pulse
TABLES = (380, -300)    # um


def table(error_um):
    """One that rises by 10 um in 1 mm about the start, from an error on."""
    return {"pitch_points_x": 3, "pitch_first_x": 10_000, "pitch_step_x": 10_000} | {
        f"pitch_x_{point}": NO_PITCH_ERROR + 10 * error_um + 100 * (point - 1)
        for point in (1, 2, 3)}


def begin(session, **changed):
    return homing.begin(session, *(assign(*one) for one in (
        homing.SETTINGS | {"home_order": 1} | changed).items()))


def true_x(job):
    return job.session.get("read.x_pulses")


def go(job, line):
    job.link.command(line)
    job.run(job.session.clock_hz // 5)
    return rests(job)


def onto_the_lower_switch(job):
    """Jog X until its switch trips, unlock, and return where it rests, in pulses."""
    trip(job)
    job.link.command("$X")
    job.run(job.session.clock_hz // 10)
    return true_x(job)


def trip(job, feed=300):
    """Jog X until its switch trips."""
    job.link.send_line(f"$J=G91 X-2 F{feed}")
    end = job.session.cycle + 2 * job.session.clock_hz
    while job.link.status()["state"] != "Alarm":
        assert job.session.cycle < end
        job.run(job.session.clock_hz // 50)
    job.run(job.session.clock_hz // 5)


def lowest(job, seconds):
    """Lowest true place of X in some time, looked at every ms."""
    found = [true_x(job)]
    for _ in range(round(seconds * 1000)):
        job.run(job.session.clock_hz // 1000)
        found.append(true_x(job))
    return min(found)


@pytest.mark.parametrize("error_um", TABLES)
def test_a_table_that_is_entered_on_a_switch_moves_nothing(error_um):
    with machine(FINE) as session:
        job = begin(session)
        job.link.command("$POSITION=HERE")
        place = onto_the_lower_switch(job)
        for name, value in table(error_um).items():
            job.link.command(assign(name, value))
        job.link.command("$POSITION=HERE")
        assert lowest(job, 0.3) > place - 1
        assert true_x(job) < place + 1
        with pytest.raises(RefusedError, match="limit switch"):
            job.link.command("$J=G91 X-0.1 F30")


@pytest.mark.parametrize("error_um", TABLES)
def test_homing_leaves_a_switch_whatever_is_made_up_for(error_um):
    """The drive swings by a pulse or two where it turns."""
    with machine(FINE) as session:
        job = begin(session, **table(error_um))
        job.link.command("$POSITION=HERE")
        place = onto_the_lower_switch(job)
        job.link.send_line("$H")
        assert lowest(job, 0.1) > place - 2
        status = rests(job)
        assert "Lost" not in status
        assert status["MPos"].startswith("-299.0000")
        assert len(job.told("alarm")) == 1, "that of the jog"


@pytest.mark.parametrize("error_um", TABLES)
def test_the_axis_stays_where_its_position_is_accepted(error_um):
    """And then the error of the table is made up for from there."""
    with machine(FINE) as session:
        job = begin(session, **table(error_um))
        job.link.command("$POSITION=HERE")
        assert lowest(job, 0.2) > -1
        assert true_x(job) < 1
        go(job, "G91 G01 X0.4 F300")
        # The motor stands lower by the 4 um that the screw takes the axis further.
        assert true_x(job) == pytest.approx(4000 - 40, abs=2)


@pytest.mark.parametrize("rise_um", [1000, -1000])
def test_an_unlock_on_a_switch_moves_nothing_with_the_steepest_table(rise_um):
    """The axis coasted on after the switch had tripped."""
    steep = {"pitch_points_x": 2, "pitch_first_x": 100_000, "pitch_step_x": 1_000_000,
             "pitch_x_1": NO_PITCH_ERROR, "pitch_x_2": NO_PITCH_ERROR + rise_um}
    with machine(FINE, brake_mm_s2=20) as session:
        job = begin(session, **steep)
        job.link.command("$POSITION=HERE")
        trip(job, 600)
        job.run(2 * session.clock_hz)
        place = true_x(job)
        assert place < -15_000, "it coasted"
        job.link.command("$X")
        job.run(session.clock_hz // 5)
        assert true_x(job) == pytest.approx(place, abs=2)


@pytest.mark.parametrize("screws", [False, True])
def test_homing_of_another_axis_leaves_a_backlash_as_it_is_made_up_for(screws):
    made_up = {"home_order": 2, "backlash_x": 500} | ({"pitch_points_y": 2} if screws else {})
    with machine(FINE, backlash_um=50) as session:
        job = begin(session, **made_up)
        job.link.command("$POSITION=HERE")
        go(job, "G91 G01 X0.2 F300")
        go(job, "G91 G01 X-0.2 F300")
        assert "Lost" not in go(job, "$H")
        go(job, "G91 G01 X0.2 F300")
        assert true_x(job) == pytest.approx(2000, abs=2)


@pytest.mark.parametrize("screws", [False, True])
def test_a_backlash_wider_than_the_pull_off_is_homed_from_a_pressed_switch(screws):
    made_up = {"backlash_x": 2000} | ({"pitch_points_x": 2} if screws else {})
    with machine(FINE, backlash_um=200) as session:
        job = begin(session, **made_up)
        job.link.command("$POSITION=HERE")
        trip(job)
        assert "Lost" not in go(job, "$H")
        assert len(job.told("alarm")) == 1, "that of the jog"
