# SPDX-License-Identifier: Apache-2.0
"""Coders that fail: in every situation of the machine, on every axis, with default settings.

A run with the fault is compared with the same run without it: the axis' greatest deviation until
the drives are off, and the distance that it coasts then. A situation is reached once, and every
fault is tried on a copy of it.
"""

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from functools import partial

from host.link.link import HOLD, RESUME
from rtl.states import State
from softcore.tables.faults import alarm_number
from softcore.tables.states import CHECKS
from testbench.cosim.job import Data, Job, program
from testbench.native.branch import branch
from testbench.native.station import AXES, Session

__all__ = ["DEVIATION_UM", "FAULTS", "SITUATIONS", "Outcome", "Situation", "course", "courses",
           "judge", "jump_between_edges"]

DEVIATION_UM = 300      # allowed until the drives are off
STEP_S = 5e-4           # between two looks at the axes
AT_REST = 4             # looks
TRIPPED = alarm_number("trip")
TOLD_S = 0.02           # time within which an alarm must come
BRAKE_MM_S2 = 8000      # deceleration of a drive that is off
GAIN_MM_S = 3           # greatest increase of speed between two looks: 5 m/s2
DATA = Data(speed=900, limit=0.5, high=900, low=120, changeover=0.1)

# Fault: its forces, and the allowed messages. A phase that gets stuck at its present level changes
# nothing at first; one that jumps together with the other phase is an illegal transition.
ILLEGAL = "illegal transition"
SILENT, A, B = "both phases are silent", "phase A is silent", "phase B is silent"
WRONG = tuple(check.text for check in CHECKS if check.name in ("against", "share", "model"))
FAULTS = {
    "cut": (("cut",), (SILENT,)),
    "open": (("open",), (SILENT, ILLEGAL)),
    "a_low": (("a_low",), (A, ILLEGAL)),
    "a_high": (("a_high",), (A, ILLEGAL)),
    "b_low": (("b_low",), (B, ILLEGAL)),
    "b_high": (("b_high",), (B, ILLEGAL)),
    "both_low": (("a_low", "b_low"), (SILENT, ILLEGAL)),
    "both_high": (("a_high", "b_high"), (SILENT, ILLEGAL)),
    "swap": (("swap",), (*WRONG, ILLEGAL)),
    "a_noise": (("a_noise",), (*WRONG, A, ILLEGAL)),
}


@dataclass(frozen=True)
class Situation:
    """Situation of the machine when the coder fails: ``reach`` gets there, ``then`` goes on.

    ``then`` also gets the block. It takes the same time with and without the fault, unless the
    alarm comes before.
    """

    feed: float                                     # mm/min, of the block
    reach: Callable[[Job], None]
    then: Callable[[Job, str], None] = lambda job, way: None
    seconds: float = 0.15                           # until which the axis must have stopped
    rapid: bool = False
    held: bool = False                              # at rest, on hold
    jumps: bool = False                             # every 40 ms of machining


@dataclass
class Outcome:
    """True places of the axes, in pulses, at each look; and the trip."""

    looks: list = field(default_factory=list)       # clock, places and speeds by axis
    safe: int | None = None                         # clock
    alarm: dict | None = None


def _in_motion(job, pulses=2000):
    job.until(lambda: job.probe("path_position") >= pulses, "motion", step=256)
    job.run(round(0.05 * job.session.clock_hz))


def _creeping(job):
    job.until(lambda: job.probe("path_position") >= 20, "motion", step=256, seconds=8)


def _at_rest(job):
    job.run(round(0.3 * job.session.clock_hz))


def _go(job, way):
    job.press(RESUME)


def _set_out_again(job, way):
    """Unlock after the alarm of a permanent short, and go on by hand with the discharge off."""
    job.run(round(TOLD_S * job.session.clock_hz))
    if job.probe("safe"):
        return  # it was found at rest
    job.short(False)
    job.press("$X")
    job.press(way)


def _in_state(state, clocks=0.002):
    def reach(job):
        _in_motion(job, pulses=7000)  # further than the limit
        job.short(True)
        if state in (State.HIGH, State.LOW):
            job.until(lambda: job.probe("path_status_state") == State.AT_LIMIT.value, "the limit")
            job.short(False)
        job.until(lambda: job.probe("path_status_state") == state.value, state.name)
        job.run(round(clocks * job.session.clock_hz))
    return reach


def _halted(job):
    _in_motion(job)
    job.short(True)
    job.wait("alarm")
    job.run(round(TOLD_S * job.session.clock_hz))
    assert job.probe("path_status_state") == State.HALTED.value


def _in_jump(state):
    def reach(job):
        _in_motion(job, pulses=6000)  # further than a jump goes
        for wanted in (State.FRONT, state):
            job.until(lambda wanted=wanted: job.probe("path_status_state") == wanted.value,
                      f"{state.name} of a jump")
        job.run(round(0.01 * job.session.clock_hz))
        assert job.probe("path_status_state") == state.value
    return reach


def _hold(job):
    _in_motion(job)
    job.press(HOLD)


SITUATIONS = {
    "rest, then F12": Situation(12, _at_rest, _go, seconds=0.3, held=True),
    "rest, then G00": Situation(900, _at_rest, _go, rapid=True, held=True),
    "F1": Situation(1, _creeping, seconds=1.5),
    "F12": Situation(12, _creeping),
    "F60": Situation(60, _in_motion),
    "F300": Situation(300, _in_motion),
    "F1200": Situation(1200, _in_motion),
    "G00": Situation(900, _in_motion, rapid=True),
    "hold": Situation(120, _hold),
    "stopping": Situation(900, _in_state(State.STOPPING, 0.0)),
    "retracting": Situation(300, _in_state(State.RETRACTING)),
    "at limit": Situation(300, _in_state(State.AT_LIMIT, 0.0)),
    "high": Situation(300, _in_state(State.HIGH)),
    "low": Situation(300, _in_state(State.LOW)),
    "halted, then F300": Situation(300, _halted, _set_out_again, seconds=0.25),
    "jump": Situation(600, _in_jump(State.RETRACTING), jumps=True),
    "jump, forward": Situation(600, _in_jump(State.HIGH), jumps=True),
}


