# SPDX-License-Identifier: Apache-2.0
"""The campaign: its table is complete, its judgement is right, and a short form of it runs."""

import json
from dataclasses import replace
from functools import partial

import pytest

from host.machines import machine as machines
from testbench.cosim.job import Data, Job, program
from testbench.faults import campaign, page
from testbench.faults.cases import Check, Scene, Trial
from testbench.faults.flips import GUARDED, Flips
from testbench.faults.outcome import LIED, MISPLACED, Found, Outcome, Seen, away, judge
from testbench.faults.stops import STOPS, Figure
from testbench.faults.table import CLASSES, FaultClass
from testbench.faults.trials import run_trials
from testbench.faults.witness import Told, Witness
from testbench.native.branch import BranchError, branch
from testbench.native.probes import PROBES
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
# Cases of the short form: those that no other test of `make test` runs.
SHORT = ("F5", "F6", "F7", "C16", "C19")
SHORT_CASES = {"eight settings that guard, M03 on and in a cut", "Ctrl-X in a cut",
               "supply gone for 1 clocks", "nobody presses `arm`", "any phase",
               "a frame torn in two"}
HEARD = "[E:alarm,809532,7,0,0,-99,140,it is broken, and safe]\r\nALARM:140\r\n"


def seen(**other):
    """A machine that has stopped as it should, after 5 clocks."""
    return Seen(**{"clocks": 5, "burns": False, "moves": False, "lied": False,
                   "true": [0.4, 10.2, -3.0], "told": Told("Alarm", [0, 10, -3], False),
                   "said": HEARD, "away_um": 2.0} | other)


def test_there_are_ten_findings_and_22_classes():
    assert [one.number for one in CLASSES] == [f"F{n}" for n in range(1, 11)] + [
        f"C{n}" for n in range(1, 23)]
    for one in CLASSES:
        assert one.cases or one.lacks, one.number
        assert one.cases or one.number == "C15", "only the clock cannot be hurt"
        assert all(case.expected and Outcome.WRONG not in case.expected for case in one.cases)


@pytest.mark.parametrize(("other", "outcome", "why"), [
    ({}, Outcome.SAFE_TOLD, "it is broken, and safe"),
    ({"said": "[MSG:stopped]"}, Outcome.SAFE_TOLD, "stopped"),
    ({"said": "ok\r\n"}, Outcome.SAFE_UNTOLD, "not a word"),
    ({"said": "Grbl 1.1h", "told": Told("Alarm", [0, 0, 0], True)}, Outcome.SAFE_TOLD,
     "it has started anew"),
    ({"clocks": 7}, Outcome.WRONG, "safe after 7 clocks, 6 allowed"),
    ({"lied": True}, Outcome.WRONG, "an output was on while it told that all were safe"),
    ({"away_um": 301.0}, Outcome.WRONG, "301 um from its way"),
    ({"told": Told("Alarm", [0, 12, -3], False)}, Outcome.WRONG, MISPLACED),
    ({"told": Told("Alarm", [0, 12, -3], True)}, Outcome.SAFE_TOLD, "it is broken, and safe"),
    ({"told": None}, Outcome.SAFE_TOLD, "it is broken, and safe"),
    ({"told": None, "clocks": None}, Outcome.WRONG, "it does not answer, and its outputs are on"),
    ({"clocks": None, "told": Told("Idle", [0, 10, -3], False), "said": ""}, Outcome.NO_EFFECT,
     "as without the fault"),
    ({"clocks": None, "told": Told("Idle", [0, 10, -3], False), "true": [0.4, 10.2, -3.0],
      "said": "", "target": [5.0, 10.0, -3.0]}, Outcome.SAFE_UNTOLD, "it stands, without a word"),
    ({"clocks": None, "moves": True, "told": Told("Idle", [0, 10, -3], False)}, Outcome.WRONG,
     "it moves on"),
    ({"clocks": None, "moves": True, "true": [3000.0, 10.0, -3.0], "said": ""}, Outcome.WRONG,
     "it moves on"),
    ({"clocks": None, "burns": True}, Outcome.WRONG, "it burns on, and gets nowhere"),
    ({"clocks": None, "burns": True, "told": Told("Idle", [0, 12, -3], False)}, Outcome.WRONG,
     "it burns on, and gets nowhere"),
])
def test_the_judge_calls_it_what_it_is(other, outcome, why):
    target = other.pop("target", [0.0, 10.0, -3.0])
    found = judge(seen(**other), 6, target)
    assert found.outcome is outcome
    assert found.why.startswith(why)


