# SPDX-License-Identifier: Apache-2.0
"""The simulated machine in Python programs: by hand, as an environment, and on its page."""

import math
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from host.errors import UsageError, UserError
from host.link.link import RefusedError
from host.study.environment import FEATURES, LEAST_UM, MOST_UM, PAUSES_US, STEP_S, Sinking
from host.study.machine import SimulatedMachine
from testbench.study import policy, step_cost

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "how-to" / "study-control.md"
AT = {name: index for index, name in enumerate(FEATURES)}
START = ("G21 G91 G94", "G36 R300 L0.5 H600 E60 Q0.1", "C100", "M03")


def blocks(text):
    """The Python of a page."""
    return re.findall(r"^```python\n(.*?)^```", text, flags=re.M | re.S)


@pytest.fixture
def sinking():
    made = []

    def make(**options):
        made.append(Sinking(**options))
        return made[-1]

    yield make
    for one in made:
        one.close()


def test_the_code_of_the_page_runs(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    names = {}
    for number, text in enumerate(blocks(PAGE.read_text(encoding="utf-8")), start=1):
        exec(compile(text, f"{PAGE.name}, block {number}", "exec"), names)
    assert number == 4
    assert names["outcome"] == "stopped"
    assert set(names["trace"]) >= {"t", "z", "gap_v", "open", "ok"}
    assert all(len(column) == len(names["trace"]["t"]) > 900 for column in names["trace"].values())
    assert names["trace"]["ok"].sum() > 100
    assert names["block"].answer == "ok"
    # Both have come near enough to remove something, by another way each.
    assert names["own_info"]["removed_mm3"] > 0.05
    assert names["servo_info"]["removed_mm3"] > 0.05
    assert names["own"] > 0
    assert names["own"] != names["servo"]
    assert capsys.readouterr().out.count("\n") == 5


# ---- the machine

def test_a_step_is_so_many_clocks_before_and_after_the_set_up():
    with SimulatedMachine("small", trace=False) as machine:
        machine.step(0.0015)
        assert machine.clock == 3000
        machine.set_up()
        before = machine.clock
        machine.step(0.0125)
        assert machine.clock == before + 25_000
        assert machine.time_s == machine.clock / 2e6


def test_lines_move_the_machine_and_are_refused_with_the_controllers_words():
    with SimulatedMachine("small") as machine:
        machine.set_up()
        for line in START:
            machine.command(line)
        sent = machine.send("G01 Z-0.02 F60")
        assert sent.answer is None
        machine.step(0.2)       # of which 20 ms are motion: the lag of 20 um dies away at 50/s
        assert sent.answer == "ok"
        assert machine.positions_mm()["z"] == pytest.approx(-0.02, abs=0.0002)
        assert machine.lags_mm()["z"] == pytest.approx(0, abs=0.0002)
        assert machine.signal("path_front") == 200
        with pytest.raises(RefusedError, match="G43"):
            machine.command("G43 H1")
        for ask in (machine.command, machine.send):
            with pytest.raises(TypeError, match=r"^a line must be a text, not None$"):
                ask(None)
    assert machine.trace()["z"][-1] == pytest.approx(-200, abs=2)
    assert machine.discharges()["open"] > 1000


def test_an_alarm_is_told():
    with SimulatedMachine("small", trace=False) as machine:
        machine.set_up()
        assert machine.alarm is None
        machine.set("force.estop", 1)
        machine.step(0.05)
        assert "emergency stop" in machine.alarm["text"]
        assert machine.events[-1]["event"] == "alarm"


def test_what_cannot_be_asked_is_refused():
    with SimulatedMachine("small", trace=False) as machine:
        for ask in (lambda: machine.command("G21"), lambda: machine.send("G21"), machine.status):
            with pytest.raises(UsageError, match=r"not set up: call set_up\(\) first"):
                ask()
        with pytest.raises(ValueError, match=r"'gap\.nothing'"):
            machine.get("gap.nothing")
        with pytest.raises(ValueError, match=r"'gap\.nothing'"):
            machine.set("gap.nothing", 1)
        with pytest.raises(ValueError, match="no signal 'nothing'"):
            machine.signal("nothing")
        machine.set_up()
        for ask in (machine.set_up, lambda: machine.run_tape(ROOT / "tapes" / "sink_servo.nc")):
            with pytest.raises(UsageError, match="set up already"):
                ask()
    for ask in (lambda: machine.step(1), lambda: machine.get("read.gap_um"), machine.status,
                machine.__enter__):
        with pytest.raises(UsageError, match="switched off"):
            ask()


NAN, INF = math.nan, math.inf
SEED = f"seed must be a whole number from 0 to {2**64 - 1}, not"
CLOCK = "clock_hz must be a whole number from 2000000 to 100000000, not"


@pytest.mark.parametrize(("options", "kind", "said"), [
    *(({"seed": seed}, ValueError, f"{SEED} {seed}") for seed in (-1, 2**64, 1.5, NAN)),
    ({"seed": 10**5000}, ValueError, f"{SEED} a value so long"),
    ({"seed": "1"}, TypeError, "seed must be a number, not '1'"),
    *(({"clock_hz": clock}, ValueError, f"{CLOCK} {clock}")
      for clock in (0, -5, 1_999_999, 100_000_001, 2_234_567.8, INF)),
    ({"clock_hz": "2e6"}, TypeError, "clock_hz must be a number, not '2e6'"),
    ({"machine": 3}, TypeError, "machine must be a text, not 3"),
    ({"machine": None}, TypeError, "machine must be a text, not None"),
])
def test_a_machine_that_cannot_be_made_is_refused(options, kind, said):
    with pytest.raises(kind, match=f"^{re.escape(said)}$"):
        SimulatedMachine(**{"machine": "small"} | options)


def test_the_ends_of_a_range_are_allowed():
    for options in ({"seed": 0}, {"seed": 2**64 - 1}, {"seed": np.int64(5), "clock_hz": 2e6},
                    {"machine": ROOT / "host" / "machines" / "small.toml"}):
        with SimulatedMachine(**{"machine": "small", "trace": False} | options) as machine:
            machine.step(np.float32(0.001))
            assert (machine.clock, machine.clock_hz) == (2000, 2_000_000)


@pytest.fixture(scope="module")
def machine():
    """A sinker after its first clocks."""
    with SimulatedMachine("small", trace=False) as one:
        one.step(0.001)
        yield one


NO_CHANGE = "cannot be changed"
SET = "is a setting of the controller: send it as a line, $ and its number = value"


@pytest.mark.parametrize(("name", "value", "kind", "said"), [
    *(("gap.area_mm2", value, ValueError, f"gap.area_mm2 must be 0.001 to 1000000000, not {value}")
      for value in (NAN, INF, -5, 0, 2 * 10**9)),
    ("gap.area_mm2", "x", TypeError, "gap.area_mm2 must be a number, not 'x'"),
    ("gap.area_mm2", None, TypeError, "gap.area_mm2 must be a number, not None"),
    ("comparator.fixed", 0.5, ValueError, "comparator.fixed must be 0 or 1, not 0.5"),
    ("x.backlash_um", 0.04, ValueError, "x.backlash_um must be 0, or 0.1 to 819.1, not 0.04"),
    *((name, 1, ValueError, f"{name!r} {NO_CHANGE}: the simulation is built for it; give another "
       "machine's file") for name in ("clock_hz", "pulses_per_mm", "current_max_a")),
    *((name, 1, ValueError, f"{name!r} is a word or a list, and {NO_CHANGE}: give another "
       "machine's file") for name in ("kind", "axis.dac", "x.output", "work.shape",
                                      "x.pitch_error_um")),
    ("initial_gap_um", 50, ValueError, f"'initial_gap_um' {NO_CHANGE} any more: the machine starts "
                                       "with it, and its clock runs"),
    *((name, 1, ValueError, f"{name!r} {SET}")
      for name in ("settings.408", "x.highest_mm_min", "z.low_mm", "y.pitch_step_mm")),
    ("wire.diameter_mm", 0.2, ValueError, "a machine of the kind sinker has no number "
                                          "'wire.diameter_mm'"),
    ("read.gap_um", 5, ValueError, "'read.gap_um' is a reading, and cannot be set"),
    (3, 5, TypeError, "a name must be a text, not 3"),
    ("force.short", 2, ValueError, "force.short must be a whole number from -1 to 1, not 2"),
    ("force.estop", NAN, ValueError, "force.estop must be a whole number from 0 to 15, not nan"),
    ("force.debris", -1, ValueError, "force.debris must be 0 to 1000000000, or NaN (not forced), "
                                     "not -1"),
    ("force.encoder_noise_hz", 0, ValueError, "force.encoder_noise_hz must be 1 to 1000000000, not "
                                              "0"),
])
def test_a_change_that_cannot_be_is_refused_and_changes_nothing(machine, name, value, kind, said):
    area = machine.get("gap.area_mm2")
    with pytest.raises(kind, match=f"^{re.escape(said)}$"):
        machine.set(name, value)
    assert machine.get("gap.area_mm2") == area
    assert machine.get("clock_hz") == 2_000_000


def test_a_change_within_its_range_is_made(machine):
    for name, value in (("gap.area_mm2", 0.001), ("gap.area_mm2", np.float32(20)),
                        ("comparator.fixed", True), ("force.short", -1), ("force.gap_um", 25)):
        machine.set(name, value)
        assert machine.get(name) == value
    machine.set("force.gap_um", NAN)
    assert math.isnan(machine.get("force.gap_um"))
    with SimulatedMachine("small", trace=False) as fresh:
        fresh.set("initial_gap_um", 50)
        assert fresh.get("read.gap_um") == 50


@pytest.mark.parametrize(("kind", "said", "value"), [
    *((ValueError, f"must be 0 to 1000000000, not {value}", value)
      for value in (-0.001, NAN, INF, 1e300)),
    (TypeError, "must be a number, not '1'", "1"),
    (TypeError, "must be a number, not True", True)])
def test_a_time_that_cannot_be_is_refused(machine, kind, said, value):
    clock = machine.clock
    with pytest.raises(kind, match=f"^seconds {re.escape(said)}$"):
        machine.step(value)
    with pytest.raises(kind, match=f"^until_s {re.escape(said)}$"):
        machine.run_tape(ROOT / "tapes" / "sink_servo.nc", until_s=value)
    assert machine.clock == clock
    with pytest.raises(UsageError, match="not set up"):     # a refused tape has begun nothing
        machine.status()


def test_a_name_is_a_text(machine):
    for ask in (machine.get, machine.signal):
        with pytest.raises(TypeError, match=r"^a name must be a text, not 3$"):
            ask(3)


# ---- the environment

@pytest.mark.soak
def test_gymnasium_finds_nothing_wrong_with_the_environment(sinking):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(sinking(), skip_render_check=True)


def test_a_seed_gives_the_same_trace_and_another_one_another(sinking):
    def trace(seed):
        environment = sinking(trace=True)
        # Near enough for sparks: what is random.
        observation, _ = environment.reset(seed=seed)
        environment.bench.set("force.gap_um", 25)
        rewards = []
        for _ in range(6):
            observation, reward, *_ = environment.step(policy(observation))
            rewards.append(reward)
        environment.close()
        return rewards, environment.bench.trace()

    (first, one), (second, two), (third, three) = trace(3), trace(3), trace(4)
    assert first == second
    assert one.keys() == two.keys()
    assert all(np.array_equal(one[name], two[name]) for name in one)
    assert first != third
    assert not np.array_equal(one["ok"], three["ok"])


def test_actions_move_the_electrode_and_choose_the_pause(sinking):
    environment = sinking()
    observation, _ = environment.reset(seed=1)
    assert environment.observation_space.contains(observation)
    for way in (1.0, 0.5, 3.0, -1.0, 0.9 * LEAST_UM / MOST_UM):     # what is too much is bounded
        observation, *_ = environment.step([way, -1])
    for _ in range(4):
        observation, *_ = environment.step([0, -1])
    assert observation[AT["z_um"]] == pytest.approx(
        100 - (1 + 0.5 + 1 - 1) * MOST_UM, abs=0.2)     # from where it stood at first
    assert observation[AT["deepest_um"]] < observation[AT["z_um"]]
    found = []
    for pause in (-1, 0, 1):
        for _ in range(8):
            observation, *_ = environment.step([0, pause])
        found.append((sum(observation[AT[name]] for name in ("open", "ok", "dame", "short")),
                      observation[AT["pause_us"]], observation[AT["gap_v"]]))
    assert [pause for _, pause, _ in found] == [PAUSES_US[0], PAUSES_US[2], PAUSES_US[-1]]
    for pulses, pause_us, gap_v in found:
        assert pulses == pytest.approx(STEP_S * 1e6 / (15 + pause_us), abs=2)
        assert gap_v == pytest.approx(80 * 15 / (15 + pause_us), rel=0.1)   # hardly any ignite


def test_a_short_is_left_whatever_the_agent_wants_and_costs_reward(sinking):
    environment = sinking()
    _, began = environment.reset(seed=1)
    bench = environment.bench
    before = bench.discharges()
    bench.set("force.short", 1)
    observation, reward, _, _, info = environment.step([1, -1])
    shorted = bench.discharges()["short"] - before["short"]
    assert shorted >= 3
    # A spark beside the shorts removes a little, which is rewarded as ever.
    removed = 1000 * (info["removed_mm3"] - began["removed_mm3"]) / 10    # of 10 mm2
    assert removed < 0.001
    assert reward == pytest.approx(removed - environment.damage_um * shorted)
    for _ in range(3):
        observation, _, _, _, info = environment.step([1, -1])
    assert observation[AT["busy"]] == 1
    assert observation[AT["z_um"]] > 150
    assert info["retractions"] == 1
    sent = []
    bench.send = sent.append
    environment.step([1, 1])
    assert not sent             # its actions are dropped meanwhile


def test_removal_is_rewarded_by_its_depth(sinking):
    environment = sinking(damage_um=0.0)
    _, info = environment.reset(seed=1)
    environment.bench.set("force.gap_um", 25)
    began, total = info["removed_mm3"], 0.0
    for _ in range(5):
        _, reward, _, _, info = environment.step([0, -1])
        total += reward
    assert total == pytest.approx(1000 * (info["removed_mm3"] - began) / 10)    # of 10 mm2
    assert total > 0.5


def test_an_episode_ends_at_its_depth_with_an_alarm_or_after_its_steps(sinking):
    environment = sinking(depth_mm=0.002)
    _, ended, steps = environment.reset(seed=1), False, 0
    environment.bench.set("force.short", 0)     # none turns the electrode round on its way
    while not ended:
        observation, _, ended, truncated, info = environment.step([1, -1])
        steps += 1
    assert 20 <= steps <= 25    # 0.1 mm to the workpiece at 5 um a step, and the lag
    assert not truncated
    assert "alarm" not in info
    assert observation[AT["z_um"]] == pytest.approx(-2, abs=5)
    environment.steps = 2
    environment.reset(seed=1)
    environment.bench.set("force.estop", 1)
    *_, ended, truncated, info = environment.step([0, -1])
    assert (ended, truncated) == (True, False)
    assert "emergency stop" in info["alarm"]
    environment.reset(seed=1)
    assert [environment.step([0, -1])[2:4] for _ in range(2)] == [(False, False), (False, True)]


def test_environments_that_cannot_be_are_refused(sinking):
    for name, said, values in (
            ("depth_mm", "0.0001 to 1000", (0, -1, NAN, 1e9)),
            ("steps", "a whole number from 1 to 1000000000", (0, 1.5, NAN, INF)),
            ("damage_um", "0 to 1000000", (-1, NAN, INF))):
        for value in values:
            with pytest.raises(ValueError, match=f"^{name} must be {said}, not {value}$"):
                sinking(**{name: value})
        with pytest.raises(TypeError, match=f"^{name} must be a number, not 'x'$"):
            sinking(**{name: "x"})
    with pytest.raises(TypeError, match=r"^machine must be a text, not 3$"):
        sinking(machine=3)
    with pytest.raises(UsageError, match="of the kind wire, and sinks nothing"):
        sinking(machine="wire")
    with pytest.raises(UserError, match=r"call reset\(\) first"):
        sinking().step([0, 0])
    with pytest.raises(NotImplementedError, match="draws no pictures: make it with trace=True"):
        sinking().render()


def test_an_action_that_cannot_be_is_refused_at_once(sinking):
    environment = sinking(steps=1)
    environment.reset(seed=1)
    clock = environment.bench.clock
    for action in ([NAN, 0], np.array([0, INF], np.float32), [0], 0, None, [0, 0, 0], ["a", 0],
                   ["1", "0"], [[0, 0]], [[0], [0, 1]], {}, [True, False]):
        with pytest.raises(ValueError, match=r"^an action must be two finite numbers, motion and "):
            environment.step(action)
    assert environment.bench.clock == clock
    # None of them was a step.
    assert environment.step((0, -1))[2:4] == (False, True)


def test_after_its_end_an_episode_needs_a_reset(sinking):
    environment = sinking(steps=1)
    for force, over in ((None, (False, True)), ("force.estop", (True, True))):
        environment.reset(seed=1)
        if force:
            environment.bench.set(force, 1)
        assert environment.step([0, -1])[2:4] == over
        clock = environment.bench.clock
        with pytest.raises(ResetNeeded, match=r"^the episode is over: call reset\(\) first$"):
            environment.step([0, -1])
        assert environment.bench.clock == clock


def test_a_step_does_what_its_bytes_do_natively():
    cost = step_cost(12)
    assert cost.ends[0] == cost.ends[1]
    assert cost.environment_s > 0
    assert cost.native_s > 0
