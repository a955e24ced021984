# SPDX-License-Identifier: Apache-2.0
"""Scenarios: the depth series (G39) switches at the exact pulse, whatever moves the axis."""

from itertools import pairwise

from softcore.tables.settings import assign, named
from testbench.cosim.checks import pulses
from testbench.cosim.job import HEIGHT_MM, MM, Data, Job, program
from testbench.native.station import Session

__all__ = ["WATCHED", "check_levels", "check_switches", "crowded_steps", "steps_in_one_block",
           "steps_under_servo"]

WATCHED = ("condition_switched", "axis_z_position", "gap_on", "gap_level", "power_level",
           "path_command", "path_status_state")
IP = {100: 1, 110: 2, 120: 4, 130: 6, 140: 9, 150: 12,  # built in,
      901: 1, 904: 4, 906: 6, 909: 9, 912: 12}          # and entered
STEPS = [(-0.05, 140), (-0.1, 130), (-0.15, 120), (-0.2, 100)]
# From a switch to the next, at most, if its depth has been reached: firmware's clocks, or the time
# in which the power supply and the references settle.
LATE_CLOCKS, LATE_S = 12_000, 1e-3


def depth_series(steps):
    """Blocks of a depth series."""
    return [f"G39 Z{depth:g} C{number}" for depth, number in steps]


def _check_stamps(told, clocks):
    """Events carry the clock of the switch; the session counts from some clocks earlier on."""
    assert len({clock - event["cycle"] for event, clock in zip(told, clocks, strict=True)}) == 1


def check_switches(job, steps, origin=HEIGHT_MM):
    """Check that every step is switched once, in order, exactly at its depth, with its event."""
    record = job.record
    told = [event for event in job.told("condition") if event["by"] == "series"]
    clocks = record.rises("condition_switched")
    assert [(event["depth"], event["number"], event["ip"]) for event in told] == [
        (depth, number, IP[number]) for depth, number in steps]
    _check_stamps(told, clocks)
    for event, clock in zip(told, clocks, strict=True):
        assert event["pos"]["z"] == event["depth"]
        depth = pulses(event["depth"] - origin)
        # Two clocks before, the position reached this depth for the first time.
        assert record.at("axis_z_position", clock - 2) == depth
        assert record.lowest("axis_z_position", 0, clock - 2) == depth + 1
    return clocks


def check_levels(record, switches, first, steps):
    """Check that every main pulse has one current: that of the condition at its start."""
    gates = record.changes("gap_on")
    currents = [IP[number] for number in (first, *(number for _, number in steps))]
    seen = set()
    for (begin, on), (end, _) in pairwise(gates):
        if not on:
            continue
        # The pads have a register; the condition is taken over between two pulses.
        number = sum(clock < begin - 1 for clock in switches)
        level = record.at("gap_level", begin)
        assert level in {currents[number], currents[max(number - 1, 0)]}, (begin, level)
        if not any(begin - 3 <= clock < begin for clock in switches):
            assert level == currents[number], (begin, level, number)
        assert record.changes("gap_level", begin + 1, end) == [], begin
        seen.add(level)
    assert seen == set(currents)


def _short(job, number):
    """Make short number ``number`` while the path goes forward, and clear it after 70 um.

    A short during a jump would belong to the jump, without a retraction of its own.
    """
    job.until(lambda: job.probe("path_status_state") == 0, "motion forward")
    job.short(True)
    front = job.probe("path_front")
    job.until(lambda: job.probe("path_command") <= front - 700, "a way back")
    job.short(False)
    job.until(lambda: len(job.told("retraction_start", cause="short")) == number
              and job.probe("path_status_state") == 0, "the way forward")


def _figures(job):
    return {"cycle": job.session.cycle, "events": job.events}


def steps_in_one_block(session: Session) -> dict:
    """One long block at constant feed, with shorts and periodic jumps on the way."""
    job = Job(session, watched=WATCHED)
    job.start(program(Data(), "G38 P60 L0.1 R900 H900", *depth_series(STEPS), "G01 Z-0.25 F90",
                      condition=150))
    for back in range(3):
        job.reach(900 + 600 * back, session.clock_hz / (1.5 * 10_000))
        _short(job, back + 1)
    job.finish()
    switches = check_switches(job, STEPS)
    check_levels(job.record, switches, 150, STEPS)
    causes = [event["cause"] for event in job.told("retraction_start")]
    assert causes.count("short") >= 3
    assert causes.count("jump") >= 3
    return _figures(job)


def steps_under_servo(session: Session) -> dict:
    """The same by counted pulse classes, which step back as well."""
    # With the times of C100, which arcs follow in a foul gap.
    rows = [f"G10 C{number} I{ip} P15 Q25 R25" for number, ip in IP.items() if number > 900]
    steps = [(depth, 900 + IP[number]) for depth, number in STEPS]
    job = Job(session, assign("servo_period_us", 2000), *rows, watched=WATCHED)
    session.set("force.gap_um", 300)
    job.start(program(Data(limit=0.3), *depth_series(steps), "G95 P1", "G01 Z-0.25 F600",
                      condition=912))
    job.until(lambda: job.probe("path_front") >= 1800, "a way of DOWN")
    session.set("force.gap_um", 8)
    session.set("force.debris", 1)
    back = job.probe("path_front") - 400
    job.until(lambda: job.probe("path_command") <= back, "a way of UP")
    session.set("force.debris", 0)
    session.set("force.gap_um", 300)
    job.finish()
    switches = check_switches(job, steps)
    check_levels(job.record, switches, 912, steps)
    return _figures(job)


def crowded_steps(session: Session) -> dict:
    """Steps closer than firmware can load them, and one already passed: late, but none lost."""
    steps = [(0.05, 140), (-0.05, 130), (-0.0501, 120), (-0.0502, 110), (-0.0503, 100),
             (-0.1, 150)]
    job = Job(session, watched=WATCHED)
    job.start(program(Data(), "G01 Z0 F300", *depth_series(steps), "Z-0.15 F60", condition=120))
    job.finish()
    record = job.record
    told = [event for event in job.told("condition") if event["by"] == "series"]
    assert [(event["depth"], event["number"]) for event in told] == steps
    clocks = record.rises("condition_switched")
    _check_stamps(told, clocks)
    for event, clock in zip(told, clocks, strict=True):
        assert pulses(event["pos"]["z"] - HEIGHT_MM) == record.at("axis_z_position", clock - 2)
        assert event["pos"]["z"] <= event["depth"]
    at = [event["pos"]["z"] for event in told]
    assert abs(at[0]) <= named("window").default / MM, "the axis is in position"
    assert (at[1], at[5]) == (-0.05, -0.1)
    late = [after - before for before, after in pairwise(clocks[1:5])]
    assert max(late) <= max(LATE_CLOCKS, LATE_S * session.clock_hz), late
    return _figures(job) | {"late": late}
