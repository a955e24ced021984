# SPDX-License-Identifier: Apache-2.0
"""Scenarios: servo control along the path, and its faults."""

from itertools import pairwise

from softcore.tables.faults import alarm_number
from softcore.tables.settings import assign, named
from testbench.cosim.checks import pulses
from testbench.cosim.job import Data, Job, program
from testbench.native.station import Session

__all__ = ["TROUBLES", "both_ways", "cell", "never_down", "stuck_open", "stuck_short",
           "thresholds", "widens_beyond"]

PERIOD = assign("servo_period_us", 2000)     # us between servo steps: 50 pulses of condition 100
STEP = 50               # path pulses, of every built-in condition
# At 8 um a pulse in 16 is open by chance: enough of them in one count make a step of DOWN, once in
# some 600 counts. At 4 um it is one in 70.
WIDE_UM, NARROW_UM, GOOD_UM = 300, 8, 4
DEPTH_MM = 0.4
WAY = pulses(0.1 + DEPTH_MM)
WATCHED = ("path_command", "path_front", "safety_status_safe", "power_control_machining")

# Faults of the conductivity cell: force and value, message.
TROUBLES = {
    "broken": ("force.fluid_sensor", 1, "the fluid's cell reads too high: an open circuit"),
    "shorted": ("force.fluid_sensor", 2, "the fluid's cell reads too low: a shorted wire"),
    "silent": ("force.converter_silent", 1, "the converter does not answer"),
}


def _gap(job, width_um, debris=0.0):
    """Force the gap's width and its debris."""
    job.session.set("force.gap_um", width_um)
    job.session.set("force.debris", debris)


def _start(session, *settings, data):
    """A job under servo over a wide gap."""
    job = Job(session, PERIOD, *settings, watched=WATCHED)
    _gap(job, WIDE_UM)
    job.start(program(data, "G95 P1", f"G01 Z-{DEPTH_MM} F600"))
    return job


def _locked(job):
    """No discharge, no motion, and no tape until the operator unlocks."""
    assert not job.probe("power_control_machining")
    command = job.probe("path_command")
    job.start(program("G01 Z0.05 F300"))
    job.until(lambda: any("locked" in line for line in job.said), "the refusal", step=2000)
    assert job.probe("path_command") == command


