# SPDX-License-Identifier: Apache-2.0
"""Trying things on one simulation without changing it: each in a copy of the whole process.

A simulation can neither be saved nor set back. The operating system copies a process in a
millisecond, with everything that is in it; so a state that takes a second to reach is reached once
for a hundred trials.
"""

import json
import os
import traceback
import warnings
from collections.abc import Callable

__all__ = ["BranchError", "branch"]


class BranchError(RuntimeError):
    """What was tried has failed; the text is its traceback."""


def branch(work: Callable[[], object]) -> object:
    """Run ``work()`` in a copy of this process; return its result, as JSON gives it back.

    Nothing that it does to a simulation, or to anything else in memory, is seen here. It must not
    wait for another thread: the copy has one only.

    Raises
    ------
    BranchError
        If it raises, or the copy dies.
    """
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        # Of threads that hold a lock just then: those of pytest and numpy, which are not used.
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
    """The copy's part; it does not return."""
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
