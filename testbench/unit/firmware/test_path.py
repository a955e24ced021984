# SPDX-License-Identifier: Apache-2.0
"""The path that the firmware remembers, and the window of it that the gateware holds."""

import ctypes
import math
from itertools import pairwise

import pytest

from softcore.tables.faults import alarm_number
from softcore.tables.settings import assign, named
from testbench.firmware import Arc, Controller, Move, events
from testbench.models.arc import Piece
from testbench.programs import punched
from testbench.travel import DATA, go, load

RING = 8192     # units remembered: a line each
SLOTS = 64
PLANES = ((0, 1), (2, 0), (1, 2))
NEAR, FAR = 15, 48
LAG_S = 4.096e-3    # of a drive in the controller's model of it
DEVIATION_UM = named("arc_deviation_nm").default / 1000


def test_segment_is_as_long_as_its_line(machine, rng):
    """N is the distance rounded to whole pulses: the coordinate at the end counts them."""
    moves = [[rng.randint(-30000, 30000) for _ in range(3)] for _ in range(8)]
    load(machine, "G91 G01 F60", *("X{:.4f} Y{:.4f} Z{:.4f}".format(*(d / 10_000 for d in move))
                                   for move in moves), "M02")
    total = 0
    for move in moves:
        exact = math.hypot(*move)
        length = math.floor(exact + 0.5)
        total += length
    assert machine.bound("ahead") == total


def test_way_back_is_the_way_that_was_come(machine, rng):
    """Over borders of blocks and windows, to the pulse, and forward again."""
    blocks = [f"X.0{rng.randint(1, 9)} Y-.00{rng.randint(0, 9)}" for _ in range(60)]
    load(machine, "G91 G01 F60", *blocks, "M02", limit=50)
    trail = {0: machine.axes}

    def walk(step, end):
        while machine.library.gk_position() != end:
            assert machine.library.gk_go(step) == step
            position = machine.library.gk_position()
            assert machine.axes == trail.setdefault(position, machine.axes)
            if position % 3 == 0:
                machine.run(8)

    while machine.library.gk_position() < 25_000 and machine.library.gk_go(1):
        trail[machine.library.gk_position()] = machine.axes
        machine.run(8)
    front = machine.library.gk_position()
    assert front > 15_000
    machine.state("retracting")
    machine.run(40)
    walk(-1, 0)
    machine.state("high")
    machine.run(40)
    walk(1, front)


@pytest.mark.parametrize("creep", [-99, -9, 9, 99])
def test_window_moves_under_a_moving_machine(machine, rng, creep):
    """Slots that the gateware may use next are never overwritten, however the machine turns."""
    program = Program(machine, [line(rng.randint(1, 9), 0, -rng.randint(0, 2))
                                for _ in range(240)])
    trail = {0: machine.axes}
    while not program.done:
        program.feed()
        while machine.library.gk_go(1):
            trail[machine.library.gk_position()] = machine.axes
    front = machine.library.gk_position()
    machine.library.gk_creep(creep)
    for _ in range(400):
        back = rng.random() < 0.5
        machine.state("retracting" if back else "low")
        machine.library.gk_go(-rng.randint(1, 600) if back else
                              min(rng.randint(1, 600), front - machine.library.gk_position()))
        assert machine.axes == trail.setdefault(machine.library.gk_position(), machine.axes)
        machine.run(rng.randint(1, 9))
        assert machine.axes == trail.setdefault(machine.library.gk_position(), machine.axes)


def test_window_holds_what_is_commanded(machine):
    """The machine turns and is commanded back (or ahead) while firmware still loads the other side.

    It goes as far as the bound in force: the segments up to there must not be overwritten.
    """
    program = Program(machine, [line(5, 0, 0)] * 240)
    while not program.done:
        program.feed()
        machine.library.gk_go(5)
        machine.run(8)
    machine.state("retracting")
    go(machine, -700)
    for way, state, bound in ((10, "low", "behind"), (-10, "retracting", "ahead")):
        machine.state(state)
        go(machine, way * 10)
        machine.run(400)
        limit = machine.bound(bound)
        machine.library.gk_go(way)
        machine.library.gk_stored(limit - machine.library.gk_position())
        machine.run(400)
        assert machine.bound(bound) == limit
        machine.library.gk_stored(0)
        machine.run(400)
        assert machine.bound(bound) == limit + way


