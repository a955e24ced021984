# SPDX-License-Identifier: Apache-2.0
"""An axis with feed-forward around a small drive: where it stops. On the exact model of the axis.

``test_axis.py`` holds model and gateware together.
"""

import pytest

from testbench.models.axis import Axis
from testbench.models.encoder import CYCLE
from testbench.models.supervision import Supervision

GAIN = 1678         # 50 1/s
TICK = 24           # clocks
PACE = 3.2          # pulses a tick: 10 mm/s
LAG = 128           # ticks: 4 ms, as the model of the supervision has it
GOES, RESTS = 700, 2500     # ticks


def stopped(*, ahead):
    """Go at an even pace and end at once; pulses behind at the end, and furthest beyond it."""
    axis = Axis(rest_clocks=10, supervision=Supervision())
    speed = way = command = 0.0
    count = behind = beyond = 0
    for clock in range((GOES + RESTS) * TICK):
        pace = PACE if clock < GOES * TICK else 0.0
        command += pace / TICK
        pi = int(command) - axis.counter.commanded
        axis.tick(pi=pi, forward=round(pace * 2**20 / GAIN), ahead=ahead,
                  a=CYCLE[count % 4][0], b=CYCLE[count % 4][1], tick=clock % TICK == 0, gain=GAIN)
        told = max(-32767, min(32767, axis.told))
        speed += (told * GAIN / 2**20 / TICK - speed) / (LAG * TICK)
        way += speed
        count += (way >= count + 1) - (way < count - 0.2)
        if clock == GOES * TICK:
            behind = axis.counter.error
        beyond = max(beyond, -axis.counter.error)
    assert axis.supervision.check == "none"
    assert abs(axis.counter.error) <= 10
    return behind, beyond


def test_the_axis_ends_with_its_command():
    behind, beyond = stopped(ahead=True)
    assert behind == pytest.approx(PACE * LAG, rel=0.02)    # the drive's own lag, and no more
    assert beyond <= 5


def test_without_the_lag_of_the_drive_it_would_go_beyond():
    _, beyond = stopped(ahead=False)
    assert beyond > 100
