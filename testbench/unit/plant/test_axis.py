# SPDX-License-Identifier: Apache-2.0
"""The axes of the simulated machine: motor, pulse coder, step input, switches, machine side."""

from itertools import pairwise

import numpy as np
import pytest

from host.machines.machine import load
from testbench.native.alone import Alone

MACHINE = load("sinker").tables
HZ = 2_000_000
FULL, Z = 32768, 4
QUADRATURE = {(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}


@pytest.fixture
def plant(rng):
    plant = Alone(machine=MACHINE, seed=rng.getrandbits(32))
    plant.set("initial_gap_um", 1e5)
    plant.drive(drive_enable=7)
    return plant


def test_speed_loop_answers_a_step_as_its_equations(plant):
    # V/U = 1 / ((tau_f s + 1)(tau_i tau_v s^2 + tau_v s + 1)), by partial fractions.
    density = 1000
    command = 163.84 * density / FULL
    filter_s, current_s, loop_s = 0.5e-3, 0.5e-3, 3e-3
    poles = np.roots(np.polymul([filter_s, 1], [current_s * loop_s, loop_s, 1]))
    others = [np.delete(poles, index) for index in range(3)]
    gain = 1 / (filter_s * current_s * loop_s)
    residues = [gain / (pole * np.prod(pole - other))
                for pole, other in zip(poles, others, strict=True)]

    def expected(t):
        return command * (1 + sum(residue * np.exp(pole * t)
                                  for residue, pole in zip(residues, poles, strict=True)).real)

    plant.density = density
    for _ in range(60):
        plant.run(HZ // 2000)
        # The plant's steps of 8 us, and the bit stream's, are worth half a per cent each.
        assert plant.get("read.z_speed_mm_s") == pytest.approx(
            expected(plant.cycle / HZ), abs=0.015 * command)
    plant.run(HZ // 10)
    assert plant.get("read.z_speed_mm_s") == pytest.approx(command, rel=0.005)


def test_an_axis_moves_in_every_clock_whether_it_is_looked_at_or_not(rng):
    """The plant may add up a tick's clocks at its end; nobody can tell."""
    seed = rng.getrandbits(32)
    looked_at, left_alone = plants = [Alone(machine=MACHINE, seed=seed) for _ in range(2)]
    for plant in plants:
        plant.set("initial_gap_um", 1e5)
        plant.drive(drive_enable=7)
    for _ in range(20):
        density = rng.choice([-1500, -20, 0, 20, 1500])
        for plant in plants:
            plant.density = density
            plant.run(HZ // 1000 + 5)
        places, speeds = [], []
        for _ in range(50):
            for plant in plants:
                plant.run(1)
            places.append(looked_at.get("read.z_pulses"))
            speeds.append(looked_at.get("read.z_speed_mm_s"))
        for speed, (before, after) in zip(speeds, pairwise(places), strict=False):
            assert after - before == pytest.approx(
                speed * MACHINE["pulses_per_mm"] / HZ, rel=1e-6, abs=1e-9)
        assert left_alone.get("read.z_pulses") == places[-1]


def axis_with(rng, **numbers):
    plant = Alone(machine=MACHINE | {"axis": MACHINE["axis"] | numbers}, seed=rng.getrandbits(32))
    plant.set("initial_gap_um", 1e5)
    plant.drive(drive_enable=7)
    return plant


def test_dead_time_delays_the_whole_answer(rng):
    drives = axis_with(rng), axis_with(rng, dead_time_ms=2.0)
    for drive in drives:
        drive.density = 1000
    drives[1].run(HZ // 500)
    assert drives[1].get("read.z_speed_mm_s") == 0
    for _ in range(20):
        speeds = []
        for drive in drives:
            drive.run(HZ // 1000)
            speeds.append(drive.get("read.z_speed_mm_s"))
        assert speeds[1] == pytest.approx(speeds[0], abs=0.02)
    assert speeds[0] > 4


@pytest.mark.parametrize("offset", [0.05, -0.05])
def test_an_offset_moves_the_axis_without_a_command(rng, offset):
    drive = axis_with(rng, offset_mm_s=offset)
    drive.run(HZ // 10)
    assert drive.get("read.z_speed_mm_s") == pytest.approx(offset, rel=1e-3)


@pytest.mark.parametrize("sign", [1, -1])
def test_friction_holds_an_axis_and_takes_its_share_of_the_speed(rng, sign):
    drive = axis_with(rng, friction_mm_s=0.3)
    drive.density = sign * 50           # 0.25 mm/s
    drive.run(HZ // 10)
    assert drive.get("read.z_speed_mm_s") == 0
    drive.density = sign * 1000         # 5 mm/s
    drive.run(HZ // 10)
    assert sign * drive.get("read.z_speed_mm_s") == pytest.approx(5 - 0.3, abs=0.03)
    drive.density = 0
    drive.run(HZ // 10)
    assert drive.get("read.z_speed_mm_s") == 0


@pytest.mark.parametrize("sign", [1, -1])
def test_acceleration_and_speed_are_limited(plant, sign):
    plant.density = sign * 32767
    plant.run(HZ // 100)
    before = plant.get("read.z_speed_mm_s")
    plant.run(HZ // 1000)
    gained = plant.get("read.z_speed_mm_s") - before
    assert sign * gained == pytest.approx(5000 * 1e-3, rel=0.01)
    plant.run(HZ // 20)
    assert sign * plant.get("read.z_speed_mm_s") == 60


def test_the_sign_of_the_dac_counts_in_every_clock(plant):
    """As long up as down in every tick of 16 clocks: the axis rests."""
    for _ in range(500):
        for plant.density in (FULL, -FULL):
            plant.run(8)
    assert plant.get("read.z_speed_mm_s") == 0
    for _ in range(500):
        for plant.density, clocks in ((FULL, 10), (-FULL, 6)):
            plant.run(clocks)
    assert plant.get("read.z_speed_mm_s") > 1


@pytest.mark.parametrize("sign", [1, -1])
def test_a_disabled_drive_brakes_to_rest(plant, sign):
    plant.density = sign * 5000
    plant.run(HZ // 5)
    speed, place = plant.get("read.z_speed_mm_s"), plant.get("read.z_pulses")
    plant.drive(drive_enable=0)
    plant.run(HZ // 50)
    assert plant.get("read.z_speed_mm_s") == 0
    way_mm = (plant.get("read.z_pulses") - place) / 10_000
    assert sign * way_mm == pytest.approx(speed**2 / 2 / 8000, rel=0.01)
    rest = plant.get("read.z_pulses")
    plant.run(HZ // 50)
    assert plant.get("read.z_pulses") == rest


def test_coder_counts_the_position(plant, rng):
    # Every edge of the two phases, decoded here: a legal one, far enough from the last for the
    # controller's filter, and their sum is the position.
    count, state, latest = 0, 0, -10
    spacing = []
    for _ in range(200):
        plant.density = rng.choice([0, 1, -1, 300, -300, rng.randint(-9000, 9000)])
        left = 4000
        while left > 0:
            left -= plant.until(("enc_a", "enc_b"), left)
            phases = plant.input("enc_a") >> 2 & 1, plant.input("enc_b") >> 2 & 1
            moved = (QUADRATURE[phases] - state) % 4
            assert moved != 2, "both phases changed at once"
            if moved:
                spacing.append(plant.cycle - latest)
                latest = plant.cycle
            count += moved - 4 * (moved == 3)
            state = QUADRATURE[phases]
        assert count == plant.positions()["z"]
        assert abs(plant.get("read.z_pulses") - count - 0.4) <= 0.61  # one pulse, and the play
    assert len(spacing) > 2000
    assert min(spacing) >= 3
    plant.density = 20_000
    plant.run(HZ // 20)
    plant.until(("enc_a", "enc_b"), HZ)
    gaps = [plant.until(("enc_a", "enc_b"), HZ) for _ in range(1000)]
    assert set(gaps) == {3, 4}              # 60 mm/s, its highest speed


@pytest.mark.parametrize("sign", [1, -1], ids=["up", "down"])
def test_the_index_comes_at_its_count_once_in_a_turn(plant, sign):
    turn, at = 2000, 650
    plant.set("z.index_mm", turn / 10_000)
    plant.set("z.index_at_mm", at / 10_000)
    plant.density = sign * 3000
    high = []
    for _ in range(9000):
        plant.until(("enc_a", "enc_b", "enc_index"), HZ)
        if plant.input("enc_index") >> 2:
            high.append(plant.positions()["z"])
    assert len(high) >= 4
    # From the edge that leads to its count on to the next one.
    assert all(place % turn == at for place in high)
    assert all(sign * (later - place) == turn for place, later in pairwise(high))
    assert not plant.input("enc_index") & 3 or at == 0


def test_the_line_of_the_index_can_be_broken_or_stuck(plant):
    plant.set("z.index_mm", 0.01)
    plant.set("force.index_cut", Z)
    plant.density = 3000
    assert plant.until(("enc_index",), HZ // 20) == HZ // 20
    plant.set("force.index_high", Z)
    assert plant.until(("enc_index",), HZ // 20) == 1
    assert plant.until(("enc_index",), HZ // 20) == HZ // 20
    assert plant.input("enc_index") >> 2 == 1


def test_coder_has_play(plant):
    # An axis that turns back within a fifth of a pulse gives no edge: at rest it does not chatter.
    plant.density = 1
    plant.until(("enc_a", "enc_b"), HZ)
    turned = plant.get("read.z_pulses")
    plant.density = -1
    plant.until(("enc_a", "enc_b"), HZ)
    assert turned - plant.get("read.z_pulses") == pytest.approx(0.2, abs=0.01)


def test_a_cut_coder_is_silent_and_a_jump_changes_both_phases(plant):
    plant.density = 3000
    plant.run(HZ // 50)
    plant.set("force.encoder_cut", Z)
    plant.run(1)
    assert plant.until(("enc_a", "enc_b"), HZ // 100) == HZ // 100
    plant.set("force.encoder_cut", 0)
    plant.density = 0
    plant.run(HZ // 2)
    before = plant.input("enc_a"), plant.input("enc_b")
    plant.set("force.encoder_jump", Z)
    plant.run(1)
    assert (plant.input("enc_a"), plant.input("enc_b")) == (before[0] ^ Z, before[1] ^ Z)


@pytest.mark.parametrize(("force", "line", "level"), [
    ("a_low", "enc_a", 0), ("a_high", "enc_a", Z), ("b_low", "enc_b", 0), ("b_high", "enc_b", Z)])
def test_a_stuck_phase_keeps_its_level_and_the_other_goes_on(plant, force, line, level):
    plant.density = 3000
    plant.set(f"force.encoder_{force}", Z)
    other = {"enc_a": "enc_b", "enc_b": "enc_a"}[line]
    edges = 0
    for _ in range(200):
        plant.until(("enc_a", "enc_b"), HZ // 100)
        assert plant.input(line) == level
        edges += plant.input(other) == Z
    assert edges == 100


def test_swapped_phases_count_the_other_way(plant):
    plant.set("force.encoder_swap", Z)
    plant.run(1)
    plant.density = 3000
    state, count = 0, 0
    for _ in range(400):
        plant.until(("enc_a", "enc_b"), HZ // 100)
        moved = (QUADRATURE[plant.input("enc_a") >> 2, plant.input("enc_b") >> 2] - state) % 4
        state = (state + moved) % 4
        count += {1: 1, 3: -1}[moved]
    assert count == -plant.positions()["z"] == -400


def test_an_open_plug_is_pulled_up_one_line_after_the_other(plant):
    plant.run(1)
    assert (plant.input("enc_a"), plant.input("enc_b")) == (0, 0)
    plant.set("force.encoder_open", Z)
    plant.run(1)
    assert (plant.input("enc_a"), plant.input("enc_b")) == (Z, 0)
    plant.density = 3000
    assert plant.until(("enc_b",), HZ // 100) == HZ * 10 // 1_000_000 - 1
    assert plant.until(("enc_a", "enc_b"), HZ // 100) == HZ // 100, "it stays"


def test_a_phase_that_is_gone_picks_up_noise(plant):
    plant.set("force.encoder_noise_hz", 20e3)
    plant.set("force.encoder_a_noise", Z)
    gaps = [plant.until(("enc_a",), HZ) for _ in range(1000)]
    assert np.mean(gaps) == pytest.approx(100, rel=0.1)
    assert np.std(gaps) == pytest.approx(100, rel=0.2)
    assert plant.input("enc_b") == 0


def test_step_pulses_move_a_stepping_drive(plant):
    for index in range(1000):
        plant.step(0b001, 0b000 if index < 800 else 0b001)
        plant.run(20)
        plant.step(0)
        plant.run(20)
    plant.run(HZ // 5)
    assert plant.get("read.x_pulses") == pytest.approx(600, abs=0.5)
    assert plant.positions()["y"] == plant.positions()["z"] == 0


@pytest.mark.parametrize("turned", [False, True], ids=["", "reversed"])
def test_an_axis_stays_until_its_motor_has_turned_through_the_play(plant, turned):
    for name, value in {"steps_per_turn": 640, "pitch_mm": 1, "backlash_um": 50,
                        "reversed": turned}.items():
        plant.set(f"x.{name}", value)
    for name in ("speed_loop_ms", "current_loop_ms", "filter_ms"):
        plant.set(f"axis.{name}", 0.3)      # so that it does not swing

    def go(steps):
        for _ in range(abs(steps)):
            plant.step(0b001, (steps < 0) != turned)
            plant.run(400)
            plant.step(0)
            plant.run(400)
        plant.run(HZ // 20)
        return plant.get("read.x_pulses") / 15.625

    play = 500 / 15.625     # in steps
    assert go(100) == pytest.approx(100, abs=0.1)
    assert go(-20) == pytest.approx(100, abs=0.1), "within the play"
    assert go(-80) == pytest.approx(play, abs=0.1)
    assert go(20) == pytest.approx(play, abs=0.1)
    assert go(80) == pytest.approx(100, abs=0.1)
    assert plant.get("read.x_steps") == 100


@pytest.mark.parametrize("stepping", [False, True], ids=["coder", "steps"])
def test_a_wrong_screw_takes_the_axis_beside_what_its_motor_has_turned(plant, stepping):
    axis = "x" if stepping else "z"
    for name, value in {"screw_um_m": 4000, "screw_wave_um": 20, "screw_wave_mm": 0.4}.items():
        plant.set(f"{axis}.{name}", value)
    furthest = 0
    for way in (1, 1, -1, -1, -1, 1):
        for _ in range(500 * stepping):
            plant.step(0b001, way < 0)
            plant.run(20)
            plant.step(0)
            plant.run(20)
        plant.density = 0 if stepping else way * 3000
        plant.run(HZ // 200)
        plant.density = 0
        plant.run(HZ // 5)
        turned = plant.get("read.x_steps") if stepping else plant.positions()["z"]
        furthest = max(furthest, abs(turned))
        error = 4000e-6 * turned + 200 * np.sin(2 * np.pi * turned / 4000)
        assert plant.get(f"read.{axis}_pulses") == pytest.approx(turned + error, abs=1.5)
    assert furthest > 900


def test_limit_switches_are_where_the_machine_says(plant):
    plant.set("side.limit_high_mm", 0.5)
    plant.density = 3000
    plant.until(("limit_high",), HZ)
    assert plant.input("limit_high") == Z
    assert plant.get("read.z_pulses") == pytest.approx(5000, abs=16 * 0.5 * 15)
    assert plant.input("limit_low") == 0


@pytest.mark.parametrize("sign", [1, -1])
def test_a_limit_switch_stays_pressed_within_its_hysteresis(plant, sign):
    pin, end = ("limit_high", "limit_high_mm") if sign > 0 else ("limit_low", "limit_low_mm")
    plant.set("side.limit_scatter_um", 0)
    plant.set(f"side.{end}", sign * 0.5)
    plant.density = sign * 300
    plant.until((pin,), HZ)
    assert plant.input(pin) == Z
    plant.density = -sign * 300
    plant.until((pin,), HZ)
    assert plant.input(pin) == 0
    released_um = (0.5 * 10000 - sign * plant.get("read.z_pulses")) / 10
    assert released_um == pytest.approx(50, abs=2)


def test_a_limit_switch_is_pressed_anywhere_in_its_scatter(plant):
    plant.set("side.limit_scatter_um", 1000)
    plant.set("side.limit_high_mm", 0.5)
    pressed_um = []
    for _ in range(40):
        plant.density = 1500
        plant.until(("limit_high",), HZ)
        assert plant.input("limit_high") == Z
        pressed_um.append(plant.get("read.z_pulses") / 10)
        plant.density = -1500
        plant.run(HZ // 5)
        assert plant.input("limit_high") == 0
    # Draws from 0 to 1000 um; one below the switch, on the way back, is drawn again further down.
    assert 0 <= min(pressed_um) < 450
    assert 750 < max(pressed_um) < 1010


def test_machine_side_answers_a_strobe(plant):
    plant.drive(strobe=1, code=8)
    waited = plant.until(("fin",), HZ)
    assert plant.input("fin")
    assert waited == pytest.approx(2000e-6 * HZ, abs=32)
    plant.run(100)
    plant.drive(strobe=0)
    plant.until(("fin",), HZ)
    assert not plant.input("fin")
    plant.set("side.fin_answers", 0)
    plant.drive(strobe=4, code=12)
    assert plant.until(("fin",), HZ // 100) == HZ // 100
    assert [row[1:] for row in plant.auxiliaries()] == [("M", 8), ("T", 12)]


@pytest.mark.parametrize(("force", "value", "pin"), [
    ("force.estop", 1, "estop"), ("force.fluid_low", 1, "fluid_low"),
    ("force.drive_fault", 2, "drive_fault"), ("force.limit_low", 4, "limit_low"),
    ("force.limit_high", 1, "limit_high")])
def test_pins_can_be_forced(plant, force, value, pin):
    plant.run(1)
    assert plant.input(pin) == 0
    plant.set(force, value)
    plant.run(1)
    assert plant.input(pin) == value
    plant.set(force, 0)
    plant.run(1)
    assert plant.input(pin) == 0