def test_window_covers_both_sides(machine):
    load(machine, "G91 G01 F60", *(["X.01"] * 120), "M02")
    for _ in range(50):
        go(machine, 100, passes=40)
    at = machine.library.gk_position() // 100
    machine.run(200)
    ahead, behind = machine.bound("ahead") // 100, machine.bound("behind") // 100
    assert at - behind >= NEAR
    assert ahead - at >= FAR
    assert ahead - behind == SLOTS
    machine.state("retracting")
    machine.run(200)
    ahead, behind = machine.bound("ahead") // 100, machine.bound("behind") // 100
    assert at - behind >= FAR - 1
    assert ahead - at >= NEAR


def test_before_the_first_point_lies_the_way_up_to_the_soft_limit(machine):
    machine.line(assign("soft_limit_um", 3000))
    machine.line("G00 Z1")
    load(machine, "G01 X1 F60", "M02")
    assert machine.bound("behind") == machine.bound("back_limit") == -20_000
    go(machine, 500)
    machine.state("retracting")
    assert go(machine, -999_999) == -20_500
    assert machine.axes == (0, 0, 30_000)


def test_path_of_a_wire_begins_at_its_first_point():
    machine = Controller(jump_axis=15)
    machine.unlock()
    load(machine, "G01 X1 F60", "M02")
    go(machine, 500)
    machine.state("retracting")
    assert go(machine, -999_999) == -500
    machine.event("retraction_end", 3, 10, 100)
    assert events(machine.run(400), "back")[0][1] == "p"


def test_corners_bound_the_fast_motion(machine):
    machine.line(assign("corner_deviation_nm", 0))
    load(machine, "G91 G01 F60", "X1", "X1 Y.01", "Y1", "X-1", "Y.5", "M02")
    assert machine.bound("fast_behind") == 0, "the first point is a corner to the way up"
    junctions = [10_000, 20_000]
    assert machine.bound("fast_ahead") == junctions[1], "a bend of half a degree is none"
    go(machine, 20_500)
    assert machine.bound("fast_behind") == 20_000
    assert machine.bound("fast_ahead") == 30_000


def test_lower_feed_ahead_bounds_the_fast_motion(machine):
    load(machine, "G91 G00 X1", "G01 X1 F60", "X1 F50", "G00 X1", "M02")
    assert machine.bound("fast_ahead") == 10_000
    go(machine, 10_500)
    # Below the start/stop speed every change of speed is immediate.
    assert machine.bound("fast_ahead") == 40_000


def test_oldest_blocks_are_forgotten_only_beyond_the_limit(machine):
    count = RING + 100
    machine.library.gk_speed(37)
    machine.tape(punched([DATA.format(limit=1, more=""), "G91 G01 F60", *["X.01"] * count, "M02"]))
    assert machine.library.gk_position() == count * 100
    machine.state("retracting")
    back = -go(machine, -999_999, passes=40)
    assert 10_000 + 10 <= back < (RING + 1) * 100


@pytest.mark.parametrize("limit", [100, (RING - 2) / 100, (RING - 2) / 100 - 0.0009])
def test_limit_that_the_memory_cannot_cover_is_an_alarm_beforehand(machine, limit):
    """A short burst goes on as long as the front is less than its gain beyond where it began."""
    blocks = ["X.01"] * (RING + 100)
    machine.library.gk_speed(1 << 30)
    machine.tape(punched([DATA.format(limit=limit, more=""), "G91 G01 F60", *blocks, "M02"]),
                 passes=20_000)
    alarm = events(machine.lines, "alarm")[0]
    assert alarm[1] == str(alarm_number("history"))
    assert "limit" in alarm[2]
    # One unit is kept free for an arc, the virtual block before the first point takes another.
    assert machine.axes[0] == (RING - 2) * 100


def test_limit_that_the_memory_just_covers_with_the_gain(machine):
    blocks = ["X.01"] * (RING + 100)
    machine.library.gk_speed(1 << 30)
    machine.tape(punched([DATA.format(limit=(RING - 2) / 100 - 0.001, more=""), "G91 G01 F60",
                          *blocks, "M02"]), passes=20_000)
    assert not events(machine.lines, "alarm")


def test_new_path_begins_with_every_tape(machine):
    load(machine, "G01 X.1 F60", "M02")
    go(machine, 1000)
    machine.run(400)
    assert events(machine.lines, "end")
    load(machine, "G01 X.2 F60", "M02")
    machine.state("front")
    assert machine.library.gk_position() == 0
    assert machine.bound("ahead") == 1000


# Everything below appends moves directly: lines and arcs, as the interpreter makes them.

def line(*delta):
    """A straight move."""
    return Move(delta, False, False, 0, (0, 0))


