# SPDX-License-Identifier: Apache-2.0
"""Run a scenario on the emitted Verilog with its firmware, under cocotb."""

import json
from collections.abc import Callable
from pathlib import Path

from cocotb_tools.runner import Verilator, get_results

from softcore.image import target_image
from softcore.memory import parities, words_of
from testbench.cosim.build import TOP, program
from testbench.native.build import Options, options
from testbench.simulators import blocks

__all__ = ["cosimulate"]

JOB = "GAPKEEPER_SCENARIO"
MODULE = "testbench.cosim.session"


def _write(numbers: list[int], path: Path) -> None:
    """Numbers as Verilog's ``$readmemh`` wants them."""
    path.write_text("".join(f"{number:08x}\n" for number in numbers))


def cosimulate(scenario: Callable, workdir: Path, *, machine: dict, seed: int,
               clock_hz: int | None = None, needed: Options | None = None,
               image: Path | None = None, waves: Path | None = None, **arguments):
    """Run ``scenario(session, **arguments)`` under cocotb; return its result, converted by JSON.

    The same call on a native ``Simulation`` with the same seed gives the same, to the clock, and
    the same waveforms. Exactly one test must have run and passed: otherwise a simulator that
    died early would pass with none.

    Parameters
    ----------
    scenario : callable
        A top-level function of a module: the simulator's Python imports it by name.
    workdir : Path
        Folder for the log and the results.
    machine, seed, clock_hz
        See ``testbench.native.simulation.Simulation``; the default clock is that of the machine.
    needed : mapping or None
        Options of the controller; those that the machine needs if not given.
    image : Path or None
        Firmware; compiled from the sources if not given.
    waves : Path or None
        Folder for the waveforms, or None for none.
    arguments : dict
        Of the scenario, as JSON allows.

    Raises
    ------
    AssertionError
        If the scenario fails; its own traceback is in ``workdir/log.txt``.
    """
    clock_hz = clock_hz or int(machine["clock_hz"])
    runner = Verilator()
    binary = program(clock_hz, options(machine) if needed is None else needed)
    firmware, parity = workdir / "firmware.hex", workdir / "parity.hex"
    code = (image or target_image()).read_bytes()
    _write(words_of(code), firmware)
    _write(parities(code), parity)
    result = workdir / "result.json"
    result.unlink(missing_ok=True)
    job = workdir / "job.json"
    job.write_text(json.dumps({
        "function": f"{scenario.__module__}.{scenario.__qualname__}", "machine": machine,
        "clock_hz": clock_hz, "seed": seed, "arguments": arguments, "result": str(result),
        "waves": waves and str(waves)}))
    log = workdir / "log.txt"
    try:
        results = runner.test(
            hdl_toplevel=TOP, hdl_toplevel_lang="verilog", test_module=MODULE,
            build_dir=binary.parent, test_dir=workdir, seed=seed,
            results_xml=str(workdir / "results.xml"), log_file=log,
            plusargs=[f"+firmware={firmware}", f"+parity={parity}"], extra_env={JOB: str(job)})
        counts = get_results(results)
    except SystemExit:
        counts = None
    assert counts == (1, 0), f"{scenario.__name__} failed under cocotb:\n{_tail(log)}"
    blocks.joined()
    return json.loads(result.read_text())


def _tail(log):
    return "\n".join(log.read_text().splitlines()[-40:]) if log.exists() else "it left no log"
