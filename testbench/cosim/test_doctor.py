# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper doctor`` on the simulated machine, sound and with each of many wrong wires."""

import re
import signal
import time
from _thread import interrupt_main

import pytest

from host.doctor.command import examine
from host.doctor.complaints import place
from host.doctor.doctor import HOME_FIRST, UNCHECKED
from host.link.link import fields_of
from host.machines import machine as machines
from host.run import simulation
from softcore.build import BOARDS
from testbench.cosim.examination import AXES, BOOTED_S, GUARDS, examined, of
from testbench.live import serving

SINKER = machines.load("sinker")
SHORT, CURRENT, ARC, OPEN = 1, 2, 4, 8  # bits of force.comparator_cut and force.comparator_dead
MAIN, SENSING, SHORTED = 1, 2, 3    # force.gate_stuck
GAP = {"gap_current", "gap_short", "gap_on", "gap_sense"}   # of a gap that is not at rest

# Wrong wires: the force that plants one, its value, and the wires that must be named.
WRONG = [
    ("estop", 1, {"estop"}),
    *((f"{name}", 1 << axis, {f"{name}[{axis}]"})
      for name in ("drive_fault", "limit_low", "limit_high") for axis in range(3)),
    ("fluid_low", 1, {"fluid_low"}),
    ("fin", 1, {"fin"}),
    ("converter_silent", 1, {"adc_select", "adc_clock", "adc_command", "adc_data"}),
    ("comparator_cut", CURRENT, {"gap_current", "gap_on", "gap_sense"}),
    ("comparator_cut", SHORT, {"gap_short", "gap_sense"}),
    ("comparator_dead", SHORT, {"gap_short", "gap_reference[2]"}),
    *((f"comparator_{how}", ARC, {"gap_arc", "gap_reference[1]"}) for how in ("cut", "dead")),
    *((f"comparator_{how}", OPEN, {"gap_high", "gap_reference[0]"}) for how in ("cut", "dead")),
    *(("reference_cut", 1 << bit, {pad, f"gap_reference[{bit}]"})
      for bit, pad in enumerate(("gap_high", "gap_arc", "gap_short"))),
    *(("gate_stuck", how, GAP) for how in (MAIN, SHORTED)),
    ("gate_stuck", SENSING, {"gap_on", "gap_sense"}),
    *((f"encoder_{phase}_{level}", 1 << axis, {f"enc_{phase}[{axis}]"})
      for phase in "ab" for level in ("low", "high") for axis in range(3)),
    *((f"encoder_{how}", 1 << axis, {f"enc_a[{axis}]", f"enc_b[{axis}]"})
      for how in ("cut", "open") for axis in range(3)),
    *(("encoder_swap", 1 << axis, {f"enc_a[{axis}]", f"enc_b[{axis}]", f"dac_negative[{axis}]"})
      for axis in range(3)),
    *(("reference_swap", number, {pad for bit in pair for pad in (
        ("gap_high", "gap_arc", "gap_short")[bit], f"gap_reference[{bit}]")})
      for number, pair in ((1, (0, 1)), (2, (0, 2)), (3, (1, 2)))),
]
# In ``make test``; an examination takes 10 CPU seconds.
QUICK = {("encoder_b_low", 2)}


