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
WINDOW, WIDEST = 15, 63     # pulses within which an axis is in position, and may stand still


def stopped(*, ahead, offset=0, friction=0, made_up=True):
    """Go at an even pace and end at once; pulses behind then, furthest beyond it, and at rest.

    The drive's offset and friction are in pulses of Er; the axis makes up for them, or not.
    """
    beside = dict(offset=-offset, friction=friction) if made_up else {}
    axis = Axis(rest_clocks=10, supervision=Supervision())
    speed = way = command = 0.0
    count = behind = beyond = 0
    for clock in range((GOES + RESTS) * TICK):
        pace = PACE if clock < GOES * TICK else 0.0
        command += pace / TICK
        pi = int(command) - axis.counter.commanded
        axis.tick(pi=pi, forward=round(pace * 2**20 / GAIN), ahead=ahead,
                  a=CYCLE[count % 4][0], b=CYCLE[count % 4][1], tick=clock % TICK == 0, gain=GAIN,
                  window=WINDOW if made_up else WIDEST, resting=not pace, **beside)
        told = max(-32767, min(32767, axis.sent)) + offset
        speed += (told * GAIN / 2**20 / TICK - speed) / (LAG * TICK)
        slower = friction * GAIN / 2**20 / TICK / (LAG * TICK)
        speed -= max(-slower, min(slower, speed))
        way += speed
        count += (way >= count + 1) - (way < count - 0.2)
        if clock == GOES * TICK:
            behind = axis.counter.error
        beyond = max(beyond, -axis.counter.error)
    assert axis.supervision.check == "none"
    return behind, beyond, abs(axis.counter.error)


def test_the_axis_ends_with_its_command():
    behind, beyond, rest = stopped(ahead=True)
    assert rest <= 10
    assert behind == pytest.approx(PACE * LAG, rel=0.02)    # the drive's own lag, and no more
    assert beyond <= 5


def test_without_the_lag_of_the_drive_it_would_go_beyond():
    _, beyond, _ = stopped(ahead=False)
    assert beyond > 100


@pytest.mark.parametrize(("offset", "friction"), [(30, 0), (-14, 40), (0, 63), (300, 200)])
def test_offset_and_friction_of_the_drive_are_made_up_for(offset, friction):
    behind, beyond, rest = stopped(ahead=True, offset=offset, friction=friction)
    assert behind == pytest.approx(PACE * LAG, rel=0.03)
    assert beyond <= 8
    assert rest <= WINDOW


def test_without_that_the_axis_comes_to_rest_beside_its_place():
    """An offset shows in full; friction holds the axis as far away as it likes."""
    assert stopped(ahead=True, offset=30, made_up=False)[2] == pytest.approx(30, abs=8)
    behind, _, rest = stopped(ahead=True, friction=45, made_up=False)
    assert behind > PACE * LAG + 25
    assert rest > 30
