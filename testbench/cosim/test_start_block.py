# SPDX-License-Identifier: Apache-2.0
"""A tape from one of its blocks (``$FROM``), on the whole simulated machine."""

import pytest

from host.link.link import RESUME, RefusedError
from host.machines import machine as machines
from host.tape.tape import encode
from softcore.tables.faults import alarm_number
from testbench.cosim.contact import REACTION
from testbench.cosim.job import HEIGHT_MM, MM, Data, Job, program
from testbench.native.simulation import Simulation
from testbench.some import some

SINKER, WIRE = machines.load("sinker"), machines.load("wire")
WATCHED = ("axis_x_command", "axis_y_command", "axis_z_command", "gap_on", "pp", "completed")
AXES = WATCHED[:3]

# Block 1 is `%`; the head has blocks 2 to 5.
SINK = program("M08", Data(), "G01 X0.02 F600", "Y0.03 Z0.08", "G91 G02 X0.02 Y0.02 I0.02 J0",
               "G01 X-0.01", "G90 Z0.06")
# Where its moves begin, pulses. Before the first word of an axis it stays where the machine stands.
BEGINS = {8: (None, None, None), 9: (200, None, None), 10: (200, 300, -200), 11: (400, 500, -200),
          12: (300, 500, -200)}
CUT = """%
G21 G90 G94
G10 D1 R0.118
C500
M08
M03
G36 R60 L0.3 H120 E30 Q0.05
G41 D1 G01 X0.2 F60
G01 X0.3
Y-0.2
X0.6
G03 X0.8 Y0. J0.2
G01 Y0.2
G40 X0.6
M02
%
"""


def places(session):
    return tuple(session.probe(name) for name in AXES)


def whole(machine, tape):
    """Run a tape from its beginning: the place in which each block begins, events, the end."""
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1,
                    trace=False) as session:
        job = Job(session, watched=WATCHED)
        job.start(encode(tape))
        job.finish()
        record = job.collect()
        begins = {event["line"]: tuple(record.at(name, event["cycle"] + 2) for name in AXES)
                  for event in job.told("block")}
        return begins, job.events, places(session)


@pytest.fixture(scope="module")
def sunk():
    return whole(SINKER, SINK)


@pytest.fixture(scope="module")
def cut():
    return whole(WIRE, CUT)


def from_block(machine, tape, block, high=(0, 0, 0)):
    """Run it from a block; the machine stands ``high`` (mm) from where it would begin.

    The job, the clock of the operator's word, the place before it, at the first pulse, and in the
    end.
    """
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1,
                    trace=False) as session:
        job = Job(session, watched=WATCHED)
        for axis, way in zip("XYZ", high, strict=True):
            if way:
                job.link.command(f"G21 G91 G00 {axis}{way}")
        job.until(lambda: job.link.status()["state"] == "Idle", "rest", step=10_000)
        stood = places(session)
        job.link.command(f"$FROM={block}")
        job.start(encode(tape))
        job.wait("pause")
        job.run(40_000)
        assert places(session) == stood, "nothing moves before the operator's word"
        assert not job.collect().rises("gap_on"), "nothing burns before it either"
        waited = session.cycle
        job.press(RESUME)
        job.finish()
        record = job.collect()
        first = record.rises("gap_on")[0]
        at = tuple(record.at(name, first) for name in AXES)
        return job, waited, stood, at, places(session)


@pytest.mark.parametrize(("block", "high"), some([
    (8, (0.1, -0.05, 0.3)), (9, (0, 0, 0)), (10, (-0.02, 0, 0.01)), (11, (0.1, -0.05, 0.3)),
    (12, (0, 0, 0))], (9, (0, 0, 0)), (11, (0.1, -0.05, 0.3))), ids=str)
def test_the_rest_of_a_tape_is_what_it_is_in_the_whole(sunk, block, high):
    _, events, end = sunk
    job, waited, stood, at, stands = from_block(SINKER, SINK, block, high)
    assert stands == end
    # The discharge begins where the block does, and the machine has come there without it.
    begin = tuple(there if wanted is None else wanted
                  for there, wanted in zip(stood, BEGINS[block], strict=True))
    assert at == begin
    assert [event["text"] for event in job.told("block")] == [
        event["text"] for event in events if event["event"] == "block" and event["line"] >= block]
    told = next(line for line in job.said if f"block {block} begins at" in line)
    x, y, z = (value / MM for value in begin)
    assert f"X{x:.4f} Y{y:.4f} Z{z + HEIGHT_MM:.4f}:" in told
    assert [event["source"] for event in job.told("retraction_set")] == ["tape"]
    assert job.told("aux")[0]["cycle"] > waited, "no function of a block left out"
    assert not job.told("alarm")


