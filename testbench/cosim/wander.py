# SPDX-License-Identifier: Apache-2.0
"""Scenario: a random program with random retractions; a model predicts every axis pulse.

In the model the place of each axis is a closed function of the path coordinate alone. So the path
pulses determine the axis pulses, whatever the machine does. A pulse that is lost, made twice, or
made at different places forward and back shows at once.
"""

import math
import random
from collections import deque
from itertools import pairwise

from host.link.link import HOLD, RESUME, RETRACT, RefusedError
from host.tape.tape import encode
from rtl.states import State
from softcore.tables.settings import assign
from testbench.cosim.job import MM, Data, Job, program
from testbench.cosim.record import WATCHDOG
from testbench.firmware import Arc, Checker, Move
from testbench.models.arc import Curve
from testbench.models.distributor import steps
from testbench.native.station import Session

__all__ = ["WATCHED", "Train", "blocks", "places", "wander"]

AXES = "XYZ"
PLANES = (("G17", (0, 1), "IJ"), ("G18", (2, 0), "KI"), ("G19", (1, 2), "JK"))
COMMANDS = {f"axis_{axis}_command": index for index, axis in enumerate("xyz")}
WATCHED = ("path_position", *COMMANDS)

# Clocks from a path pulse to its axis pulse: an arc is fetched, its distributor follows, the axis
# counts.
LAG = 17
EXACT = 1e-9    # of the model's own arithmetic, pulses


# ---- programs

def _number(pulses):
    return f"{pulses / MM:.5f}"


def _size(rng, least, most):
    return math.exp(rng.uniform(math.log(least), math.log(most)))


def _line(rng, size):
    while True:
        delta = [rng.choice((0, 1, 1)) * round(rng.uniform(-1, 1) * _size(rng, 1, size))
                 for _ in range(3)]
        if any(delta):
            return rng.choice(("G00", "G01", "G01", "G01")), delta, ""


def _by_centre(rng, size):
    """End and words of an arc given by its centre, or of a full circle."""
    while True:
        radius, angle = _size(rng, 1, size), rng.uniform(0, math.tau)
        grain = rng.choice((1, 1, 2))  # half pulses, too
        centre = [round(grain * radius * part(angle)) / grain for part in (math.cos, math.sin)]
        radius = math.hypot(*centre)
        sweep = rng.choice((rng.uniform(0, math.tau), math.tau, _size(rng, 1, radius + 2) / size,
                            rng.randrange(1, 8) * math.pi / 4))
        start = math.atan2(-centre[1], -centre[0])
        end = [round(place + radius * part(start + sweep))
               for place, part in zip(centre, (math.cos, math.sin), strict=True)]
        if sweep == math.tau:
            end = [0, 0]
        elif end == [0, 0]:
            continue
        chord = math.hypot(*end) or 2 * radius
        off = abs(math.dist(end, centre) - radius)
        if radius >= 1 and math.dist(end, centre) >= 1 and off <= min(10, chord / 20, radius / 20):
            return end, centre


def _arc(rng, size):
    code, plane, letters = rng.choice(PLANES)
    delta = [0, 0, 0]
    if rng.random() < 0.3:
        end = [0, 0]
        while math.hypot(*end) < 2:
            end = [round(rng.uniform(-1, 1) * _size(rng, 2, size)) for _ in plane]
        least = math.ceil(math.hypot(*end) / 2)
        radius = least + round(rng.choice((0, 0.01, 1, 5)) * least * rng.random())
        words = f"R{_number(rng.choice((1, -1)) * radius)}"
    else:
        end, centre = _by_centre(rng, size)
        words = " ".join(f"{letter}{_number(place)}"
                         for letter, place in zip(letters, centre, strict=True))
    for axis, travel in zip(plane, end, strict=True):
        delta[axis] = travel
    if rng.random() < 0.3:
        delta[3 - sum(plane)] = round(rng.uniform(-1, 1) * _size(rng, 1, size))
    return f"{code} {rng.choice(('G02', 'G03'))}", delta, words


def _data(rng, size):
    limit = round(_size(rng, 0.005, size / MM * 2), 4)
    return Data(speed=round(_size(rng, 120, 1800)), high=round(_size(rng, 300, 1800)),
                low=round(_size(rng, 120, 600)), limit=limit,
                changeover=round(limit * rng.random(), 4))