def test_behind_on_the_way_is_not_away_and_ahead_of_it_is():
    way = [[10.0 * step, 0.0, 0.0] for step in range(6)]
    assert away(way, way) == 0
    assert away([[20.0, 0.0, 0.0]] * 3, way) == 0
    assert away([[40.0, 0.0, 0.0]] * 3, way) == 1
    assert away([[30.0, 0.0, -70.0]] * 3, way) == 7


def test_a_branch_changes_nothing_and_hands_over_what_it_finds():
    one = [1]
    assert branch(lambda: (one.append(2), len(one))[1]) == 2
    assert one == [1]
    with pytest.raises(BranchError, match="no such thing"):
        branch(lambda: one.index("no such thing"))


def _faked(session, pin):
    """An output stays on although all are reported safe: only an invented record has this."""
    session.set("force.estop", 1)
    session.run(1000)
    session.changes()
    if pin:
        session.pins.extend([(session.cycle, pin, 1), (session.cycle + 5, pin, 0)])


@pytest.mark.parametrize("pin", ["", "gap_on", "drive_enable"])
def test_an_output_that_is_on_while_safe_is_told_is_wrong(pin):
    found, = Scene("faked", partial(_faked, pin=pin)).run(1)
    assert found.outcome is (Outcome.WRONG if pin else Outcome.SAFE_TOLD)


def test_trials_without_a_fault_have_no_effect_and_are_the_same_again():
    trials = [Trial("nothing", lambda job, rng: None, None)]
    first, again = (run_trials(trials, 3) for _ in range(2))
    assert first == again
    assert [one.outcome for one in first[0][1]] == [Outcome.NO_EFFECT]


def test_an_unknown_class_is_refused():
    assert [one.number for one in campaign.chosen(["c3", "stuck"])] == ["C3", "C10", "C11"]
    with pytest.raises(ValueError, match="there is no class 'F11'"):
        campaign.chosen(["F11"])


def _broken_case():
    raise RuntimeError("it cannot begin")


def test_results_and_page_tell_of_everything(tmp_path):
    """A class that is good, one that is wrong, one that did not run, one without cases."""
    def check(name, *found, expected=(Outcome.SAFE_TOLD,)):
        return Check(name, lambda: found[0], expected)

    classes = [
        FaultClass("F1", "good one", "i", "w", "m",
                   (check("a", Found(Outcome.SAFE_TOLD, 1234, "as it should")),)),
        FaultClass("F2", "bad one", "i", "w", "m",
                   (check("b", Found(Outcome.WRONG, None, "<off> its way")),)),
        FaultClass("F3", "no run", "i", "w", "m", (Check("c", _broken_case),)),
        FaultClass("F4", "none", "", "w", "m", lacks="no hand is long enough")]
    done = campaign.run(classes, 1)
    assert [one.good for one in done] == [True, False, False, True]
    campaign.write(done, 1, tmp_path)
    data = json.loads((tmp_path / "results.json").read_text())
    assert [one["good"] for one in data["classes"]] == [True, False, False, True]
    assert data["classes"][0]["cases"][0]["found"] == [
        {"outcome": "safe with reason", "clocks": 1234, "why": "as it should"}]
    text = page.render(done, [Figure(STOPS[0], (5, 6))], 1, Flips((
        Found(Outcome.WRONG, None, "soc.controller.path.z bit 3: gone"),)))
    for words in ("as it should", "&lt;off&gt; its way", "did not run", "it cannot begin",
                  "no hand is long enough", "1\u202f234", STOPS[0].name, "not every outcome",
                  "soc.controller.path.z bit 3: gone"):
        assert words in text, words
    assert "http" not in text.replace("http-equiv", "")


def _short():
    for one in CLASSES:
        if one.number in SHORT:
            cases = tuple(replace(case, count=1) if isinstance(case, Trial) else case
                          for case in one.cases if case.name in SHORT_CASES)
            assert cases, one.number
            yield FaultClass(one.number, one.name, one.injected, one.where, one.must, cases)


