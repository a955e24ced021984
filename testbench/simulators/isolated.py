# SPDX-License-Identifier: Apache-2.0
"""A test in a process of its own, in which cocotb can run once.

cocotb ends Python when its simulation ends, and a process can hold one simulation. So a test that
simulates a block runs as a whole in a fork of pytest's process: what its benches collect is there
when its last lines look at it. The test has a thread; cocotb has the main one. When the test calls
for the simulation, the main thread starts it and hands back what the benches returned; then it
waits for the end of the test inside the simulation, and leaves before cocotb ends Python.
"""

import ctypes
import faulthandler
import math
import os
import pickle
import queue
import select
import signal
import sys
import threading
import traceback
import types
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cocotb
import cocotb_tools.config
import find_libpython

from testbench.simulators.emitted import TOP, Emitted, library
from testbench.simulators.engine import Engine

__all__ = ["DiedError", "Simulator", "isolated", "portable"]

MODULE = "testbench_of_a_block"   # where cocotb finds its one test
WALL_S = 900                      # of one test, real time


class DiedError(RuntimeError):
    """The process of a test has ended, or has not ended, without saying how the test went."""


@dataclass
class Job:
    """A simulation that the test asks for; ``apart``: in another process than the test."""

    emitted: Emitted
    library: Path
    benches: tuple
    deadline: float
    apart: bool


class Simulator:
    """Both ends of the simulation: the test calls ``run`` in its thread, the main one ``serve``."""

    def __init__(self, workdir: Path, *, seed: int, waves: bool):
        self.workdir = workdir
        self.seed = seed
        self.waves = waves
        self.asked: queue.Queue = queue.Queue()
        self.answers: queue.Queue = queue.Queue()
        self.ran = False
        self.log = workdir / "log.txt"

    # ---- the test's thread

    def run(self, emitted: Emitted, benches: tuple, deadline: float, *, apart=False) -> list:
        """Run benches on a design under cocotb; return what they returned.

        If ``apart``, in a process of its own: nothing comes back but what the benches return.

        Raises
        ------
        RuntimeError
            If the test's process has simulated before: cocotb can run once in a process.
        """
        if self.ran:
            raise RuntimeError("under cocotb a test can call simulate once")
        self.ran = not apart
        self.asked.put(Job(emitted, library(emitted, waves=self.waves), benches, deadline,
                           apart))
        results, error = self.answers.get()
        if error is not None:
            raise error
        return results

    def end(self) -> None:
        """The test has ended."""
        self.asked.put(None)

    # ---- the main thread

    def serve(self, leave: Callable[[], None]) -> None:
        """Simulate what the test asks for until it ends; then ``leave()``, which never returns."""
        while (job := self.asked.get()) is not None:
            if job.apart:
                try:
                    answer = forked(lambda send, job=job: self._simulate(
                        job, lambda results, error: send((results, portable(error)))),
                        self.log, wall_s=WALL_S / 2)
                except DiedError as died:
                    answer = [], died
                self.answers.put(answer)
                continue
            self._simulate(job, lambda *answer: self._to_the_end(answer, leave))
            # Only a simulator that could not start comes back.
            self.answers.put(([], DiedError(f"cocotb ran no test; see {self.log}")))
        leave()

    def _to_the_end(self, answer, leave):
        """Tell the test, and stay in the simulation until it has ended."""
        self.answers.put(answer)
        self.asked.get()
        leave()

    def _simulate(self, job: Job, done: Callable[[list, BaseException | None], None]) -> None:
        waves = self.workdir / "waves.vcd"
        # Python's lock stays held: cocotb's library takes the running interpreter as it is.
        loaded = ctypes.PyDLL(str(job.library))
        stopped = ctypes.c_int.in_dll(loaded, "stopped")
        os.environ.update({
            "GPI_USERS": f"{find_libpython.find_libpython()};"
                         f"{cocotb_tools.config.pygpi_entry_point()}",
            "PYGPI_PYTHON_BIN": sys.executable, "TOPLEVEL_LANG": "verilog",
            "COCOTB_TOPLEVEL": TOP, "COCOTB_TEST_MODULES": MODULE,
            "COCOTB_RESULTS_FILE": str(self.workdir / "results.xml"),
            "COCOTB_RANDOM_SEED": str(self.seed), "COCOTB_LOG_LEVEL": "WARNING",
            "GPI_LOG_LEVEL": "WARNING"})
        async def block(top):
            """The one test that cocotb runs."""
            results: list = []
            error = None
            warnings.simplefilter("error")      # as pytest has it; cocotb has reset the filters
            try:
                results = await Engine(job.emitted, top, lambda: stopped.value).run(
                    job.benches, deadline=job.deadline)
            except BaseException as raised:    # pytest's own are not Exceptions
                error = raised
            done(results, error)

        module = types.ModuleType(MODULE)
        block.__module__ = MODULE
        module.block = cocotb.test()(block)
        sys.modules[MODULE] = module
        words = [TOP, *(["--trace", "--trace-flush", "--trace-file", str(waves)]
                        if self.waves else [])]
        arguments = (ctypes.c_char_p * (len(words) + 1))(*(word.encode() for word in words), None)
        loaded.main(len(words), arguments)


