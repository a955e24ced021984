# SPDX-License-Identifier: Apache-2.0
"""The operator walks back along the path and forward again (``$WALK``), simulated."""

from itertools import pairwise

import pytest

from host.link.link import HOLD, RESET, RESUME, RETRACT, RefusedError
from host.machines import machine as machines
from rtl.states import State
from softcore.tables.faults import alarm_number
from softcore.tables.settings import assign
from testbench.cosim.job import MM, Data, Job, program
from testbench.cosim.record import SIGNALS
from testbench.native.simulation import Simulation
from testbench.some import some

SINKER, WIRE = machines.load("sinker"), machines.load("wire")
CONDITIONS = {"sinker": 100, "wire": 500}
WATCHED = (*SIGNALS, "gap_on", "gap_sense")
AXES = tuple(f"axis_{axis}_command" for axis in "xyz")
FEED = 60
LIMIT_MM = 0.05         # retractable: the walk goes further
DATA = Data(speed=60, limit=LIMIT_MM, high=120, low=30, changeover=0.02)
# A corner, and a quarter of a circle.
BLOCKS = (f"G91 G01 X0.1 F{FEED}", "Y0.1", "G02 X0.1 Y0.1 I0.1 J0", "G01 X0.1")
CORNER, ARC, LINE = 1000, 2000, 3571    # path coordinates where they begin
HOLD_AT = LINE + 300
STANDS = 60_000         # clocks in which nothing moves


def machined(machine):
    return Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1, trace=False)


def tape(machine, *blocks):
    return program(DATA, *blocks or BLOCKS, condition=CONDITIONS[machine.kind])


def places(record, begin=0):
    """The commanded place at each path coordinate from a clock on; the last time counts."""
    steps = record.changes("path_position", begin)
    return {coordinate: tuple(record.at(name, until) for name in AXES)
            for (_, coordinate), (until, _) in pairwise([*steps, (record.last, 0)])}


def here(job):
    return tuple(map(job.probe, AXES))


def walked(job):
    """The fields of the report that tell of a walk: ordered, and reached, in pulses."""
    told = job.link.status().get("Wk")
    return told and tuple(round(float(number) * MM) for number in told.split(","))


def rests(job):
    """The controller tells that the machine is on hold and at rest."""
    job.until(lambda: job.link.status().get("substate") == "0", "rest", step=2000)


def hold(job, coordinate=HOLD_AT):
    """Run to a place, and hold there. The front."""
    job.reach(coordinate, 60 * job.session.clock_hz / MM / FEED)
    job.press(HOLD)
    rests(job)
    return job.probe("path_front")


def arrives(job, front, distance):
    """It comes to that distance before the front, and stays."""
    job.until(lambda: job.probe("path_position") == front - distance, f"a walk of {distance}",
              step=200)
    rests(job)
    job.run(STANDS)
    assert job.probe("path_position") == front - distance
    assert walked(job) == (distance, distance)


def walk(job, front, distance):
    job.link.command(f"$WALK={distance / MM:.4f}")
    arrives(job, front, distance)


@pytest.fixture(scope="module")
def undisturbed():
    """The reference path of each machine, and its end."""
    found = {}

    def of(machine):
        if machine.kind not in found:
            with machined(machine) as session:
                job = Job(session, watched=WATCHED)
                job.start(tape(machine))
                job.finish()
                found[machine.kind] = places(job.record), here(job)
        return found[machine.kind]
    return of


@pytest.mark.parametrize("machine", some([SINKER, WIRE], SINKER, WIRE),
                         ids=lambda machine: machine.kind)