def blocks(rng: random.Random, count: int, size: float) -> tuple[list[str | Data], list[int]]:
    """Blocks with ``count`` moves of up to about ``size`` pulses, and the place of their end.

    Lines and arcs of every kind, in pulses of the machine's frame from where it stands.
    """
    made, at = [_data(rng, size), "G92 X0 Y0 Z0"], [0, 0, 0]
    for _ in range(count):
        if rng.random() < 0.1:
            made.append(_data(rng, size))
        code, delta, words = rng.choice((_line, _arc, _arc))(rng, size)
        at = [a + b for a, b in zip(at, delta, strict=True)]
        absolute = rng.random() < 0.3
        axes = [f"{letter}{_number(end)}" for letter, end, travel
                in zip(AXES, at if absolute else delta, delta, strict=True) if travel]
        made.append(" ".join([f"G{90 if absolute else 91}", code, *axes, words,
                              f"F{round(_size(rng, 200, 1800))}"]))
    return made, at


# ---- the model

def _line_places(delta):
    length = math.floor(math.hypot(*delta) + 0.5)
    return [tuple(steps(count, length, travel) for travel in delta)
            for count in range(1, length + 1)]


def _arc_places(motion):
    """Places along an arc; every one of them is checked to lie next to the curve."""
    arc = Arc(Move(motion.delta, True, motion.arc > 0, motion.plane, motion.centre))
    axes = PLANES[motion.plane][1]
    curve = Curve([motion.delta[axis] for axis in axes], tuple(motion.centre), ccw=motion.arc > 0)
    turn = curve.sweep / arc.length
    found, near, start = [], 0, (0, 0, 0)
    for index in range(arc.pieces):
        before, piece = arc.piece(index)
        assert before == len(found)
        bound = curve.bound(piece, axes, start, before * turn, turn) + EXACT
        for travel in piece.walk():
            at = tuple(a + b for a, b in zip(start, travel, strict=True))
            found.append(at)
            flat = tuple(at[axis] for axis in axes)
            near = curve.swept(flat, near + turn)
            assert curve.distance(flat, near) <= bound, (at, list(motion.delta))
        start = found[-1]
    assert len(found) == arc.length
    assert start == tuple(motion.delta)
    return found


def places(tape: bytes, *, above: int = 0) -> list[tuple[int, int, int]]:
    """Place of the axes by path coordinate, from 0, of the moves of a tape.

    ``above`` says how high over its zero the machine stands at the start, pulses.
    """
    checker = Checker()
    if above:
        checker.enter(f"G92 Z{_number(above)}")
    moves = checker.motions(tape)
    assert isinstance(moves, list), moves
    found = [(0, 0, 0)]
    for motion in moves:
        way = _arc_places(motion) if motion.arc else _line_places(motion.delta)
        x, y, z = found[-1]
        found += [(x + a, y + b, z + c) for a, b, c in way]
    return found


class Train:
    """Compares the axis pulses that come with those that follow from the path pulses.

    ``pulses`` and ``backward`` count path pulses, ``turns`` changes of their direction, ``lag`` is
    the longest time in clocks from a path pulse to its axis pulse.

    Raises
    ------
    AssertionError
        If the path jumps, or an axis pulse is missing, late, or not in the model.
    """

    def __init__(self, way: list[tuple[int, int, int]]):
        self.way = way
        self.pulses = self.backward = self.turns = self.lag = 0
        self._at: int | None = None
        self._ahead = True
        self._seen: set[int] = set()
        self._due = [deque(), deque(), deque()]

    def place(self, coordinate: int) -> tuple[int, int, int]:
        """Place of the axes; before the path's first point they go up the jump axis."""
        return self.way[coordinate] if coordinate >= 0 else (0, 0, -coordinate)

    def take(self, changes: list[tuple[int, str, int]]) -> None:
        """Go on with the changes of ``WATCHED``."""
        for clock, name, value in changes:
            axis = COMMANDS.get(name)
            if axis is None:
                self._path(clock, value)
            elif axis not in self._seen:
                self._seen.add(axis)  # as it stands when the watch begins
                assert value == 0
            else:
                assert self._due[axis], f"{name} {value} in clock {clock} is one pulse too many"
                since, due = self._due[axis].popleft()
                self.lag = max(self.lag, clock - since)
                assert value == due, (
                    f"{name} in clock {clock}: {value}, not {due}; path coordinate {self._at}")
                assert clock - since <= LAG, (
                    f"{name} {value} in clock {clock}, {clock - since} clocks after the path pulse")

    def _path(self, clock, coordinate):
        if self._at is None:
            self._at = coordinate
            assert coordinate == 0
            return
        assert abs(coordinate - self._at) == 1, f"the path jumps to {coordinate}, clock {clock}"
        before, now = self.place(self._at), self.place(coordinate)
        for axis in range(3):
            if before[axis] != now[axis]:
                self._due[axis].append((clock, now[axis]))
        ahead = coordinate > self._at
        self.pulses += 1
        self.backward += not ahead
        self.turns += ahead != self._ahead
        self._ahead = ahead
        self._at = coordinate

    def settled(self) -> bool:
        """Check that every axis pulse that was due has come."""
        return not any(self._due)


