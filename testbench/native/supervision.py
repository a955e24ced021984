# SPDX-License-Identifier: Apache-2.0
"""The supervision of a coder as compiled code, with its inputs of every clock in a table."""

import ctypes
from functools import cache

import numpy as np

from rtl.motion.supervision import Supervision
from testbench.native.build import HERE
from testbench.native.component import component_library

__all__ = ["INPUTS", "compiled"]

# In the order that ``supervision.cpp`` takes them in.
INPUTS = ("tick", "gain", "size", "negative", "standing", "resting", "fp", "fp_reverse", "a", "b",
          "coarse", "on", "clear")


@cache
def _library():
    return component_library(Supervision(), HERE / "supervision.cpp")


def compiled(inputs) -> np.ndarray:
    """The finding by clock from reset on; ``inputs`` has a row of ``INPUTS`` for each clock."""
    inputs = np.ascontiguousarray(inputs, dtype=np.int32)
    outputs = np.empty(len(inputs), dtype=np.uint8)
    _library().supervision_run(ctypes.c_uint64(len(outputs)),
                               inputs.ctypes.data_as(ctypes.c_void_p),
                               outputs.ctypes.data_as(ctypes.c_void_p))
    return outputs