def random_move(rng, size):
    """A line, or an arc whose end lies on its circle to the nearest pulse."""
    if rng.random() < 0.5:
        return line(*(rng.randint(-size, size) for _ in range(3)))
    plane = rng.randrange(3)
    radius = rng.uniform(1, size)
    angle, sweep = rng.uniform(0, math.tau), rng.uniform(0.1, math.tau)
    delta = [0, 0, 0]
    for axis, turned in zip(PLANES[plane], (math.cos, math.sin), strict=True):
        delta[axis] = round(radius * (turned(angle + math.pi + sweep) - turned(angle + math.pi)))
    if delta == [0, 0, 0] or radius * sweep < 2 * math.hypot(*delta) / 3 + 2:
        return line(1, 0, 0)
    delta[3 - sum(PLANES[plane])] = rng.choice([0, rng.randint(-size, size)])
    return Move((*delta,), True, True, plane,
                (round(64 * radius * math.cos(angle)), round(64 * radius * math.sin(angle))))


class Program:
    """Moves that are appended as room comes up, the machine following or driven by the test."""

    def __init__(self, machine, moves, rate=1 << 20):
        self.machine, self.library = machine, machine.library
        self.moves, self.rate = moves, rate
        self.appended = 0
        self.library.gk_speed(0)
        self.library.path_begin()

    def feed(self):
        """Append moves while there is room."""
        while self.appended < len(self.moves) and self.library.path_has_room() == 0:
            self.library.path_append(
                ctypes.byref(self.moves[self.appended]), self.rate, False, True)
            self.appended += 1
        self.machine.run(20)

    @property
    def done(self):
        """Whether everything has been appended and machined."""
        return self.appended == len(self.moves) and bool(self.library.path_at_front())

    def places(self):
        """Axes at every path pulse, by the model: the segments walked one after the other."""
        place, trail = (0, 0, 0), [(0, 0, 0)]
        for move in self.moves:
            for piece in pieces_of(move):
                for steps in piece.walk():
                    trail.append(tuple(a + b for a, b in zip(place, steps, strict=True)))
                place = trail[-1]
        return trail


def pieces_of(move):
    """Segments of a move, for the model."""
    if move.arc:
        arc = Arc(move)
        return [arc.piece(index)[1] for index in range(arc.pieces)]
    travel = tuple(move.delta)
    length = math.isqrt(4 * sum(part * part for part in travel)) + 1 >> 1
    return [Piece(length, travel, False, False, 0, 0, 0, 0, (0,) * 4, (0,) * 4)]


def test_lines_and_arcs_are_walked_both_ways_to_the_pulse(machine, rng):
    """The machine turns anywhere, whatever is loaded; it is always where the model has been."""
    moves = [random_move(rng, rng.choice([3, 30, 300])) for _ in range(250)]
    program = Program(machine, moves)
    trail = program.places()
    turns = 0
    while not program.done:
        program.feed()
        back = rng.random() < 0.35
        machine.state("retracting" if back else "front")
        machine.run(rng.randint(1, 30))
        machine.library.gk_go(rng.choice([-1, -17, -3000]) if back
                              else rng.choice([1, 7, 100, 5000]))
        machine.state("front")
        turns += back
        at = machine.library.gk_position()
        # Before the first point lies the way up.
        assert machine.axes == (trail[at] if at >= 0 else (0, 0, -at)), f"pulse {at}"
    assert turns > 50
    assert machine.library.gk_position() == len(trail) - 1
    machine.state("retracting")
    while machine.library.gk_position() > 0:
        machine.library.gk_go(-rng.randint(1, 400))
        machine.run(5)
        at = machine.library.gk_position()
        assert machine.axes == (trail[at] if at >= 0 else (0, 0, -at))


@pytest.mark.soak
def test_five_thousand_blocks_back_to_the_start(machine, rng):
    """Of a program of 10 000: lines of 10 um and every tenth an arc."""
    moves = []
    for number in range(10_000):
        x = rng.choice([-1, 1])
        moves.append(Move((20, 20, 0), True, True, 0, (0, 20 * 64)) if number % 10 == 0
                     else line(60 * x, 80, 0))
    program = Program(machine, moves)
    trail = [(0, 0, 0)]     # axes at every block's end
    ends = [0]
    for move in moves:
        trail.append(tuple(a + b for a, b in zip(trail[-1], move.delta, strict=True)))
        ends.append(ends[-1] + sum(piece.length for piece in pieces_of(move)))
    while not program.done:
        program.feed()
        machine.library.gk_go(4000)
    assert machine.axes == trail[-1]
    machine.state("retracting")
    blocks = len(moves)
    while True:
        before = machine.library.gk_position()
        while blocks and ends[blocks] >= before:
            blocks -= 1
        machine.library.gk_go(max(ends[blocks] - before, -4000))
        machine.run(120)
        at = machine.library.gk_position()
        if at == before:
            break
        if at == ends[blocks]:
            assert machine.axes == trail[blocks], f"block {blocks}"
    assert len(moves) - blocks > 5000
    machine.state("front")