# ---- the scenario

def _take(job, train):
    """Go on with what the job's controller has done, and record the calls of the watchdog."""
    changes = job.session.changes()
    train.take([change for change in changes if change[1] in WATCHED])
    job.record.extend([change for change in changes if change[1] in WATCHDOG])


class _Operator:
    """Shorts and buttons at random moments, all along a run."""

    def __init__(self, job, rng, train):
        self.job, self.rng, self.train = job, rng, train

    def _over(self):
        return self.job.told("program_end") or self.job.told("alarm")

    def _run(self, most):
        """A random number of clocks; small and large ones are equally likely."""
        end = self.job.session.cycle + round(_size(self.rng, 1, most))
        while self.job.session.cycle < end and not self._over():
            self.job.run(min(20_000, end - self.job.session.cycle))
            _take(self.job, self.train)

    def _state(self):
        return State(self.job.probe("path_status_state"))

    def _at_rest(self):
        """Wait for the machine to stop, and check its place."""
        job, before = self.job, None
        while before != (before := job.probe("path_position")):
            job.run(4000)
            _take(job, self.train)
        assert self.train.settled()
        stands = tuple(job.probe(name) for name in COMMANDS)
        assert stands == self.train.place(before), (before, stands)

    def _short(self):
        """A short, sometimes long enough to reach the limit."""
        self.job.short(True)
        for _ in range(self.rng.randrange(1, 8)):
            self._run(20_000)
            if self._state() is State.AT_LIMIT:
                self._at_rest()
                break
        self.job.short(False)

    def _hold(self):
        self.job.press(HOLD)
        # At once, or when the machine has stopped.
        if self._state() is State.FRONT and self.rng.random() < 0.5:
            self._at_rest()
        else:
            self._run(30_000)
        if self.rng.random() < 0.3:
            self.job.press(RETRACT)
            self._run(30_000)
        self._resume()

    def _resume(self):
        """Repeat an order until it is accepted: it is refused if a hold comes at the same time."""
        while True:
            try:
                self.job.link.command(RESUME)
                return
            except RefusedError as error:
                if "a hold came at the same time" not in error.reason:
                    raise

    def work(self, troubles, most):
        """Run to the end, with ``troubles`` disturbances at most ``most`` clocks apart."""
        for _ in range(troubles):
            self._run(most)
            if self._over():
                return
            self.rng.choice((self._short, self._short, self._hold,
                             lambda: self.job.press(RETRACT)))()
            # Sometimes the next one comes during the way forward, sometimes at the front.
            if self.rng.random() < 0.5:
                continue
            while not self._over() and self._state() is not State.FRONT:
                self._run(5000)
        while not self._over():
            self._run(100_000)


def wander(session: Session, program_seed: int, count: int = 8, size: float = 600,
           troubles: int = 16, quiet: int = 50_000) -> dict:
    """Run a random program through random shorts, retractions and holds, to its target.

    Parameters
    ----------
    session : Session
        The controller, just switched on.
    program_seed : int
        Seed of program and disturbances.
    count, size
        Moves of the program, and their size in pulses.
    troubles, quiet : int
        Number of disturbances, and the longest time between two, in clocks.

    Returns
    -------
    dict
        ``pulses``, ``backward``, ``turns``, ``lag``: see ``Train``; ``retractions``, ``cycle``.
    """
    rng = random.Random(program_seed)
    made, target = blocks(rng, count, size)
    tape = encode(program(*made))
    train = Train(places(tape.rows))
    assert train.way[-1] == tuple(target)
    # No short burst is too long, and a short may stand at the limit for a while.
    job = Job(session, assign("repeats", 0), assign("settle_us", 300_000),
              watched=(*WATCHED, *WATCHDOG))
    job.start(tape)
    job.wait("retraction_set")
    _take(job, train)
    _Operator(job, rng, train).work(troubles, quiet)
    assert not job.told("alarm"), job.told("alarm")
    job.run(2000)
    _take(job, train)
    job.record.watched_well(session.clock_hz)
    assert train.settled()
    assert job.probe("path_position") == len(train.way) - 1
    assert [job.probe(name) for name in COMMANDS] == target
    for axis, place in zip("xyz", target, strict=True):
        assert abs(session.positions()[axis] - place) <= 1
    assert train.pulses - 2 * train.backward == len(train.way) - 1
    starts = [event["cycle"] for event in job.told("retraction_start")]
    assert all(a < b for a, b in pairwise(starts))
    return {"pulses": train.pulses, "backward": train.backward, "turns": train.turns,
            "lag": train.lag, "retractions": len(starts), "cycle": session.cycle}
