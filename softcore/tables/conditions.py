# SPDX-License-Identifier: Apache-2.0
"""The machining conditions that are built in: the only place where their numbers are written down.

``python -m softcore.generate`` makes the firmware's rows (``gap/built_in.h``) and the page
``docs/reference/conditions.md`` of it; the host plans with it. Plain data: imports nothing from
Amaranth.

They are for copper on steel in hydrocarbon oil with a positive electrode, from finishing to
roughing. One IP is 1.5 A (the unit of CN 1112469 A). On-times follow the usual practice of 10 us/A.
Off-times keep the duty factor between one third and two thirds. After an arc or a short the
off-time is doubled. The numbers were fixed before any tape was tuned on them. The last conditions
are for wire: short pulses with long pauses, and a negative electrode. 520 and 530 are 500 and 510
with the on-time from the ignition; their wait is half of the off-time, as the mean voltage needs it
(docs/reference/gap.md).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["CONDITIONS", "CURRENT_MAX_A", "ENTERED", "IP_MA", "LEVELS", "PLANNED", "USUAL",
           "Condition", "Voltages", "ladder", "level_max"]

IP_MA = 1500        # one IP, mA
ENTERED = 16        # conditions that can be entered beside these
PLANNED = 900       # a planned condition has the number PLANNED + IP
LEVELS = 63         # the power supply's level has 6 bits
CURRENT_MAX_A = 30  # the gateware of a machine that says nothing else lets no more through


def level_max(current_max_a: float, step_a: float) -> int:
    """Whole steps of a power supply within a current, at most ``LEVELS``: the gateware's limit."""
    return min(LEVELS, math.floor(current_max_a / step_a + 1e-9))


@dataclass(frozen=True, kw_only=True)
class Voltages:
    """Voltages and servo step of a condition that sets none of its own.

    Open voltage and the levels of an arc and a short are in V, the level of an open gap is in
    percent of the open voltage, and the servo's step is in pulses.
    """

    open_v: int
    open_percent: int
    arc_v: int
    short_v: int
    step: int


USUAL = Voltages(open_v=80, open_percent=75, arc_v=20, short_v=12, step=50)


@dataclass(frozen=True, kw_only=True)
class Condition:
    """A row: its number (C), current in 1/1000 IP, times in us, polarity of the electrode.

    ``rest_us`` is added to the off-time after an arc or a short. With ``from_ignition`` the on-time
    counts from the ignition, and the pulse waits for it for up to ``wait_us``, or without it for as
    long as the on-time.
    """

    number: int
    milli_ip: int
    on_us: int
    off_us: int
    rest_us: int
    negative: bool = False
    from_ignition: bool = False
    wait_us: int = 0


CONDITIONS: tuple[Condition, ...] = (
    Condition(number=100, milli_ip=1000, on_us=15, off_us=25, rest_us=25),
    Condition(number=110, milli_ip=2000, on_us=30, off_us=30, rest_us=30),
    Condition(number=120, milli_ip=4000, on_us=60, off_us=40, rest_us=40),
    Condition(number=130, milli_ip=6000, on_us=100, off_us=50, rest_us=50),
    Condition(number=140, milli_ip=9000, on_us=150, off_us=75, rest_us=75),
    Condition(number=150, milli_ip=12000, on_us=200, off_us=100, rest_us=100),
    Condition(number=500, milli_ip=8000, on_us=5, off_us=40, rest_us=40, negative=True),
    Condition(number=510, milli_ip=2000, on_us=3, off_us=30, rest_us=30, negative=True),
    Condition(number=520, milli_ip=8000, on_us=5, off_us=40, rest_us=40, negative=True,
              from_ignition=True, wait_us=20),
    Condition(number=530, milli_ip=2000, on_us=3, off_us=30, rest_us=30, negative=True,
              from_ignition=True, wait_us=15),
)


def ladder(table: Iterable[Condition] = CONDITIONS) -> tuple[tuple[int, int, int, int], ...]:
    """Current (IP), number, on- and off-time (us) of the conditions for planned roughing.

    Their electrode is positive, their currents are whole IP and ascend.
    """
    return tuple((row.milli_ip // 1000, row.number, row.on_us, row.off_us)
                 for row in table if not row.negative)