def test_a_line_takes_16_bytes_and_an_arc_32(machine):
    program = Program(machine, [line(100, 0, 0), quarter(50), line(5, 5, 5)])
    numbers = [machine.library.path_append(ctypes.byref(move), 1 << 20, False, True)
               for move in program.moves]
    numbers.append(machine.library.path_next())
    bytes_of = [16 * (after - before) for before, after in pairwise(numbers)]
    assert bytes_of == [16, 32, 16]


def quarter(radius):
    """A quarter, from X to Y."""
    return Move((radius, radius, 0), True, True, 0, (0, 64 * radius))


def test_blocks_are_numbered_by_their_first_segment(machine):
    """A notice belongs to its block however many pieces it has."""
    program = Program(machine, [line(100, 0, 0), quarter(3000), line(0, 100, 0)])
    program.feed()
    machine.run(200)
    library = machine.library
    first = library.path_reached()
    machine.library.gk_go(50)
    assert library.path_reached() == first + 1
    for _ in range(5):
        library.gk_go(700)
        machine.run(50)
        assert library.path_reached() == first + 2, "inside the arc, whose number is first + 1"
    library.gk_go(100_000)
    machine.run(50)
    assert library.path_reached() == first + 4


def test_tangent_junctions_do_not_bound_the_speed(machine):
    """Line, quarter, line: only the last junction is a corner; inside the arc there is none."""
    machine.line(assign("arc_deviation_nm", 0))
    machine.line(assign("corner_deviation_nm", 0))
    radius = 40_000
    program = Program(machine, [line(1000, 0, 0), quarter(radius), line(0, 1000, 0),
                                line(1000, 0, 0)])
    program.feed()
    machine.run(400)
    total = 2000 + round(radius * math.pi / 2)
    assert machine.bound("fast_ahead") == pytest.approx(total, abs=1)
    assert machine.bound("ahead") == pytest.approx(total + 1000, abs=1)


def speed_on_arc(radius, *settings, clock_hz=50_000_000):
    """Highest speed on an arc between lines, mm/s; its ends are corners, and it has no other."""
    machine = Controller(clock_hz=clock_hz)
    machine.unlock()
    for setting in settings:
        machine.line(setting)
    program = Program(machine, [line(1000, 0, 0), quarter(radius), line(0, 1000, 0)],
                      rate=(1 << 30) - 1)
    program.feed()
    machine.run(400)
    assert machine.bound("fast_ahead") == 1000
    machine.library.gk_go(1001)
    machine.run(50)
    assert machine.bound("fast_ahead") == pytest.approx(1000 + radius * math.pi / 2, abs=1)
    slots = [machine.slot(slot) for slot in range(64)]
    assert {slot.highest for slot in slots if not slot.arc} == {0}
    (feed, highest), = {(slot.rate, slot.highest) for slot in slots if slot.arc}
    assert feed == (1 << 30) - 1
    return highest / 2**32 * clock_hz / 10_000


@pytest.mark.parametrize(("radius", "speed"), [(2500, 15.8), (500, 10.0)])
def test_speed_on_an_arc_is_bounded_by_the_acceleration(radius, speed):
    """It is the speed squared over the radius, here 1 m/s2, and up to 10 mm/s there is no bound."""
    assert speed_on_arc(radius, assign("arc_deviation_nm", 0)) == pytest.approx(speed, rel=0.002)


@pytest.mark.parametrize(("radius", "gain", "deviation_um"), [
    (500, 50, 2), (500, 50, 10), (2500, 50, 2), (40_000, 30, 2), (35, 50, 0.5), (2500, 120, 2),
])
def test_lag_of_the_servo_leads_inside_an_arc_by_the_deviation_at_most(radius, gain, deviation_um):
    """In the plain loop: the lag of a loop of first order, in closed form."""
    speed = speed_on_arc(radius, assign("feed_forward", 0), assign("loop_gain", gain),
                         f"$457={deviation_um * 1000:.0f}")
    radius_um = radius / 10
    inside = radius_um * (1 - 1 / math.hypot(1, speed * 1000 / radius_um / gain))
    assert inside <= deviation_um
    assert speed * 1000 == pytest.approx(gain * math.sqrt(2 * radius_um * deviation_um), rel=0.002)


