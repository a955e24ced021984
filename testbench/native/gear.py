# SPDX-License-Identifier: Apache-2.0
"""The electronic gear as compiled code, under random pulses, for counts of many millions."""

import ctypes
from dataclasses import dataclass
from functools import cache

from rtl.motion.gear import Gear
from testbench.native.build import HERE
from testbench.native.component import component_library

__all__ = ["Found", "run"]


@dataclass(frozen=True)
class Found:
    """What ``run`` found; ``first`` is the first clock with a wrong count or time, 0 for none."""

    taken: int
    reversals: int
    clocks: int
    wrong_counts: int
    wrong_times: int
    first: int


@cache
def _library():
    return component_library(Gear(), HERE / "gear.cpp")


def run(*, n: int, m: int, pulses: int, seed: int) -> Found:
    """Take so many pulses through a gear n/m, with random reversals and times at the pins."""
    found = (ctypes.c_uint64 * len(Found.__dataclass_fields__))()
    _library().gear_run(ctypes.c_uint32(n), ctypes.c_uint32(m), ctypes.c_uint64(pulses),
                        ctypes.c_uint32(seed), found)
    return Found(*found)
