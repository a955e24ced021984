# SPDX-License-Identifier: Apache-2.0
"""The session under cocotb, and the only cocotb test, which runs a scenario.

A scenario is a plain function of a ``Session``, so that it runs natively too. Here it has its own
thread, which waits while the clock runs.
"""

import ctypes
import importlib
import json
import os
from collections.abc import Iterable
from pathlib import Path

import cocotb
from cocotb.handle import Immediate
from cocotb.task import bridge, resume

from softcore.memory import parities, words_of
from softcore.top import SIMULATED_DIVISOR
from testbench.native.probes import MEMORY, PARITY, PROBES
from testbench.native.station import Session, declare
from testbench.native.waves import Writer

JOB = "GAPKEEPER_SCENARIO"  # environment variable with the file of the job (see runner.py)

NUMBER = {probe.name: index for index, probe in enumerate(PROBES)}

_POINTER, _UNSIGNED = ctypes.c_void_p, ctypes.c_uint64
_FUNCTIONS = {
    "bench_station": (_POINTER, [_UNSIGNED]),
    "bench_watch": (None, [ctypes.POINTER(ctypes.c_uint32), _UNSIGNED]),
    "bench_changes": (_UNSIGNED, []),
    "bench_changes_take": (None, [_POINTER]),
    "bench_waves": (None, [_POINTER, _UNSIGNED, _UNSIGNED, _UNSIGNED]),
    "bench_wave": (None, [ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32]),
    "bench_waves_end": (None, []),
}


def _signed(probe, value):
    return value - (1 << probe.bits) if probe.signed and value >> (probe.bits - 1) else value


class CosimSession(Session):
    """A controller in Verilator under cocotb. Make it before the first clock.

    ``byte_clocks`` is the time of a byte on the line.

    Parameters
    ----------
    bench : cocotb handle
        The top, ``bench.sv``.
    machine, clock_hz
        See ``Session``.
    seed : int
        Seed of everything random.
    waves : Path or None
        Folder for the waveforms; see ``testbench.native.waves``.
    """

    byte_clocks = 10 * SIMULATED_DIVISOR

    def __init__(self, bench, *, machine: dict, clock_hz: int, seed: int,
                 waves: Path | None = None):
        self._program = program = ctypes.CDLL(None)
        declare(program, _FUNCTIONS)
        self._bench = bench
        super().__init__(program, program.bench_station(seed), machine=machine,
                         clock_hz=clock_hz)
        self._waves = None
        if waves is not None:
            self._waves = Writer(waves, clock_hz, machine.get("kind", "sinker"))
            program.bench_waves(*self._waves.addresses())
            for one in self._waves.slices():
                program.bench_wave(*one)

    def close(self) -> None:
        """End the file of waveforms."""
        if self._waves is not None:
            self._program.bench_waves_end()
            self._waves.close(self.cycle)
            self._waves = None

    def run(self, clocks: int) -> None:
        if self._arm(clocks, False):
            self._wait()

    def receive(self, clocks: int) -> bytes:
        if self._arm(clocks, True):
            self._wait()
        return self.received()

    @resume
    async def _wait(self):
        await self._bench.stopped.value_change

    def _handle(self, path):
        handle = self._bench.controller
        for name in path[1:]:
            handle = handle[name]
        return handle

    @resume
    async def _read(self, path):
        return int(self._handle(path).value)

    @resume
    async def _write(self, path, values):
        handle = self._handle(path)
        if isinstance(values, int):
            handle.value = Immediate(values)
            return
        for index, value in enumerate(values):
            handle[index].value = Immediate(value)

    def probe(self, name: str) -> int:
        probe = self._probe(name)
        return _signed(probe, self._read(probe.path))

    def _probe(self, name):
        probe = PROBES[NUMBER[name]]
        if not probe.scope:
            raise ValueError(f"{name} belongs to the machine: read it with get()")
        return probe

    def poke(self, name: str, value: int) -> None:
        probe = self._probe(name)
        if not probe.writable:
            raise ValueError(f"{name} cannot be written")
        self._write(probe.path, value)

    def load(self, image: bytes) -> None:
        self._write(MEMORY, words_of(image))
        self._write(PARITY, parities(image))

    def watch(self, names: Iterable[str]) -> None:
        numbers = [NUMBER[self._probe(name).name] for name in names]
        self._program.bench_watch((ctypes.c_uint32 * len(numbers))(*numbers), len(numbers))

    def changes(self) -> list[tuple[int, str, int]]:
        rows = (_UNSIGNED * (3 * self._program.bench_changes()))()
        self._program.bench_changes_take(rows)
        return [(clock, PROBES[index].name, _signed(PROBES[index], value))
                for clock, index, value in zip(rows[::3], rows[1::3], rows[2::3], strict=True)]


@cocotb.test()
async def scenario(dut):
    """Run the function that the job names, and write its result."""
    job = json.loads(Path(os.environ[JOB]).read_text())
    session = CosimSession(dut, machine=job["machine"], clock_hz=job["clock_hz"], seed=job["seed"],
                           waves=job["waves"] and Path(job["waves"]))
    module, _, name = job["function"].rpartition(".")
    function = getattr(importlib.import_module(module), name)
    try:
        result = await bridge(function)(session, **job["arguments"])
    finally:
        session.close()
    Path(job["result"]).write_text(json.dumps(result))