@pytest.mark.parametrize("fault", list(_short()), ids=lambda one: one.number)
def test_short_form(fault):
    one, = campaign.run([fault], 1)
    assert one.good, [(result.case.name, result.failure, result.found) for result in one.results]


@pytest.mark.soak
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("fault", CLASSES, ids=lambda one: one.number)
def test_campaign(fault, seed):
    one, = campaign.run([fault], seed)
    assert one.good, [(result.case.name, result.failure, result.found) for result in one.results]


def test_a_witness_notes_what_is_done_to_it():
    with Witness(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1) as session:
        job = Job(session, watched=("safe",))
        assert session.begun is None
        job.start(program(Data(), "G01 Z0.05 F600"))
        job.finish()
        assert session.pins.rises("gap_on")
        assert session.begun is None
        session.run(400_000)        # the axis comes to rest
        session.set("force.estop", 1)
        assert session.deeds == [(session.cycle, "force.estop = 1")]
        session.run(100_000)
        assert session.told() == Told("Alarm", [0, 0, -500], False)
        assert "emergency stop" in session.said(session.begun)


def test_flips_are_counted_by_part():
    found = tuple(Found(outcome, None, f"{name} bit 3: why") for outcome, name in (
        (Outcome.NO_EFFECT, "soc.cpu.core.x"), (Outcome.NO_EFFECT, "soc.controller.short.y"),
        (Outcome.WRONG, "soc.controller.path.z"), (Outcome.NO_EFFECT, "soc.uart.q")))
    flips = Flips(found)
    assert flips.parts == {"gateware": {Outcome.NO_EFFECT: 2, Outcome.WRONG: 1},
                           "processor": {Outcome.NO_EFFECT: 1}}
    assert flips.wrong == ["soc.controller.path.z bit 3: why"]
    assert not flips.good


@pytest.mark.parametrize(("wrong", "good"), [
    ([], True), ([MISPLACED], True), ([MISPLACED] * 2, True), ([MISPLACED] * 3, False),
    (["410 um from its way"], False), ([LIED, MISPLACED], False)])
def test_few_flips_may_end_at_another_place_and_none_may_run_away(wrong, good):
    found = [Found(Outcome.NO_EFFECT, None, "soc.x bit 1: why")] * (400 - len(wrong))
    found += [Found(Outcome.WRONG, None, f"soc.y bit 2: {why}") for why in wrong]
    assert Flips(tuple(found)).good == good


@pytest.mark.parametrize(("name", "outcome", "why"), [
    ("soc.controller.motion.path.offset", Outcome.WRONG, MISPLACED),    # none of the guarded ones
    ("memory, data 0x100", Outcome.SAFE_UNTOLD, "not a word"),          # memory stops with a word
    ("memory, data 0x100", Outcome.WRONG, MISPLACED)])                  # one of few of its own kind
def test_what_a_register_may_a_guarded_one_and_the_memory_may_not(name, outcome, why):
    borne = [Found(Outcome.NO_EFFECT, None, f"{place} bit 1: why")
             for place in ["soc.x"] * 300 + ["memory, code 0x4"] * 100]
    other = Found(Outcome.WRONG, None, f"soc.y bit 2: {MISPLACED}")
    assert Flips((*borne, other)).good
    assert not Flips((*borne, Found(outcome, None, f"{name} bit 2: {why}"))).good


def test_guarded_registers_have_the_names_of_the_netlist():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        names = {name for name, _ in session.state()}
    guarded = {name for name in names if GUARDED.match(f"{name} bit 0")}
    paths = {probe.name: ".".join(probe.path[1:]) for probe in PROBES if probe.scope}
    tried = {paths[name] for name in ("guard_command", "window_offset", "window_parity",
                                      "guard_apart", "latch_double")}
    assert tried <= guarded < names
    assert {f"soc.registers.axis_{axis}_low_parity" for axis in "xyz"} <= guarded


def test_a_bit_of_a_register_turns_over():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        names = [name for name, _ in session.state()]
        assert len(names) > 900
        session.run(1000)
        command = session.probe("guard_command")
        at, = (index for index, name in enumerate(names)
               if name.endswith("axis_z.error_counter.command_then"))
        session.turn_over(at, 7)
        assert session.probe("guard_command") == command ^ 1 << 7
