# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper doctor`` on the simulated machine, sound and with each of many wrong wires."""

import time

import pytest

from host.doctor.command import examine
from host.doctor.complaints import place
from host.doctor.doctor import UNCHECKED, Doctor
from host.link.port import Port
from host.machines import machine as machines
from host.run import simulation
from softcore.build import BOARDS
from testbench.live import serving

SINKER = machines.load("sinker")
BOOTED_S = 0.3
AXES = "XYZ"
SHORT, CURRENT = 1, 2       # bits of force.comparator_cut

# Wrong wires: the force that plants one, its value, and the wire that must be named.
WRONG = [
    ("estop", 1, "estop"),
    *((f"{name}", 1 << axis, f"{name}[{axis}]")
      for name in ("drive_fault", "limit_low", "limit_high") for axis in range(3)),
    ("comparator_cut", CURRENT, "gap_current"),
    ("comparator_cut", SHORT, "gap_short"),
    *((f"encoder_{phase}_{level}", 1 << axis, f"enc_{phase}[{axis}]")
      for phase in "ab" for level in ("low", "high") for axis in range(3)),
    *((f"encoder_{how}", 1 << axis, f"enc_a[{axis}]")
      for how in ("swap", "cut", "open") for axis in range(3)),
]
QUICK = {("estop", 1), ("limit_high", 4), ("encoder_b_low", 2), ("comparator_cut", CURRENT)}


def examined(force=None, value=0, *, arm=True, agrees=AXES):
    """Findings, report and questions of an examination of a machine with this force.

    The person agrees to move the axes of ``agrees``.
    """
    machine = simulation.start(SINKER, clock_hz=SINKER.clock_hz, seed=1, waves=None, trace=False,
                               progress=print)
    asked = []
    try:
        if force:
            machine.set(f"force.{force}", value)
        with serving(machine, arm=arm, clock=machine.time_s) as (url, _):
            while machine.time_s() < BOOTED_S:
                time.sleep(0.01)
            port = Port(url)
            try:
                doctor = Doctor(port, BOARDS["ulx3s"], say=print, wait_s=10.0 if arm else 0.5,
                                ask=lambda question: (
                                    asked.append(question) or question.split()[1] in agrees))
                findings = doctor.examine()
                return findings, doctor.report(), asked
            finally:
                port.close()
    finally:
        machine.close()


def named(findings):
    """Wires that findings accuse, with their pins."""
    return {str(one) for finding in findings if finding.ok is False for one in finding.places}


def of(wire):
    pad, _, bit = wire.rstrip("]").partition("[")
    return str(place(BOARDS["ulx3s"], pad, int(bit or 0)))


def test_enough_wrong_wires_are_planted():
    assert len({(force, value) for force, value, _ in WRONG}) == len(WRONG) >= 20


def test_a_sound_machine_has_nothing_wrong():
    findings, report, asked = examined()
    assert [str(one) for one in findings if one.ok is False] == []
    good = {one.check for one in findings if one.ok}
    assert good == {"link", "identity", "quality of the link", "estop", "drive_fault", "limit_low",
                    "limit_high", "at rest", "arm", "axis X", "axis Y", "axis Z"}
    assert len(asked) == 3
    assert "closed: no emergency stop" in report
    assert all(what in report for what, _ in UNCHECKED)


def test_nothing_moves_without_a_yes():
    findings, report, asked = examined(agrees="")
    left_out = {one.check for one in findings if one.ok is None}
    assert left_out >= {"axis X", "axis Y", "axis Z"}
    assert len(asked) == 3
    assert "G01" not in report


def test_a_button_that_nobody_presses_is_named():
    findings, *_ = examined(arm=False)
    assert named(findings) == {of("arm")} == {"arm at J2 GN15 (site P16)"}


@pytest.mark.parametrize(("force", "value", "wire"), [
    pytest.param(*one, marks=() if one[:2] in QUICK else pytest.mark.soak) for one in WRONG])
def test_a_wrong_wire_is_named_with_its_pin(force, value, wire):
    axes = AXES[value.bit_length() - 1] if force.startswith("encoder") else AXES
    findings, report, _ = examined(force, value, agrees=axes)
    assert of(wire) in named(findings), report
    others = {one.partition(" at ")[0].rstrip("]").partition("[")[2] for one in named(findings)}
    if "[" in wire:
        assert others == {wire.rstrip("]").partition("[")[2]}, "no other axis is accused"


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
                             console=Console(file=said, width=1000), ask=lambda question: True)
    finally:
        machine.close()
    assert status == 1
    assert f"1 wrong; the report is {workdir / 'doctor.txt'}" in said.getvalue()
    assert "estop at P3 29 (site E2)" in (workdir / "doctor.txt").read_text()
