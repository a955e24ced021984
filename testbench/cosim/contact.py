# SPDX-License-Identifier: Apache-2.0
"""Scenarios: the electrode meets the work while the discharge is off."""

import copy
import math

from host.machines import machine as machines
from rtl.states import State
from softcore.tables.causes import numbers
from softcore.tables.faults import alarm_number
from softcore.tables.settings import named
from testbench.cosim.job import PATIENCE_S, Data, Job, program
from testbench.native.station import Session

__all__ = ["WAYS", "bridged", "out_again", "touches", "with_hole"]

WATCHED = ("pp", "completed", "ramp_above", "path_status_state", "path_position", "gap_on",
           "gap_sense", "safe", "retraction_control_run")
CONTACT, TRIP = alarm_number("contact"), alarm_number("trip")
CONTACT_BIT = numbers()["contact"]

START_MM_S = 10         # start/stop speed
DRIVE_S = 4e-3          # lag of a drive: filter, current loop and speed loop
SENSED_UM = 4           # way from the touch to the last pulse, at that speed
BRAKE_MM_S2 = 8000      # of a drive that is disabled
BEYOND_UM = 50          # ... and so much more
REST_S = 0.15           # until the axes stand
REACTION = 8            # clocks from the completing sample to the last forward pulse
FEED_UP = 600           # mm/min: up to here the feed is at or below the start/stop speed

# Blocks of a program that was not written for this controller, and its highest speed.
WAYS = {
    "feed": ("G01 Z-0.5 F120", 120),
    "rapid": ("G00 Z-0.5", 1800),
    "arc": ("G18 G03 X0.4 Z-0.1 R2 F300", 300),
    # Pulses that the ramp has stored on the way down leave at the speed at which new ones come.
    "after_rapid": ("G00 Z1.3\nG01 Z-0.5 F600", 600),
    # When the command has ended, the axis is still half a millimetre short of it.
    "tail": ("G00 Z1\nG00 Z-0.1", 1800),
}


def with_hole(hole_mm: float) -> dict:
    """Tables of the wire machine, its wire in the middle of a hole."""
    tables = copy.deepcopy(machines.load("wire").tables)
    tables["stock"] |= {"edge_mm": -10.0, "hole_mm": hole_mm}
    return tables


def _lag_um():
    """How far the axes go on behind a command that ends at the start/stop speed.

    By as much as they are behind in the loop as delivered, and with its feed-forward, which ends at
    once, by the lag of the drive.
    """
    share = named("feed_forward").default / 100
    behind = (1 - share) / named("loop_gain").default
    return START_MM_S * 1000 * (behind + share * DRIVE_S) + SENSED_UM


def _begin(session, *lines):
    """A controller with the gap of the simulated machine, not a forced one."""
    job = Job(session, *lines, watched=WATCHED)
    session.set("force.short", -1)
    session.set("force.gap_um", math.nan)
    return job


def _tape(*blocks):
    return "\n".join(["%", "G21 G90 G94", *blocks, "M02", "%", ""])


def _pressed_um(session, hole_mm):
    """Depth of the electrode in the work; of a wire, in the wall of the hole around its start."""
    if not hole_mm:
        return -session.get("read.gap_um")
    places = session.positions()
    free_mm = (hole_mm - session.get("wire.diameter_mm")) / 2
    return math.hypot(places["x"], places["y"]) / 10 - 1000 * free_mm