def both_ways(session: Session) -> dict:
    """DOWN with open pulses, no step with good ones, UP with arcs; and on to the depth."""
    job = _start(session, data=Data(limit=0.3))
    job.until(lambda: job.probe("path_front") >= 1000, "a way of DOWN")
    _gap(job, GOOD_UM)
    job.run(session.clock_hz // 100)
    stands = job.probe("path_command")
    job.run(session.clock_hz // 20)
    assert job.probe("path_command") == stands == job.probe("path_front")
    _gap(job, NARROW_UM, debris=1)
    job.until(lambda: job.probe("path_command") <= stands - 4 * STEP, "a way of UP")
    assert job.probe("path_front") == stands
    _gap(job, WIDE_UM)
    job.finish()
    assert job.probe("path_command") == job.probe("path_front") == WAY
    assert job.probe("axis_z_command") == -WAY
    assert not job.told("retraction_start")
    values = [value for _, value in job.record.changes("path_command")]
    assert all(abs(after - before) == 1 for before, after in pairwise(values))
    turns = [one for one, (before, after) in zip(values[1:], pairwise(
        after - before for before, after in pairwise(values)), strict=False) if before != after]
    assert len(turns) >= 2
    # Whole steps but for the first: the second counts from where the electrode is by then.
    assert len({place % STEP for place in turns}) == 1, turns
    return {"cycle": session.cycle, "turns": turns, "events": job.events}


def widens_beyond(session: Session) -> dict:
    """UP and UP again: the alarm instead of the step that would pass the limit."""
    data = Data(limit=0.0518, changeover=0)
    job = _start(session, data=data)
    job.until(lambda: job.probe("path_front") >= 1000, "a way of DOWN")
    _gap(job, NARROW_UM, debris=1)
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("halt_servo")
    front = job.probe("path_front")
    # 518 pulses: ten steps of 50, and no eleventh.
    assert front - job.probe("path_command") == 10 * STEP
    assert job.probe("path_position") == job.probe("path_command")
    _locked(job)
    return {"cycle": session.cycle, "events": job.events}


def stuck_open(session: Session) -> dict:
    """No discharge comes: the servo goes no step further than allowed without one."""
    # As delivered: firmware checks now and then, and the time between steps must be longer.
    job = _start(session, assign("servo_period_us", named("servo_period_us").default),
                 assign("no_discharge_um", 150), data=Data())
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("no_discharge")
    assert "no discharge on the last 150 um of the way" in alarm["text"]
    way = job.probe("path_front")
    assert pulses(0.15) < way <= pulses(0.15) + STEP, way
    _locked(job)
    return {"cycle": session.cycle, "way": way, "events": job.events}


def never_down(session: Session) -> dict:
    """No DOWN comes: the electrode stands until the allowed time without progress is over."""
    job = _start(session, "G10 W0 Y0", assign("no_progress_s", 1), data=Data())
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("no_progress")
    assert "no progress in 1 s of machining at the front" in alarm["text"]
    assert job.probe("path_front") == job.probe("path_command") == 0
    began, = job.told("block", text=f"G01 Z-{DEPTH_MM} F600")
    # The path is loaded some passes of the main loop after the event of the block.
    assert 1 <= alarm["t"] - began["t"] < 1.02
    _locked(job)
    return {"cycle": session.cycle, "events": job.events}


def stuck_short(session: Session) -> dict:
    """A permanent short under servo: retraction, and the alarm at L."""
    data = Data(limit=0.06)
    job = _start(session, data=data)
    job.until(lambda: job.probe("path_front") >= 1000, "a way of DOWN")
    job.short(True)
    alarm = job.alarm()
    assert alarm["code"] == alarm_number("halt_limit")
    assert job.probe("path_front") - job.probe("path_command") == pulses(data.limit)
    told, = job.told("retraction_start")
    assert told["cause"] == "short"
    assert job.told("retraction_end")[0]["reason"] == "limit"
    _locked(job)
    return {"cycle": session.cycle, "events": job.events}


def cell(session: Session, trouble: str) -> dict:
    """The fluid's class becomes unknown: one alarm, and another at each new attempt."""
    force, value, said = TROUBLES[trouble]
    session.set("force.fluid_ohm_cm", 4e4)
    job = _start(session, assign("fluid_mode", 1), data=Data())
    told = job.wait("fluid_class")
    assert (told["class"], told["presets"]) == (2, {"dame": 8, "open": 3, "ok": 22})
    assert {kind: job.probe(f"servo_presets_{kind}") for kind in told["presets"]} == (
        told["presets"])
    job.until(lambda: job.probe("path_front") >= 1000, "a way of DOWN")
    session.set(force, value)
    _unknown(job, said)
    return {"cycle": session.cycle, "events": job.events}


def thresholds(session: Session) -> dict:
    """Thresholds out of order are reported before anything moves."""
    job = Job(session, PERIOD, assign("fluid_threshold_1", 500), assign("fluid_mode", 1),
              watched=WATCHED)
    _unknown(job, "the thresholds of the fluid's classes are out of order")
    assert job.probe("path_front") == 0
    # In order again, and it goes.
    job.link.command(assign("fluid_threshold_1", 2819))
    job.make_ready()
    job.events.clear()
    _gap(job, WIDE_UM)
    job.start(program(Data(), "G95 P1", f"G01 Z-{DEPTH_MM} F600"))
    job.finish()
    return {"cycle": session.cycle, "events": job.events}


def _unknown(job, said):
    """The alarm, and again when the operator unlocks and goes on with nothing changed."""
    alarm = job.alarm()
    assert (alarm["code"], said in alarm["text"]) == (alarm_number("fluid"), True), alarm
    _locked(job)
    way = job.probe("path_front")
    assert way < WAY
    job.events.clear()
    job.said.clear()
    job.make_ready()
    # A tape's path begins at 0.
    job.start(program("G95 P1", f"G01 Z-{DEPTH_MM} F600"))
    alarm = job.alarm()
    assert (alarm["code"], said in alarm["text"]) == (alarm_number("fluid"), True), alarm
    assert job.probe("path_front") == 0
    _locked(job)