def test_the_electrode_goes_across_above_and_then_down():
    job, waited, *_ = from_block(SINKER, SINK, 10, (0.1, 0, 0.2))
    record = job.record
    ways = [(clock, name) for name in AXES[:1] + AXES[2:]
            for clock, _ in record.changes(name, waited)]
    down = min(clock for clock, name in ways if name == "axis_z_command")
    goal = round(0.02 * MM)
    assert record.at("axis_x_command", down) == goal
    begun = record.rises("gap_on")[0]
    assert record.at("axis_z_command", begun) <= round(0.08 * MM)


# Before and behind an outside corner, and an arc.
@pytest.mark.parametrize("block", some([10, 11, 13], 11))
def test_a_wire_offset_is_in_force_at_the_place_of_the_block(cut, block):
    begins, _, end = cut
    _, _, _, at, stands = from_block(WIRE, CUT, block, (-0.01, 0, 0))
    assert stands == end
    assert max(abs(a - b) for a, b in zip(at, begins[block], strict=True)) <= 2, (
        at, begins[block])


@pytest.fixture
def job():
    with Simulation(machine=SINKER.tables, clock_hz=SINKER.clock_hz, seed=1,
                    trace=False) as session:
        yield Job(session, watched=WATCHED)


def test_a_stop_in_the_first_block_is_one_more(job):
    job.link.command("$FROM=8")
    job.start(program(Data(), "G01 X0.02 F600", "M00", "X0.03"))
    for count in (1, 2):
        job.wait("pause", count)
        job.run(40_000)
        assert job.probe("axis_x_command") == 200 * (count - 1)
        job.press(RESUME)
    job.finish()
    assert job.probe("axis_x_command") == 300


def test_an_electrode_that_touches_may_go_up_to_its_block(job):
    job.start(program(Data(), "G01 Z0.05 F600"))
    job.finish()
    job.short(True)
    job.link.command("$FROM=8")
    job.start(program(Data(), "G00 Z0.09", "G01 X0.01 F600"))
    job.wait("pause")
    job.press(RESUME)
    job.until(lambda: job.probe("axis_z_command") == -100, "the way up")
    job.short(False)
    job.finish()


def test_a_block_behind_the_end_is_an_alarm_before_any_motion(job):
    job.link.command("$FROM=90")
    job.start(SINK)
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("start_block")
    assert alarm["text"].endswith("the tape ends before the block at which it was to begin.")
    assert job.probe("axis_x_command") == 0
    # It is not in force for the next tape.
    job.events.clear()
    job.said.clear()
    job.make_ready()
    job.start(SINK)
    job.finish()
    assert not job.told("pause")


def test_a_touch_off_cannot_be_left_out(job):
    job.link.command("$FROM=8")
    job.start(program(Data(), "G38.3 Z0.09 F60", "G01 X0.1 F60").replace("M03\n", ""))
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("start_block")
    assert "a touch-off (G38.2 to G38.5) cannot be left out" in alarm["text"]
    assert job.probe("axis_z_command") == 0


@pytest.mark.parametrize("word", ["", "x", "-1", "1.5", "999999999", " 3"])
def test_a_wrong_number_is_refused(job, word):
    with pytest.raises(RefusedError, match="takes the number of a block"):
        job.link.command(f"$FROM={word}")


def test_the_work_on_the_way_there_stops_it(job):
    job.link.command("$FROM=11")
    job.start(SINK)
    job.wait("pause")
    job.press(RESUME)
    job.until(lambda: job.probe("axis_x_command") > 50, "the way")
    job.short(True)
    # The way goes at the start/stop speed: contact stops it at once, and no drive is tripped.
    assert job.alarm()["code"] == alarm_number("contact")
    job.run(40_000)
    record = job.collect()
    sample = record.rises("completed")[-1] - 1
    assert max(record.rises("pp")) <= sample + REACTION
    assert not record.rises("gap_on")


def test_a_running_tape_cannot_be_told(job):
    job.start(SINK)
    with pytest.raises(RefusedError, match="for the next tape"):
        job.link.command("$FROM=3")


def test_a_reset_forgets_the_block(job):
    job.link.command("$FROM=10")
    job.link.realtime(b"\x18")
    job.run(200_000)
    job.events.clear()
    job.make_ready()
    job.link.command(f"G92 X0 Y0 Z{HEIGHT_MM}")
    job.start(SINK)
    job.finish()
    assert not job.told("pause")