def test_there_and_back_and_on_as_if_nothing_had_been(undisturbed, machine):
    reference, end = undisturbed(machine)
    with machined(machine) as session:
        job = Job(session, watched=WATCHED)
        job.start(tape(machine))
        front = hold(job)
        assert walked(job) is None
        stops = {}
        # Back in steps, the last beyond arc and corner; forward; back again.
        for distance in (200, 1200, front - CORNER + 400, 700, front - ARC - 300, 2500):
            walk(job, front, distance)
            stops[front - distance] = here(job)
        assert front - min(stops) > 6 * LIMIT_MM * MM
        # Forward over the corner, with a short on the last bit: it goes back from there, and on.
        job.link.command("$WALK=0.01")
        job.reach(front - 300, 60 * session.clock_hz / MM / DATA.high)
        job.short(True)
        job.until(lambda: job.probe("path_status_state") == State.RETRACTING.value, "a retraction")
        job.run(10_000)
        job.short(False)
        arrives(job, front, 100)
        stops[front - 100] = here(job)
        resumed = session.cycle
        job.press(RESUME)
        job.until(lambda: job.probe("path_status_state") == State.FRONT.value, "the front")
        at_front = here(job)
        job.finish()
        assert here(job) == end
        record = job.record

    assert stops == {place: reference[place] for place in stops}
    record.check_path()
    assert at_front == reference[front], "machining goes on at the pulse at which it was held"
    (left, returned), = [(one.begin, one.end) for one in record.excursions()]
    assert not record.rises("gap_on", left + 2, resumed), "nothing is cut in the walk"
    assert record.rises("gap_sense", left, resumed)
    assert record.rises("gap_on", resumed)
    assert max(value for _, value in record.changes("path_position", left, returned)) <= front
    after = places(record, returned)
    assert after.items() <= reference.items()
    assert max(after) == max(reference)
    causes = [event["cause"] for event in job.told("retraction_start")]
    assert causes == ["operator"] * 5 + ["short"]
    assert not job.told("alarm")
    assert [event["text"] for event in job.told("block")][-6:-2] == list(BLOCKS)


@pytest.fixture
def held():
    """A sinker on hold in the last line, with its front."""
    with machined(SINKER) as session:
        job = Job(session, watched=WATCHED)
        job.start(tape(SINKER))
        yield job, hold(job)


def test_a_hold_stops_the_way_forward_at_once_and_not_the_way_back(held):
    job, front = held
    job.link.command("$WALK=0.2")
    job.until(lambda: job.probe("path_position") < front - 500, "the way back")
    job.press(HOLD)
    arrives(job, front, 2000)
    job.link.command("$WALK=0.05")
    job.until(lambda: job.probe("path_position") > front - 1500, "the way forward")
    job.link.press(HOLD)
    job.run(4000)
    at = job.probe("path_command")
    job.run(STANDS)
    assert job.probe("path_command") == at
    assert walked(job)[1] == front - at > 500
    walk(job, front, 500)
    # A new place while it goes forward: first it comes to the old one.
    job.link.command("$WALK=0.01")
    job.run(20_000)
    walk(job, front, 800)
    job.press(RESUME)
    job.finish()


def test_a_retraction_after_a_walk_has_its_own_limit(held):
    job, front = held
    walk(job, front, 2000)
    job.press(RESUME)
    job.until(lambda: job.probe("path_status_state") == State.FRONT.value, "the front", step=500)
    job.press(RETRACT)
    job.wait("resume", 2)
    job.finish()
    assert job.told("retraction_end")[-1]["distance"] == LIMIT_MM


def test_a_resume_on_the_way_back_ends_it_there(held):
    job, front = held
    job.link.command("$WALK=0.01")
    job.until(lambda: job.probe("path_position") < front - 20, "the way back")
    job.press(RESUME)
    job.finish()
    end, = job.told("retraction_end")
    assert end["distance"] == pytest.approx(0.01, abs=1e-9), "not on to the retractable limit"


def test_a_reset_ends_it(held):
    job, front = held
    walk(job, front, 2000)
    job.link.realtime(RESET)
    job.wait("alarm")
    job.run(400_000)
    job.make_ready()
    assert walked(job) is None
    assert job.link.status()["state"] == "Idle"
    job.events.clear()
    job.start(program(DATA, "G91 G01 Y-0.1 F60"))
    job.until(lambda: job.probe("path_position") > 800, "the new path")
    job.press(RETRACT)
    job.finish()
    assert job.told("retraction_end")[-1]["distance"] == LIMIT_MM


def test_a_short_where_it_stands_retracts_and_comes_back(held):
    job, front = held
    walk(job, front, 300)
    job.short(True)
    job.until(lambda: job.probe("path_position") < front - 350, "a retraction")
    job.short(False)
    arrives(job, front, 300)