def _to_rest(job, hole_mm):
    """Run until the axes stand; the deepest that the electrode was in the work meanwhile."""
    deepest = -math.inf
    for _ in range(round(REST_S * 1000)):
        job.run(job.session.clock_hz // 1000)
        deepest = max(deepest, _pressed_um(job.session, hole_mm))
    return deepest


def _check_sensing(job, record, since):
    """No main pulse at all; sensing pulses only from the first motion on, and none at the end."""
    assert not record.rises("gap_on")
    pulses = record.rises("gap_sense")
    assert pulses[0] > record.rises("retraction_control_run")[0]
    assert pulses[-1] <= since
    job.run(20_000)
    assert job.collect().rises("gap_sense")[-1] == pulses[-1]


def touches(session: Session, blocks: str, highest: float, *, by_hand: bool = False,
            delay: int = 0, hole_mm: float = 0, seconds: float = PATIENCE_S) -> dict:
    """A motion into the work, entered by hand or on a tape, at ``highest`` mm/min at most.

    It must touch within ``seconds``.

    At or below the start/stop speed the machine halts, above it trips. In both cases the electrode
    goes no further in than stopping takes, and no program end is reported.
    """
    job = _begin(session)
    job.run(delay)
    lines = blocks.split("\n")
    if by_hand:
        for line in ("G21 G90", *lines):
            job.link.command(line)
    else:
        job.start(_tape(*lines))
    alarm = job.alarm(seconds)
    pressed = _to_rest(job, hole_mm)
    record = job.collect()
    sample = record.rises("completed")[-1] - 1
    forward = record.rises("pp", sample)
    last = forward[-1] - sample if forward else 0
    assert not job.told("program_end")
    assert not job.probe("power_control_machining")
    assert alarm["line"] == (0 if by_hand else 2 + len(lines))
    if alarm["code"] == CONTACT:
        assert not record.at("ramp_above", sample)
        assert "contact with the discharge off" in alarm["text"]
        assert record.at("path_status_state", session.cycle) == State.HALTED.value
        assert not job.probe("safety_status_safe")
        assert last <= REACTION, last
        assert pressed <= _lag_um(), pressed
        _check_sensing(job, record, sample + REACTION)
    else:
        assert (alarm["code"], highest > FEED_UP) == (TRIP, True), alarm
        assert "touched the work with the discharge off" in alarm["text"]
        assert "the position is kept" in alarm["text"]
        assert job.probe("safety_latched") == 1 << CONTACT_BIT
        braking = (highest / 60)**2 / (2 * BRAKE_MM_S2) * 1000
        assert pressed <= braking + BEYOND_UM, pressed
        _check_sensing(job, record, record.rises("safe")[-1])
    # Every edge on the way to rest was counted.
    for axis, place in session.positions().items():
        assert job.probe(f"axis_{axis}_position") == place
    return {"code": alarm["code"], "clocks": last, "pressed_um": round(pressed, 3)}


def out_again(session: Session) -> dict:
    """After contact and ``$X`` the electrode still touches: only a motion out of the work runs."""
    job = _begin(session)
    job.start(_tape("G01 Z-0.5 F60"))
    job.alarm()
    job.run(round(REST_S * session.clock_hz))
    where = session.positions()["z"]
    moved = []
    for number, line in enumerate(("G91 G01 Z-0.1 F60", "G00 X1", "G01 Y-2 Z0.1 F600"), 2):
        job.link.command("$X")
        before = len(job.collect().rises("pp"))
        job.link.command(line)
        job.wait("alarm", number)
        assert job.told("alarm")[-1]["code"] == CONTACT
        job.run(100_000)
        moved.append(len(job.collect().rises("pp")) - before)
    assert moved == [0, 0, 0], "not a pulse into what touches"
    job.link.command("$X")
    job.link.command("G91 G00 X0.2 Z2")
    job.until(lambda: session.positions()["z"] >= where + 19_990, "the way out", step=2000)
    assert len(job.told("alarm")) == 4
    # In force again from where the gap has opened: down at the side is into the work once more.
    job.run(400_000)
    assert not session.get("read.bridged")
    job.link.command("G00 Z-3")
    job.wait("alarm", 5)
    assert job.told("alarm")[-1]["code"] == TRIP
    return {"events": job.events, "cycle": session.cycle}


def bridged(session: Session) -> dict:
    """A tape that ends ``M05``, ``G00 Z5`` with a bridge in the gap goes up without an alarm."""
    job = Job(session, watched=WATCHED)
    job.start(program(Data(), "G01 Z0.05 F120", "M05", "G00 Z5"))
    job.until(lambda: job.told("aux", letter="M", code=5), "the end of the cut", step=200)
    job.short(True)
    job.until(lambda: session.positions()["z"] > 4000, "half a millimetre of bridge", step=2000)
    assert job.probe("gap_status_shorted")
    job.short(False)
    job.finish()
    assert job.probe("axis_z_command") == 49_000
    return {"events": job.events, "cycle": session.cycle}
