# SPDX-License-Identifier: Apache-2.0
"""Some programs of the corpus on the simulated machine: the whole path, sample by sample."""

from math import atan2, hypot, pi

import numpy as np
import pytest

from host.machines import machine as machines
from host.run import simulation
from host.run.run import Run
from host.tape.tape import load
from testbench.corpus.reference import PLANES, Move, walk
from testbench.corpus.table import PROGRAMS

SINKER = machines.load("sinker")
NEAR_MM = 3e-4      # three pulses: rounding of three axes, and what an arc may deviate
SAMPLE_S = 1e-3
SEEN_S = 5e-3       # shortest move that certainly has samples
STEADY_S = 0.1      # time after its start and before its end in which a move may lack its feed


def on_line(place, move):
    """Distance of a place from a line, and its distance along the line, mm."""
    start, end = (np.array([float(one) for one in ends]) for ends in (move.start, move.end))
    way = end - start
    whole = float(np.linalg.norm(way))
    along = float(np.clip((place - start) @ way / whole, 0, whole))
    return float(np.linalg.norm(place - start - way * along / whole)), along


def shape_of(move):
    """Of an arc: its axes with the third, its radius, angle at the start, and the way round."""
    first, second = PLANES[move.plane]
    (u, v), begin, end = move.centre, *(
        (float(at[first]), float(at[second])) for at in (move.start, move.end))
    angle = atan2(begin[1] - v, begin[0] - u)
    sweep = (atan2(end[1] - v, end[0] - u) - angle) * move.turn % (2 * pi)
    return ((first, second, 3 - first - second), hypot(begin[0] - u, begin[1] - v), angle,
            sweep if sweep > 1e-9 else 2 * pi)


def on_arc(place, move):
    """The same of an arc or helix; an end of it also counts as its other end, a turn away."""
    (first, second, third), radius, begin, sweep = shape_of(move)
    u, v = place[first] - move.centre[0], place[second] - move.centre[1]
    angle = (atan2(v, u) - begin) * move.turn % (2 * pi)
    start, rise = float(move.start[third]), float(move.end[third] - move.start[third])
    reached = [(hypot(hypot(u, v) - radius, place[third] - start - rise * one / sweep),
                one * length(move) / sweep)
               for one in (angle, angle - 2 * pi, angle + 2 * pi)
               if -NEAR_MM / radius <= one <= sweep + NEAR_MM / radius]
    return min(reached, default=(float("inf"), 0.0))


def length(move):
    if not move.turn:
        return hypot(*(float(b - a) for a, b in zip(move.start, move.end, strict=True)))
    (_, _, third), radius, _, sweep = shape_of(move)
    return hypot(radius * sweep, float(move.end[third] - move.start[third]))


def followed(places, moves):
    """Index of the move on which each place lies; they come in order, and go forwards.

    Raises
    ------
    AssertionError
        If a place is on no move, or on one that has ended before.
    """
    at, reached, found = 0, 0.0, []
    for number, place in enumerate(places):
        while True:
            assert at < len(moves), f"sample {number} at {place} is beside the path"
            off, along = (on_arc if moves[at].turn else on_line)(place, moves[at])
            if off <= NEAR_MM and along >= reached - NEAR_MM:
                break
            at, reached = at + 1, 0.0
        reached = max(reached, along)
        found.append(at)
    return np.array(found)


@pytest.mark.parametrize("name", [
    "calls_nested.nc",
    *(pytest.param(name, marks=pytest.mark.soak)
      for name in ("g30_places.nc", "arcs_helix.nc", "haas_contour.nc", "g54_to_g59.nc"))])
def test_the_machine_goes_the_way_that_the_reference_says(name):
    moves = [one for one in walk((PROGRAMS / name).read_text()) if isinstance(one, Move)]
    machine = simulation.start(SINKER, clock_hz=SINKER.clock_hz, seed=1, waves=None,
                               progress=print)
    run = Run(SINKER, load(PROGRAMS / name), machine, mdi=["G92 X0 Y0 Z0"])
    assert run.execute() == "end", run.alarm
    machine.close()
    trace = machine.trace()
    places = np.column_stack([(trace[axis] + trace[f"error_{axis}"]) / SINKER.pulses_per_mm
                              for axis in "xyz"])
    found = followed(places, moves)
    highest = 1800.0    # mm/min, of the settings
    for number, move in enumerate(moves):
        feed = float(move.feed or highest)
        seconds = length(move) / feed * 60
        samples = trace["feed"][found == number]
        if seconds > SEEN_S:
            assert len(samples) >= 0.8 * seconds / SAMPLE_S, move
        if seconds > 3 * STEADY_S and move.feed:
            edge = round(STEADY_S / SAMPLE_S)
            steady = np.mean(samples[edge:-edge])
            # On an arc the settings bound the feed so that the deviation stays allowed.
            assert steady == pytest.approx(feed, rel=0.01) or (move.turn and steady < feed), move
    end = [round(float(one) * SINKER.pulses_per_mm) for one in moves[-1].end]
    assert list(np.rint(places[-1] * SINKER.pulses_per_mm)) == end


def test_a_place_beside_the_path_is_seen():
    moves = [one for one in walk((PROGRAMS / "arcs_helix.nc").read_text())
             if isinstance(one, Move)]
    on = [[float(one) for one in moves[0].end], [-3.0, 0.0, 1.75]]
    assert list(followed(np.array(on), moves)) == [0, 1]
    for beside in ([-3.0005, 0.0, 1.75], [-3.0, 0.0, 1.7505], [3.0, 0.0, 1.9]):
        with pytest.raises(AssertionError, match="sample 1 at"):
            followed(np.array([on[0], beside]), moves)
    with pytest.raises(AssertionError, match="sample 2 at"):
        followed(np.array([*on, [1.0, 0.0, 0.0]]), moves)