def portable(error: BaseException | None) -> BaseException | None:
    """The exception, with its traceback as a note; if it cannot be pickled, one with its text."""
    if error is None:
        return None
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:   # pickling runs the exception's own code, which may raise anything
        told: BaseException = RuntimeError(f"{type(error).__name__}: {error}")
    else:
        told = error
    told.add_note("".join(traceback.format_exception(error)))
    return told


def forked(work: Callable[[Callable[[object], None]], None], log: Path, *, wall_s: float):
    """Run ``work(send)`` in a fork; return what it sends, which ends it.

    Raises
    ------
    DiedError
        If the process says nothing, or nothing for ``wall_s`` seconds.
    """
    inlet, outlet = os.pipe()
    with warnings.catch_warnings():
        # Other threads of this process are not there in the fork, and not missed.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        _child(work, log, outlet, wall_s)
    os.close(outlet)
    said = b""
    try:
        with os.fdopen(inlet, "rb", buffering=0) as pipe:
            while select.select([pipe], [], [], wall_s)[0] and (part := pipe.read(1 << 16)):
                said += part
    finally:
        if not said:
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
    if not said or status:
        tail = "\n".join(log.read_text(errors="replace").splitlines()[-30:])
        raise DiedError(f"the process of the test ended with status {status} and said "
                        f"{len(said)} bytes; its log ends with:\n{tail}")
    return pickle.loads(said)


def _child(work, log, outlet, wall_s):
    """What the fork does. It never returns, also if its parent is gone."""
    def send(outcome):
        ctypes.CDLL(None).fflush(None)      # what the simulator has printed
        with os.fdopen(outlet, "wb") as pipe:
            pipe.write(pickle.dumps(outcome))
        os._exit(0)

    try:
        signal.alarm(math.ceil(wall_s) + 5)
        with log.open("ab") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        sys.stdout = sys.stderr = os.fdopen(2, "w", buffering=1, closefd=False)
        faulthandler.enable(2)   # what a crash says goes to the log, too
        work(send)
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(1)


def isolated(test: Callable[[], object], simulator: Simulator, *, wall_s: float = WALL_S):
    """Run ``test()`` in a fork, with the simulator; return what it returned, as ``forked`` does."""
    def work(send):
        outcome: list = []

        def whole():
            try:
                outcome.append(test())
            finally:
                simulator.end()

        threading.Thread(target=whole, daemon=True).start()
        simulator.serve(lambda: send(outcome[0]) if outcome else os._exit(1))

    simulator.log.unlink(missing_ok=True)
    return forked(work, simulator.log, wall_s=wall_s)
