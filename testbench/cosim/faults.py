# SPDX-License-Identifier: Apache-2.0
"""Scenarios: causes of safe outputs, the time until they are safe, and the messages."""

import pytest

from host.link.link import RefusedError
from softcore.image import target_image
from softcore.tables.causes import numbers
from softcore.tables.faults import alarm_number
from softcore.tables.settings import assign
from softcore.top import Top
from testbench.cosim.coder import jump_between_edges
from testbench.cosim.job import Data, Job, program
from testbench.cosim.record import WATCHDOG, WATCHDOG_S
from testbench.cosim.retractions import pace
from testbench.native.station import Session

__all__ = ["FAULTS", "browned_out", "hung", "tripped"]

PINS = ("gap_on", "gap_sense", "dac", "drive_enable", "contactor", "safe")
WATCHED = (*PINS, *WATCHDOG, "safety_latched", "path_command",
           "path_position")
PADS = 5  # clocks from a pin in to a pin out: synchronisers, a debounced clock, output registers
BROWN_OUT = 4  # clocks from the supply's failure to the reset's effect at the pins
HUNG_CLOCKS = 0xFFFF - 100  # that the processor stands still without a further word
LOOP = 0x6F.to_bytes(4, "little")  # jump to itself

NUMBER = numbers()

# Cause: force and its value, settings, clocks and seconds until safe, message, position kept.
FAULTS = {
    "estop": ("force.estop", 1, (), PADS, 0, "emergency stop", True),
    "drive_fault": ("force.drive_fault", 2, (), PADS, 0, "a drive reports a fault (axis Y)", True),
    "limit_low": ("force.limit_low", 4, (), PADS + 2, 0, "lower limit switch (axis Z)", True),
    "limit_high": ("force.limit_high", 1, (), PADS + 2, 0, "upper limit switch (axis X)", True),
    "fluid_low": ("force.fluid_low", 1, (), PADS, 50e-3, "fluid is below its level", True),
    "encoder": ("force.encoder_jump", 4, (), PADS, 20e-6, "illegal transition (axis Z)", False),
    "coder": ("force.encoder_cut", 4, (), 0, 20e-3, "coder of axis Z: both phases are silent",
              False),
    # The encoder stands still, and Er grows with the feed to a bound narrowly above the lag: in the
    # plain loop 1000 pulses at F300. With feed-forward the axis lags by 200 pulses when it starts,
    # and by none when it moves evenly; before Er has grown to them, the supervision has tripped.
    "following_moving": ("force.encoder_cut", 4,
                         (assign("feed_forward", 0), assign("follow_moving", 1030)), 0, 5e-3,
                         "in motion above its limit "
                         "(axis Z)", False),
}


def _machining(session, *settings):
    """A job in the middle of a cut, its position away from that at rest."""
    job = Job(session, *settings, watched=WATCHED)
    job.start(program(Data(), "G01 Z-0.9 F300"))
    job.reach(2000, pace(session, 300))
    return job


def _check_safe(job, since):
    """Check that from ``since`` on every output is in its safe state, and stays so.

    The velocity command has a register of its own and follows one clock after the enables.
    """
    record = job.collect()
    for pin in PINS:
        begin = since + (pin == "dac")
        assert record.at(pin, begin) == (pin == "safe"), f"{pin} in clock {begin}"
        assert not record.changes(pin, begin + 1), f"{pin} changes again"