def inside_um(speed, radius_um, gain, share, true, lag_s=LAG_S, model_s=LAG_S):
    """How far a loop with feed-forward runs inside an arc, from its response at that frequency.

    The drive has a lag of first order, as has the controller's model of it, and ``true`` times the
    gain of the setting.
    """
    s = 1j * speed * 1000 / radius_um
    drive, model = true / (1 + lag_s * s), 1 / (1 + model_s * s)
    followed = drive * (gain + share * s) / (s * (1 + gain * model_s * model) + drive * gain)
    return radius_um * (1 - abs(followed))


@pytest.mark.parametrize("share", [20, 60, 100])
@pytest.mark.parametrize(("radius", "gain"), [(500, 50), (2500, 50), (40_000, 30), (2500, 100)])
def test_lag_of_the_drive_leads_inside_an_arc_by_the_deviation_at_most(radius, gain, share):
    """With feed-forward, as delivered, and for drives that are up to a tenth slower or faster."""
    speed = speed_on_arc(radius, assign("loop_gain", gain), assign("feed_forward", share))
    found = [inside_um(speed, radius / 10, gain, share / 100, true) for true in (0.9, 1, 1.1)]
    assert all(abs(one) <= DEVIATION_UM * 1.01 for one in found), found
    assert max(found) >= DEVIATION_UM * 0.75, "not much slower than the bound asks"
    assert speed_on_arc(2500) / speed_on_arc(2500, assign("feed_forward", 0)) == pytest.approx(
        1.724, abs=0.003)


@pytest.mark.parametrize(("lag_us", "model_us", "share"), [
    *((lag, 4096, share) for share in (60, 100) for lag in (1000, 2000, 8000, 12_000)),
    (3500, 3260, 100), (6000, 5000, 60), (900, 8000, 100)])
@pytest.mark.parametrize(("radius", "gain"), [(2500, 50), (40_000, 30)])
def test_a_drive_that_differs_from_the_model_keeps_the_bound(radius, gain, lag_us, model_us, share):
    """Inside the arc or, if it is much slower, outside of it."""
    speed = speed_on_arc(radius, assign("loop_gain", gain), assign("feed_forward", share),
                         assign("drive_lag_us", lag_us), assign("model_lag_y_us", model_us))
    found = [abs(inside_um(speed, radius / 10, gain, share / 100, true, lag_us * 1e-6, lag * 1e-6))
             for true in (0.9, 1, 1.1) for lag in (4096, model_us)]     # X and Y
    assert 0.75 * DEVIATION_UM <= max(found) <= 1.01 * DEVIATION_UM, found


def test_pieces_of_an_arc_follow_no_faster_than_they_are_made():
    """In the simulation's slow clock: a piece of 1/32 of a turn in 22 000 clocks."""
    speed = speed_on_arc(500, assign("arc_deviation_nm", 0), clock_hz=2_000_000)
    assert speed == pytest.approx(math.tau * 0.05 / 32 / 22_000 * 2_000_000, rel=0.01)


@pytest.mark.parametrize(("plane", "delta", "centre", "ccw"), [
    (1, (3000, 0, -3000), (0, 64 * 3000), False),
    (1, (3000, 0, -3000), (-64 * 3000, 0), True),
    (2, (0, 3000, -3000), (64 * 3000, 0), True),
    (0, (0, 0, -5000), (64 * 1000, 0), True),       # helix
])
def test_ceiling_on_an_arc_is_met_to_the_pulse(machine, rng, plane, delta, centre, ccw):
    """The back limit is the least place from which on no pulse is above the ceiling."""
    height = -rng.randint(50, 2900)
    program = Program(machine, [Move(delta, True, ccw, plane, centre)])
    trail = program.places()
    machine.library.path_set_bounds(1 << 30, True, height)
    while not machine.library.path_bounds_step():
        pass
    wanted = max(k for k, place in enumerate(trail) if place[2] > height) + 1
    while not program.done:
        program.feed()
        machine.library.gk_go(500)
    assert machine.bound("back_limit") == wanted, "each segment puts its back limit in force"
    machine.library.path_set_bounds(1 << 30, True, height)
    while not machine.library.path_bounds_step():
        pass
    assert machine.bound("back_limit") == wanted, "the same, found from the end"
    machine.state("retracting")
    go(machine, -999_999, passes=40)
    assert machine.axes == trail[wanted]