@pytest.fixture(autouse=True)
def ctrl_c():
    """Ctrl-C ends an examination, also where the tests run in the background, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)



def test_enough_wrong_wires_are_planted():
    assert len({(force, value) for force, value, _ in WRONG}) == len(WRONG) >= 20


def test_a_sound_machine_has_nothing_wrong():
    found = examined()
    assert found.wrong == []
    assert found.of(True) == {
        "link", "identity", "firmware", "gateware", "quality of the link", "memory", "gap at rest",
        "estop", "drive_fault", "limit_low", "limit_high", "fluid_low", "at rest", "arm",
        "at rest, armed", "contactor", "axis X", "axis Y", "axis Z", "comparators", "fin answers",
        "end"}
    assert [question.split()[1] for question in found.asked] == [
        *4 * ["can"], "main", "X", "Y", "Z", "(fluid"]
    assert "closed: no emergency stop" in found.report
    assert all(what in found.report for what, _ in UNCHECKED)
    assert "[SCOPE" not in found.report
    assert not found.armed
    assert "Armed" not in found.status
    assert "taken over as it stands" in found.asked[5]
    assert not any("taken over" in question for question in found.asked[6:])
    # The sensing source gives 24 V of the 100 V that are full scale.
    swept = next(str(one) for one in found.findings if one.check == "comparators")
    assert 23.5 < float(re.search(r"the converter reads ([\d.]+) %", swept)[1]) < 24.5
    assert HOME_FIRST in found.report


def open_guard(wire):
    """Force and value that open a guard."""
    pad, _, bit = wire.rstrip("]").partition("[")
    return pad, 1 << int(bit or 0)


@pytest.mark.soak
def test_guards_are_opened_by_hand_and_a_stuck_or_exchanged_one_is_named():
    """Of eleven, one is stuck closed, and two are exchanged."""
    stuck, pair = "fluid_low", {"limit_low[1]": "limit_high[1]", "limit_high[1]": "limit_low[1]"}
    sent = bytearray()
    found = examined(hand=lambda wire: None if wire == stuck else open_guard(
        pair.get(wire, wire)), meddle=lambda simulated, data: (sent.extend(data), data)[-1])
    assert found.of(True) >= {f"{wire} opened" for wire in GUARDS if wire not in (stuck, *pair)}
    wrong = {one.check: one for one in found.findings if one.ok is False}
    assert set(wrong) == {f"{wire} opened" for wire in (stuck, *pair)}
    assert {"axis X", "axis Y", "axis Z"} <= found.of(None), "a guard that is wrong lets none move"
    assert "arm" not in found.of(True)
    assert [str(one) for one in wrong[f"{stuck} opened"].places] == [of(stuck)]
    for wire, other in pair.items():
        assert [str(one) for one in wrong[f"{wire} opened"].places] == [of(wire), of(other)]
    assert "estop" in found.of(True), "closed again"
    assert not {"limit_low", "limit_high", "fluid_low"} & found.of(True), "not ok and wrong at once"
    assert b"$INPUTS" in sent
    assert b"$X" not in sent, "nothing is unlocked"
    assert not found.armed


@pytest.mark.soak
def test_guards_that_nobody_opens_are_told_as_not_tried():
    found = examined(arm=False, agrees="")
    assert {"estop opened", "limit_low, limit_high opened", "drive_fault opened",
            "fluid_low opened"} <= found.of(None)


@pytest.mark.parametrize("machine", [
    pytest.param(kind, marks=pytest.mark.soak) for kind in ("wire", "stepper")])
def test_a_sound_machine_of_another_kind_has_nothing_wrong(machine):
    found = examined(machine=machine, entered=True)
    assert found.wrong == []
    assert "settings" in found.of(True)
    assert not found.armed
    if machine == "wire":
        assert "axis X" in found.of(None), "the plate is in its way"
        assert "touched" in found.report
    else:
        assert {"axis X", "axis Y", "axis Z"} <= found.of(True)


@pytest.mark.soak
def test_the_wire_and_its_drive_are_the_third_drives_input():
    found = examined("drive_fault", 4, machine="wire")
    assert found.named == {of("drive_fault[2]")}
    assert "the wire" in found.report


@pytest.mark.soak
def test_nothing_moves_without_a_yes():
    found = examined(agrees="")
    assert found.of(None) >= {"axis X", "axis Y", "axis Z"}
    assert len(found.asked) == 9
    assert "G01" not in found.report
    assert HOME_FIRST not in found.report
    assert "Lost" in found.status
    assert not found.armed


@pytest.mark.soak
def test_a_doctor_that_is_broken_off_leaves_the_machine_disarmed():
    found = examined(agrees=None)
    assert found.ended == "KeyboardInterrupt"
    assert {"arm", "end"} <= found.of(True)
    assert not found.armed
    assert "Lost" in found.status, "no position is invented before a yes"


def test_ctrl_c_in_the_middle_of_a_motion_stops_it_and_disarms():
    seen, due_s = bytearray(), []

    def meddle(simulated, data):
        seen.extend(data)
        if b"X0.2" in seen and not due_s:
            due_s.append(simulated.time_s() + 0.1)
        if due_s and simulated.time_s() > due_s[0]:
            due_s[0] = float("inf")
            interrupt_main()
        return data

    found = examined(agrees="X", meddle=meddle)
    assert found.ended == "KeyboardInterrupt"
    assert "end" in found.of(True)
    assert not found.armed
    assert 0.01 < float(fields_of(found.status)["MPos"].split(",")[0]) < 0.19
    assert HOME_FIRST in found.report


@pytest.mark.soak
def test_a_coder_that_fails_on_the_way_back_is_named():
    seen = bytearray()

    def meddle(simulated, data):
        seen.extend(data)
        if b"X-0.2" in seen:
            simulated.set("force.encoder_cut", 1)
        return data

    found = examined(agrees="X", meddle=meddle)
    assert found.named == {of("enc_a[0]"), of("enc_b[0]")}
    assert "axis X" not in found.of(True)


@pytest.mark.soak
def test_a_silent_coder_that_counts_by_hand_accuses_the_drive():
    """The plug is in again when the doctor asks; a person turns the motor, an edge at a time."""
    edges = []

    def others(question, simulated):
        if "by hand" in question:
            simulated.set("force.encoder_cut", 0)
            edges.append(0)
        return True

    def meddle(simulated, data):
        if edges:
            edges[0] += 1
            for phase, behind in ("a", 1), ("b", 2):
                high = (edges[0] + 2 - behind) % 4 < 2
                simulated.set(f"force.encoder_{phase}_high", int(high))
                simulated.set(f"force.encoder_{phase}_low", int(not high))
        return data

    found = examined("encoder_cut", 1, agrees="X", others=others, meddle=meddle)
    assert found.named == {of(f"{pad}[0]") for pad in ("drive_enable", "dac", "dac_negative")}


@pytest.mark.soak
def test_a_silent_coder_that_counts_nothing_by_hand_is_at_fault():
    found = examined("encoder_cut", 1, agrees="X")
    assert any("by hand" in question for question in found.asked)
    assert found.named == {of("enc_a[0]"), of("enc_b[0]")}


@pytest.mark.soak
def test_a_silent_coder_that_nobody_turns_accuses_coder_and_drive():
    found = examined("encoder_cut", 1, agrees="X", others=lambda question, _: (
        "by hand" not in question))
    assert found.named == {of(f"{pad}[0]") for pad in (
        "enc_a", "enc_b", "drive_enable", "dac", "dac_negative")}


@pytest.mark.soak
def test_a_contactor_that_does_not_close_is_what_the_person_sees():
    found = examined(agrees="", others=lambda question, _: "contactor" not in question)
    assert found.named == {of("contactor")}
    assert "fin answers" in found.of(True)


@pytest.mark.soak
def test_without_fin_its_wire_and_the_strobes_are_named():
    found = examined("side.fin_answers", 0, agrees="")
    assert found.named == {of("fin"), *(str(place(BOARDS["ulx3s"], "chain", bit))
                                        for bit in range(3))}


@pytest.mark.soak
def test_every_open_guard_is_named_at_once():
    found = examined("limit_low", 5, others=lambda *_: pytest.fail("it asks"), agrees=None,
                     meddle=lambda simulated, data: (
        simulated.set("force.drive_fault", 2), simulated.set("force.fluid_low", 1), data)[-1])
    assert found.named == {of(wire) for wire in (
        "limit_low[0]", "limit_low[2]", "drive_fault[1]", "fluid_low")}


@pytest.mark.soak
def test_switches_of_two_ends_are_not_taken_for_a_common_wire():
    found = examined("limit_low", 1, meddle=lambda simulated, data: (
        simulated.set("force.limit_high", 2), data)[-1])
    assert found.named == {of("limit_low[0]"), of("limit_high[1]")}


# Without wires every guard is open, and the comparators' inputs are at the levels of
# constraints/machine_wires.py.
BARE = {"estop": 1, "drive_fault": 7, "limit_low": 7, "limit_high": 7, "fluid_low": 1,
        "comparator_cut": SHORT | CURRENT | ARC, "comparator_dead": OPEN}


@pytest.mark.soak
def test_a_board_without_a_wire_has_all_guards_open():
    found = examined("estop", 1, meddle=lambda simulated, data: (
        [simulated.set(f"force.{name}", value) for name, value in BARE.items()], data)[-1])
    assert found.named == {of(wire) for wire in (
        "estop", "fluid_low", "gap_current", "gap_on", "gap_sense",
        *(f"{pad}[{bit}]" for pad in ("drive_fault", "limit_low", "limit_high")
          for bit in range(3)))}
    assert not any("Axis" in question for question in found.asked)


@pytest.mark.soak
def test_ctrl_c_while_levels_are_tried_ends_the_trial():
    seen = bytearray()

    def meddle(simulated, data):
        seen.extend(data)
        if b"$LEVELS=512" in seen and b"$INPUTS" in seen[seen.find(b"$LEVELS"):] and len(stop) < 1:
            stop.append(1)
            interrupt_main()
        return data

    stop = []
    found = examined(meddle=meddle)
    assert found.ended == "KeyboardInterrupt"
    assert "end" in found.of(True), "a reset ends it"
    assert b"$X" not in seen


@pytest.mark.soak
def test_a_stop_during_the_sweep_is_told_and_nothing_else_moves():
    seen = bytearray()

    def meddle(simulated, data):
        seen.extend(data)
        if seen.count(b"$SCOPE=READ") == 2:
            simulated.set("force.drive_fault", 1)
        return data

    found = examined(meddle=meddle)
    assert found.named == {of("drive_fault[0]")}
    assert {"axis Y", "axis Z"} <= found.of(None)


@pytest.mark.soak
def test_a_gate_that_shows_only_behind_the_contactor_is_named():
    found = examined("gate_stuck", MAIN)
    assert "at rest" in found.of(True)
    assert found.named == {of(wire) for wire in GAP}


@pytest.mark.soak
def test_an_old_damaged_line_is_not_the_links_fault():
    found = examined("estop", 1, before=b"@7 G00 X1*0000\n")
    assert "quality of the link" in found.of(True)


@pytest.mark.soak
def test_a_line_damaged_during_the_examination_is():
    hit = []

    def meddle(_, data):
        if b"$G" in data and not hit:
            hit.append(data)
            return data.replace(b"$G", b"$X", 1)
        return data

    found = examined("estop", 1, meddle=meddle)
    assert hit
    assert "quality of the link" in found.of(False)


@pytest.mark.soak
def test_a_button_that_nobody_presses_is_named():
    found = examined(arm=False)
    assert found.named == {of("arm")} == {"arm at J2 GN15 (site P16)"}


@pytest.mark.parametrize(("force", "value", "wires"), [
    pytest.param(*one, marks=() if one[:2] in QUICK else pytest.mark.soak) for one in WRONG])
def test_a_wrong_wire_is_named_with_its_pin(force, value, wires):
    axes = AXES[value.bit_length() - 1] if force.startswith("encoder") else AXES
    found = examined(force, value, agrees=axes)
    assert found.named == {of(wire) for wire in wires}, found.report
    assert not found.armed


def test_the_command_writes_a_report_and_says_how_many_are_wrong(workdir):
    from io import StringIO

    from rich.console import Console
    machine = simulation.start(SINKER, clock_hz=SINKER.clock_hz, seed=1, waves=None, trace=False,
                               progress=print)
    said = StringIO()
    try:
        machine.set("force.estop", 1)
        with serving(machine, clock=machine.time_s) as (url, _):
            while machine.time_s() < BOOTED_S:
                time.sleep(0.01)
            status = examine(url, "colorlight_i9", baud=1_000_000, report=workdir / "doctor.txt",
                             console=Console(file=said, width=1000),
                             ask=lambda question: not question.startswith("Guards"))
    finally:
        machine.close()
    assert status == 1
    assert f"1 wrong; the report is {workdir / 'doctor.txt'}" in said.getvalue()
    assert "estop at P3 29 (site E2)" in (workdir / "doctor.txt").read_text()
