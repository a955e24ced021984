# SPDX-License-Identifier: Apache-2.0
"""On-times from the ignition over many pulses: gateware and exact models, each closed over a gap.

Compiled, as Amaranth's simulator would take hours for a million pulses.
"""

from collections import deque

import numpy as np
import pytest

from testbench.models.discriminator import OK, OPEN, Discriminator, Rules
from testbench.models.pulse_generator import PulseGenerator
from testbench.native.from_ignition import BACK, OUT, PULSE, compiled

NEVER = 1 << 20     # as a delay: longer than every pulse
# A pulse whose comparators are looked at for so long after it would be seen in the next one.
LEAST_OFF = OUT + BACK + 2
ALL_ON = dict(enable=1, live=0)
CASES = "none", "first", "second", "last", "too late", "blanking", "anywhere"


def random_pulses(rng, count):
    """Rows of ``PULSE``, and the case that each one is."""
    rows, cases = [], []
    for _ in range(count):
        blanking = rng.randrange(5, 9)
        wait = rng.randrange(blanking + 1, 24)
        case = rng.choice((*CASES, "anywhere", "anywhere"))
        last = wait - 1 - OUT - BACK    # the generator gets it in the last clock of the wait
        delay = {"none": NEVER, "first": 0, "second": 1, "last": last, "too late": last + 1,
                 "blanking": blanking - BACK + rng.randrange(-1, 2),
                 "anywhere": rng.randrange(24)}[case]
        rows.append((rng.randrange(1, 12), wait, rng.randrange(LEAST_OFF, LEAST_OFF + 4), blanking,
                     rng.randrange(2), delay))
        cases.append(case)
    return np.array(rows), np.array(cases)


def modelled(pulses):
    """The same as ``compiled``, clock by clock by the exact models."""
    generator, judge = PulseGenerator(), Discriminator()
    pin, seen, found = 0, deque([(0, 0)] * BACK), []
    for row in pulses.tolist():
        one = dict(zip(PULSE, row, strict=True))
        delay, rules = one["delay"], Rules(
            blanking=one["blanking"], use_current=one["use_current"], from_ignition=1)
        asked = {name: one[name] for name in ("on_time", "wait_time", "off_time")} | dict(
            sensing=0, off_extra=0, sense_on=1, sense_off=1, level=0, cut=0, abnormal=0)
        length = burnt = 0
        over = False
        while not over:
            over = length and not pin
            lit = int(pin and length >= delay)
            length += pin
            burnt += lit
            high, current = seen.popleft()
            seen.append((int(pin and not lit), lit))
            sample, *_ = judge.clock(on=pin, sense=0, rules=rules, high=high, current=current)
            on, *_ = generator.outputs(**ALL_ON)
            generator.edge(**ALL_ON, **asked, ignited=judge.ignited)
            pin = on
        found.append((length, burnt, sample.kind if sample else 4))
    return np.array(found)


@pytest.mark.parametrize("count", [
    4000, pytest.param(1_000_000, marks=pytest.mark.soak)], ids=["short", "long"])
def test_every_on_time_is_exact_to_the_clock(rng, count):
    """Random delays, none, at the last clock of the wait and next to it, at the blanking's end.

    From the pin's clock of the ignition to its last one: the on-time, and the delay of the pads.
    Both comparators of the ignition, on-times from 1 clock on.
    """
    pulses, cases = random_pulses(rng, count)
    found = compiled(pulses)
    wrong = np.flatnonzero((found != modelled(pulses)).any(axis=1))
    assert not wrong.size, (wrong.size, pulses[wrong[0]], found[wrong[0]])

    # Without the models: what the contract says of each of them.
    one = dict(zip(PULSE, pulses.T, strict=True))
    length, burnt, kind = found.T
    ends = one["delay"] + OUT + BACK    # the generator's clock in which it would get the ignition
    quick = (one["delay"] == 0) & (one["use_current"] == 0)
    # A voltage that never rose ignites at the end of the blanking.
    ends[quick] = np.maximum(one["blanking"][quick], BACK) + OUT
    lit = ends < one["wait_time"]
    assert (length[lit] == (ends + one["on_time"])[lit]).all()
    steady = lit & ~quick
    assert (burnt[steady] == one["on_time"][steady] + OUT + BACK).all()
    assert (length[~lit] == one["wait_time"][~lit]).all()
    # The discriminator still sees the clock after the generator's last one.
    assert (kind == np.where(ends <= one["wait_time"], OK, OPEN)).all()
    assert (length < one["wait_time"] + one["on_time"]).all()

    assert set(CASES) == set(cases)
    assert min(np.count_nonzero(lit & (cases == case)) for case in CASES
               if case not in ("none", "too late")) > count // 30
    assert np.count_nonzero(lit & (ends == one["wait_time"] - 1)) > count // 20
    assert not lit[cases == "none"].any()
    assert not lit[(cases == "too late") & ~quick].any()
    print(f"{count} pulses, {np.count_nonzero(steady)} burnt for the on-time, "
          f"{np.count_nonzero(~lit)} ended with the wait, {length.sum()} clocks")
