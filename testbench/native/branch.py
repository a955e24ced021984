# SPDX-License-Identifier: Apache-2.0
"""Trials on one simulation that do not change it: each runs in a copy of the whole process.

A simulation can be neither saved nor reset to an earlier state. But the operating system copies a
process in a millisecond, with everything in it. So a state that takes a second to reach has to be
reached only once for a hundred trials.
"""

import json
import os
import traceback
import warnings
from collections.abc import Callable

__all__ = ["BranchError", "branch"]


class BranchError(RuntimeError):
    """A trial has failed; the text is its traceback."""


def branch(work: Callable[[], object]) -> object:
    """Run ``work()`` in a copy of this process; return its result, as JSON gives it back.

    Its changes of a simulation, or of anything else in memory, stay in the copy. ``work`` must not
    wait for another thread: the copy has only one.

    Raises
    ------
    BranchError
        If ``work`` raises, or the copy dies.
    """
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        # The warning is about threads that hold a lock: those of pytest and numpy, not used here.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        _work(work, reading, writing)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        said = pipe.read()
    _, status = os.waitpid(child, 0)
    if status or not said:
        raise BranchError(f"the copy of the process ended with {status}")
    good, result = json.loads(said)
    if not good:
        raise BranchError(result)
    return result


def _work(work, reading, writing):
    """Run ``work`` in the copy and end it; never returns."""
    status = 1
    try:
        os.close(reading)
        try:
            answer = [True, work()]
        except Exception:  # whatever it is, the parent raises it with its traceback
            answer = [False, traceback.format_exc()]
        with os.fdopen(writing, "wb") as pipe:
            pipe.write(json.dumps(answer).encode())
        status = 0
    finally:
        os._exit(status)