def test_a_short_beyond_the_retractable_limit_has_no_way_back(held):
    """The limit counts from the front. The machine halts where it is, and its place is kept."""
    job, front = held
    walk(job, front, 1500)
    job.short(True)
    assert job.alarm()["code"] == alarm_number("halt_limit")
    assert job.probe("path_position") == front - 1500
    assert "Lost" not in job.link.status()
    job.short(False)
    job.make_ready()
    assert walked(job) is None


def test_from_a_hold_in_the_re_advance(held):
    job, front = held
    job.press(RESUME)
    job.run(20_000)
    job.press(RETRACT)
    job.until(lambda: job.probe("path_status_state") == State.HIGH.value, "the re-advance")
    front = hold(job, 0)
    stands = front - job.probe("path_position")
    assert stands > 300
    assert walked(job) == (0, stands)
    walk(job, front, 300)
    walk(job, front, 1000)
    job.press(RESUME)
    job.finish()
    assert job.probe("path_position") == LINE + 1000


def test_under_servo_the_walk_is_longer_than_what_it_has_drawn_back():
    """A shorter one would end at the place where machining goes on."""
    with machined(SINKER) as session:
        job = Job(session, assign("servo_period_us", 2000), watched=WATCHED)
        session.set("force.gap_um", 300)
        job.start(program(Data(limit=0.3), "G95 P1", "G01 Z-0.4 F600"))
        job.until(lambda: job.probe("path_front") >= 1000, "the way forward")
        session.set("force.gap_um", 8)
        session.set("force.debris", 1)
        job.until(lambda: job.probe("path_front") - job.probe("path_command") >= 200, "a way back")
        front = hold(job, 0)
        drawn = front - job.probe("path_position")
        assert drawn >= 200
        with pytest.raises(RefusedError, match=f"is longer than {drawn / MM:.4f} mm here"):
            job.link.command(f"$WALK={drawn / MM:.4f}")
        walk(job, front, drawn + 1)
        walk(job, front, 2 * drawn)
        walk(job, front, drawn + 1)
        session.set("force.debris", 0)
        session.set("force.gap_um", 300)
        resumed = session.cycle
        job.press(RESUME)
        job.finish()
        record = job.record
        one, = record.excursions()
        assert not record.rises("gap_on", one.begin + 2, resumed)
        assert record.at("path_position", one.end) == front - drawn
        assert job.probe("axis_z_command") == -5000


def test_no_further_than_the_path(held):
    job, front = held
    with pytest.raises(RefusedError, match=r"is .* mm here, no more") as told:
        job.link.command("$WALK=500")
    most = float(str(told.value).split(" mm here")[0].split()[-1])
    assert most * MM > front, "on a sinker up to the soft limit"
    job.run(STANDS)
    assert job.probe("path_position") == front
    walk(job, front, front + 1000)
    assert here(job)[2] > 0, "up, beyond the first point"
    job.press(RESUME)
    job.finish()


def test_without_discharge_contact_stops_the_way_forward():
    with machined(SINKER) as session:
        job = Job(session, watched=WATCHED)
        job.start(tape(SINKER).replace("M03\n", ""))
        front = hold(job)
        walk(job, front, 2000)
        job.link.command("$WALK=0.02")
        job.until(lambda: job.probe("path_position") > front - 1800, "the way forward")
        job.short(True)
        assert job.alarm()["code"] == alarm_number("contact")
        at = job.probe("path_position")
        assert at < front - 200
        job.run(STANDS)
        assert job.probe("path_position") == at
        assert not job.collect().rises("gap_on")
        job.short(False)
        job.make_ready()
        assert walked(job) is None


def test_at_a_programmed_stop():
    with machined(SINKER) as session:
        job = Job(session, watched=WATCHED)
        job.start(tape(SINKER, *BLOCKS[:3], "M00", BLOCKS[3]))
        job.wait("pause")
        rests(job)
        front = job.probe("path_front")
        assert front == LINE
        walk(job, front, 2000)
        walk(job, front, 100)
        job.press(RESUME)
        job.finish()
        record = job.record
        assert job.probe("path_position") == LINE + 1000
        (left, returned), = [(one.begin, one.end) for one in record.excursions()]
        assert not record.rises("gap_on", left, returned), "the discharge returns at the front"
        assert record.rises("gap_on", returned)