def jump_between_edges(session: Session) -> int:
    """Invert both phases of Z, which moves, at some distance from the true edges; its clock.

    Within three clocks of a true edge it would look like one edge the other way.
    """
    place = session.positions()["z"]
    while session.positions()["z"] == place:
        session.run(1)
    session.run(10)
    begun = session.cycle
    session.set("force.encoder_jump", 4)
    return begun


def _block(situation, axis, highest):
    return f"G00 {axis.upper()}-2" if situation.rapid else (
        f"G01 {axis.upper()}-2 F{min(situation.feed, highest):g}")


def _reach(session, situation, axis, condition, highest):
    """Go to a situation along an axis."""
    job = Job(session, watched=("safe",))
    if situation.held:
        job.press(HOLD)
    jumps = [f"G38 P40 L0.5 R{highest:g} H{highest:g}"] if situation.jumps else []
    job.start(program(DATA, *jumps, _block(situation, axis, highest), condition=condition))
    situation.reach(job)
    return job


def _follow(job, situation, axis, way, fault):
    """Let the coder fail, and run until the alarm and rest; without a fault, to the end."""
    session = job.session
    outcome, begun = Outcome(), session.cycle
    alarms, said = len(job.told("alarm")), len(job.said)
    for force in FAULTS[fault][0] if fault else ():
        session.set(f"force.encoder_{force}", 1 << AXES.index(axis))

    def look():
        outcome.looks.append((
            session.cycle, [session.get(f"read.{one}_pulses") for one in AXES],
            [session.get(f"read.{one}_speed_mm_s") for one in AXES]))

    def told():
        """The alarm; a message with its text where one stands already."""
        messages = [line for line in job.said[said:] if "interlock:" in line]
        return next(iter([*job.told("alarm")[alarms:],
                          *({"code": TRIPPED, "text": line} for line in messages)]), None)

    def over():
        return told() and not any(any(speeds) for _, _, speeds in outcome.looks[-AT_REST:])

    look()
    situation.then(job, way)
    step = round(STEP_S * session.clock_hz)
    while session.cycle < begun + round(situation.seconds * session.clock_hz) and not over():
        job.run(step - (session.cycle - begun) % step)
        look()
    trips = job.collect().rises("safe", begun)
    outcome.safe = trips[0] if trips else None
    outcome.alarm = told()
    return outcome, begun


def course(session: Session, name: str, axis: str, fault: str = "", condition: int = 100,
           highest: float = 1800) -> tuple[Outcome, int]:
    """Go to a situation along an axis, let its coder fail, go on; return the clock of the fault."""
    situation = SITUATIONS[name]
    job = _reach(session, situation, axis, condition, highest)
    return _follow(job, situation, axis, _block(situation, axis, highest), fault)


def courses(session: Session, name: str, axis: str, faults: Iterable[str], condition: int = 100,
            highest: float = 1800) -> tuple[dict[str, Outcome], int]:
    """Do this with each fault, and with none (``""``), all from the same clock on."""
    situation = SITUATIONS[name]
    job = _reach(session, situation, axis, condition, highest)
    begun = session.cycle
    way = _block(situation, axis, highest)

    def tried(fault):
        return asdict(_follow(job, situation, axis, way, fault)[0])

    return {fault: Outcome(**branch(partial(tried, fault))) for fault in ("", *faults)}, begun


def judge(name: str, axis: str, fault: str, found: Outcome, healthy: Outcome, begun: int,
          clock_hz: int) -> dict:
    """Check an outcome against the same run without the fault; its figures.

    Raises
    ------
    AssertionError
        If the fault was not found, not named, or found too late.
    """
    what = f"{fault} at {name}, axis {axis}"
    assert healthy.safe is None, f"{name}: a sound coder has tripped: {healthy.alarm}"
    assert found.safe is not None, f"{what}: not found"
    assert found.alarm, f"{what}: no alarm"
    text = found.alarm["text"]
    assert found.alarm["code"] == TRIPPED
    assert f"axis {axis.upper()}" in text, f"{what}: {text}"
    assert any(words in text for words in FAULTS[fault][1]), f"{what}: {text}"
    assert "the position is lost" in text, text
    index = AXES.index(axis)
    there = {clock: places for clock, places, _ in healthy.looks}
    away = max(abs(places[index] - there[clock][index]) / 10
               for clock, places, _ in found.looks if clock <= found.safe)
    assert away <= DEVIATION_UM, f"{what}: {away:.0f} um off"
    # On from the last look before the drives were off, and to a stop.
    clock, places, speeds = [one for one in found.looks if one[0] <= found.safe][-1]
    speed = abs(speeds[index]) + GAIN_MM_S
    coast = abs(found.looks[-1][1][index] - places[index]) / 10
    allowed = (speed**2 / 2 / BRAKE_MM_S2 + speed * (found.safe - clock) / clock_hz) * 1000
    assert coast <= allowed, f"{what}: {coast:.0f} um of coast, {allowed:.0f} allowed"
    assert found.looks[-1][2][index] == 0
    return {"away_um": away, "coast_um": coast, "ms": (found.safe - begun) / clock_hz * 1e3,
            "text": text}