def _restart(job, force):
    """Check that nothing restarts without the operator, and then the machine goes on."""
    job.start(program(Data(), "G01 Z0.05 F300"))
    job.until(lambda: any("locked" in line for line in job.said), "the refusal", step=2000)
    assert job.probe("safety_status_safe")
    job.session.set(force, 0)
    # Contacts bounce and fluid splashes: the cause must have been gone for a while.
    job.run(job.session.clock_hz // 10)
    job.make_ready()
    assert not job.probe("safety_status_safe")
    assert job.session.errors() == {axis: 0 for axis in "xyz"}
    done = len(job.told("program_end"))
    job.start(program(Data(), "G01 Z0.05 F300"))
    job.until(lambda: len(job.told("program_end")) > done, "the end", step=10_000)
    assert job.probe("axis_z_command") == job.probe("axis_z_position") + job.probe("axis_z_error")


def tripped(session: Session, cause: str) -> dict:
    """A fault in the middle of a cut: safe in time, named, latched, and no restart by itself."""
    force, value, settings, clocks, time_s, said, kept = FAULTS[cause]
    job = _machining(session, *settings)
    if cause == "following_moving":
        job.run(session.clock_hz // 10)     # until the axis lags by all of its lag
    if cause == "encoder":
        begun = jump_between_edges(session)
    else:
        begun = session.cycle
        session.set(force, value)
    alarm = job.alarm()
    record = job.record
    safe = record.rises("safe", begun)[0]
    assert safe - begun <= clocks + time_s * session.clock_hz, safe - begun
    _check_safe(job, safe)
    assert job.probe("safety_latched") == 1 << NUMBER[cause]
    assert alarm["code"] == alarm_number("limit" if cause.startswith("limit") else "trip")
    assert said in alarm["text"]
    # The controller counts clocks from the end of its reset.
    assert safe - alarm["cycle"] == Top.RESET_CLOCKS + 1
    assert ("the position is kept" in alarm["text"]) == kept
    # Pulses that the ramp had stored are not moved later.
    assert record.at("path_command", session.cycle) == record.at("path_position", session.cycle)
    if kept:
        # The machine coasts, and every edge is counted.
        assert job.probe("axis_z_position") == session.positions()["z"]
        _restart(job, force)
        assert job.probe("axis_z_command") == -500
    return {"events": job.events, "clocks": safe - begun}


def hung(session: Session, kind: str, delay: int) -> dict:
    """The processor hangs in the middle of a cut: safe after exactly the watchdog's period.

    The period counts from the last call, or from the last answer of the interrupt if that was
    before.

    ``clock``: the processor stops until the event of the trip wakes it. ``memory``: its program is
    lost; it runs on for as long as its cache has the words that it needs.
    """
    job = _machining(session)
    job.run(delay)
    if kind == "memory":
        session.load(LOOP * (len(target_image().read_bytes()) // 4))
        session.send(b"?")  # makes it execute words that it does not use otherwise
    end = session.cycle + session.clock_hz // 50
    while session.cycle < end:
        if kind == "clock" and not job.probe("safe"):
            session.poke("sleep_left", 0xFFFF)
        session.run(min(HUNG_CLOCKS, end - session.cycle))
    record = job.collect()
    period = round(WATCHDOG_S * session.clock_hz)
    safe = record.rises("safe")[-1]
    last = record.last_care(safe)
    # One clock to the pin.
    assert safe - last == period + 1, safe - last
    _check_safe(job, safe)
    assert job.probe("safety_latched") == 1 << NUMBER["watchdog"]
    if kind == "clock":
        alarm = job.alarm()
        assert "the firmware stopped calling the watchdog" in alarm["text"]
        assert job.probe("axis_z_position") == session.positions()["z"]
        _restart(job, "force.estop")
    return {"events": job.events, "clocks": safe - last}


def browned_out(session: Session, clocks: int, accepted: bool = True) -> dict:
    """The supply fails for some clocks in mid-motion: safe at once, and the position is lost.

    The memory keeps its contents. Nothing moves or burns until somebody has unlocked, pressed the
    button and accepted the position, which is done if ``accepted``: from then on the machine tells
    the place that it was given, although it is not the true one.
    """
    job = _machining(session)
    session.set("force.brown_out", 1)
    begun = session.cycle
    session.run(clocks)
    session.set("force.brown_out", 0)
    job.link.await_greeting()
    job.collect()
    safe = job.record.rises("safe", begun)[0]
    assert safe - begun == BROWN_OUT
    _check_safe(job, safe)
    counted, true = job.probe("axis_z_position"), session.positions()["z"]
    assert counted != true, "it has gone on while nobody counted"
    assert job.link.status()["state"] == "Alarm"
    for line in ("$X", str(Data()), "C100"):
        job.link.command(line)
    assert job.link.status()["state"] == "Alarm"
    stands = session.positions()["z"]
    for line in ("G00 Z1", "M03", "G01 Z1 F60"):
        with pytest.raises(RefusedError, match="the position is lost"):
            job.link.command(line)
    session.run(session.clock_hz // 10)
    assert session.positions()["z"] == stands
    if accepted:
        job.make_ready()
        job.link.command("G00 Z1")
        job.until(lambda: job.link.status()["state"] == "Idle", "the end of the motion",
                  step=10_000)
    return {"cycle": session.cycle, "counted": counted, "true": true}
