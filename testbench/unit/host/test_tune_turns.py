# SPDX-License-Identifier: Apache-2.0
"""Turns without a stop, by which ``host.tune`` finds a drive's limit: lines that come late."""

import re
from types import SimpleNamespace

import pytest

from host.errors import UserError
from host.tune.motions import LATE_S, LEGS, TURNS, measuring, settings_of
from host.tune.tune import measured
from testbench.driven import SET, TICK_S, Machine, Real


def test_turns_that_a_slow_link_interrupts_are_left_out():
    class Slow(Machine):
        def command(self, line):
            self.run(0.08)
            super().command(line)

    machine = Slow(Real(acceleration=1000), SET)
    one = measured(machine, settings_of(machine), "Y", 1, 0.5, time_s=lambda: machine.time_s)
    assert len(one.samples) > 20
    assert not any(sample.before for sample in one.samples)


@pytest.mark.parametrize("drive", [Real(), Real(0.7, 0.05, 2e-3, 0.1)])
@pytest.mark.parametrize("seed", range(3))
def test_turns_whose_lines_come_in_time_are_all_kept(drive, seed):
    """Also if the reports still name what came before: the last turn's last part."""
    machine = Machine(drive, SET, seed)
    one = measured(machine, settings_of(machine), "Y", 1, 3.0, time_s=lambda: machine.time_s)
    turned = sum(1 for sample in one.samples if sample.before)
    # A report every 5.5 ms in the middle, but for LATE_S of each part of 0.3 s.
    assert turned > 0.8 * TURNS * (LEGS - 1) * (0.3 - LATE_S) / 0.0055


def test_turns_of_which_a_part_may_have_been_late_are_left_out():
    """The second line comes just after the first part has ended, which is not reported yet."""
    class Late(Machine):
        def send_line(self, line):
            if line.startswith(("N2 ", "N6 ", "N10 ", "N14 ")):
                while self.goals or self.command_mm != self.goal:
                    self.run(TICK_S)
                self.run(0.001)
            return super().send_line(line)

    machine = Late(Real(), SET)
    machine.rng.choice = max    # it always hears late of a block
    one = measured(machine, settings_of(machine), "Y", 1, 3.0, time_s=lambda: machine.time_s)
    assert len(one.samples) > 20
    assert not any(sample.before for sample in one.samples)


class Sends(Machine):
    """A machine whose answer to the second line of a turn comes late, or never, or is a refusal."""

    answer, late_s = "ok", 0.0

    def send_line(self, line):
        refused = line.startswith("N2 ") and self.answer not in ("ok", None)
        sent = SimpleNamespace(text=line, answer="ok") if refused else super().send_line(line)
        if line.startswith("N2 "):
            sent.answer, self.sent, self.due = None, sent, self.time_s + self.late_s
        return sent

    def poll(self, timeout_s):
        super().poll(timeout_s)
        if getattr(self, "sent", None) and self.time_s >= self.due:
            self.sent.answer = self.answer


def sends(answer, late_s=0.0):
    machine = Sends(Real(), SET)
    machine.answer, machine.late_s = answer, late_s
    with measuring(machine, SET):
        measured(machine, settings_of(machine), "Y", 1, 3.0, time_s=lambda: machine.time_s)
    return machine


def test_an_answer_that_comes_late_ends_nothing():
    assert sends("ok", 0.4).pressed == b""


@pytest.mark.parametrize(("answer", "said"), [
    ("error:9", 'the controller refuses "N2 G53 G21 G90 G94 G01 Y0.0000 F600": '),
    (None, 'the controller does not answer to "N2 G53 G21 G90 G94 G01 Y0.0000 F600".')])
def test_a_turn_that_is_not_taken_ends_the_measurement(answer, said):
    """The axis stays within its way: the other lines name places of the machine."""
    with pytest.raises(UserError, match=re.escape(said)):
        sends(answer)
    machine = Sends(Real(), SET)
    machine.answer = answer
    with pytest.raises(UserError):
        measured(machine, settings_of(machine), "Y", 1, 3.0, time_s=lambda: machine.time_s)
    machine.run(2.0)
    assert min(machine.furthest) > -0.1
    assert max(machine.furthest) < 3.1
