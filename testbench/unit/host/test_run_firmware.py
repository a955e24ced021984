# SPDX-License-Identifier: Apache-2.0
"""The host against the firmware itself, compiled for this computer: both ends of one link.

The machine below the firmware is a model that follows the path at once and has no time. The tests
check that both ends understand each other, byte by byte.
"""

from unittest.mock import patch

import pytest

from host.errors import UsageError
from host.link.framing import LONGEST_LINE
from host.link.link import LinkError
from host.machines.machine import Machine
from host.run.run import Run
from host.tape.codes import EIA, ISO
from host.tape.tape import encode
from testbench.piped import CLOCK_HZ, PULSES_PER_MM, Firmware
from testbench.punch import TAPES, broken

MACHINE = Machine("model", {"clock_hz": CLOCK_HZ, "pulses_per_mm": PULSES_PER_MM,
                            "initial_gap_um": 50, "removal_scale": 1, "settings": {"408": 19}})


def run(text, code=ISO, **options):
    machine = Firmware()
    job = Run(MACHINE, encode(text, code), machine, **options)
    job.execute()
    return job, machine


def names(job):
    return [event["event"] for event in job.events]


@pytest.mark.parametrize("code", [ISO, EIA], ids=lambda code: code.name)
def test_a_tape_is_run_to_its_end(code):
    text = (TAPES / "sink_shallow_deep.nc").read_text()
    job, machine = run(text, code)
    assert job.outcome == "end"
    assert names(job)[0] == "program_start"
    assert names(job)[-1] == "program_end"
    sets = [event for event in job.events if event["event"] == "retraction_set"]
    assert [event["limit"] for event in sets] == [0.5, 2.0]
    lines = text.splitlines()
    blocks = {event["line"]: event["text"] for event in job.events if event["event"] == "block"}
    assert blocks == {number: line for number, line in enumerate(lines, start=1)
                      if line.startswith("N")}
    assert job.offset["z"] == -0.05
    last = next(line for line in lines if "G00" in line)
    assert machine.positions()["z"] / PULSES_PER_MM - job.offset["z"] == pytest.approx(
        float(last.split("Z")[1]))


def test_lines_of_a_text_without_start_are_its_own():
    job, _ = run("G90\nC130 M05\nG00 Z0.04\nM02\n")
    blocks = {event["text"]: event["line"] for event in job.events if event["event"] == "block"}
    assert blocks["G00 Z0.04"] == 3


def test_data_entered_by_hand_are_in_force():
    job, _ = run("C130\nG36 L0.4\nM02", mdi=["G36 R300 L0.5 H600 E60 Q0.1"])
    by_hand, by_tape = [event for event in job.events if event["event"] == "retraction_set"]
    assert (by_hand["source"], by_hand["limit"], by_hand["speed"]) == ("mdi", 0.5, 300.0)
    assert (by_tape["source"], by_tape["limit"], by_tape["speed"]) == ("tape", 0.4, 300.0)


@pytest.mark.parametrize("name", sorted(broken()))
def test_broken_tape_ends_the_run_as_it_should(name):
    tape = broken()[name]
    machine = Firmware()
    encoded = encode("M02")
    job = Run(MACHINE, type(encoded)(tape.rows, encoded.code), machine)
    # It depends on time whether a move before the damage has begun when the damage is read.
    outcome = job.execute()
    moved = any(machine.positions().values())
    assert outcome == ("alarm" if moved else "rejected")
    assert tape.moves or not moved
    assert job.alarm["text"].startswith(f"Block {tape.block}")
    assert tape.words in job.alarm["text"]
    assert names(job)[-1] == "alarm"
    assert names(job).count("alarm") == 1


@pytest.mark.parametrize(("height", "outcome", "path"), [("0.05", "rejected", 0),
                                                         ("0.0501", "alarm", 1)])
def test_a_single_pulse_of_motion_tells_an_alarm_from_a_rejected_tape(height, outcome, path):
    """The machine stands at Z 0.05: a block to that place moves nothing."""
    job, machine = run(f"G90\nG00 Z{height}\nG04 P10\nB2\nM02")
    assert (job.outcome, machine.front()) == (outcome, path)


def test_a_shifted_frame_is_that_of_events_alone():
    job, machine = run("G90\nG00 Z0.04\nG92 Z5.\nG00 Z5.01\nM02")
    assert job.events[-1]["pos"]["z"] == 5.01
    assert job.offset["z"] == -0.05
    assert machine.positions()["z"] == 0


def test_a_frame_declared_by_hand_is_that_of_the_run():
    job, _ = run("G90\nG00 Z0.3\nM02", mdi=["G92 Z0.25"])
    assert job.events[-1]["pos"]["z"] == 0.3
    assert job.offset["z"] == -0.25


def test_a_long_line_by_hand_is_waited_for():
    job, machine = run("M02", mdi=["G04 X5.", "G00 Z2."])
    assert job.outcome == "end"
    assert machine.time_s() > 5
    assert machine.positions()["z"] == 19_500


@pytest.mark.parametrize(("line", "reason"), [
    ("G77",     "MDI, character 1: the code G77 is unknown."),
    ("G36 R0",  "MDI, character 5: R of the retraction data must be above zero."),
    ("$499=1",  "setting 499 does not exist or is out of range."),
])
def test_a_line_that_the_controller_refuses_is_a_usage_error(line, reason):
    with pytest.raises(UsageError) as caught:
        run("M02", mdi=[line])
    assert str(caught.value) == (f'the line "{line}" entered by hand is refused by the '
                                 f"controller: {reason}")


def test_an_unknown_setting_of_a_machine_is_named():
    machine = Machine("odd", MACHINE.tables | {"settings": {"499": 1}})
    with pytest.raises(UsageError, match=r"^machine odd: settings\.499 is refused by the "
                                         r"controller: setting 499 does not exist"):
        Run(machine, encode("M02"), Firmware()).execute()


def test_the_longest_line_is_what_the_controller_takes():
    """With one more character it refuses the line, however often it is sent."""
    comment = f"({'A' * (LONGEST_LINE - 2)})"
    job, _ = run("M02", mdi=[comment])
    assert job.outcome == "end"
    longer = patch("host.link.framing.LONGEST_LINE", LONGEST_LINE + 1)
    with longer, pytest.raises(LinkError, match="bad"):
        run("M02", mdi=[f"{comment} "])


def test_programmed_stop_is_resumed_by_the_host():
    job, machine = run("G90\nM00\nG00 Z0.04\nM02\n")
    assert job.outcome == "end"
    assert machine.positions()["z"] == -100
    assert "pause" not in names(job)
