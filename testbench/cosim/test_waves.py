# SPDX-License-Identifier: Apache-2.0
"""Waveforms of a native run: the file has the values of the probes."""

import re

import pylibfst

from host.machines.machine import load
from testbench.native.simulation import Simulation
from testbench.native.waves import SIGNALS

MACHINE = load("sinker").tables
READY = b"$X\n$POSITION=HERE\n"
LINES = b"G92 X0 Y0 Z0.1\nG36 R300 L1 H600 E60 Q0.05\nC130\nM03\nG94 F12\nG01 Z-0.2\n"


def read(path):
    """Names of the signals, and the last value of each."""
    lib, ffi = pylibfst.lib, pylibfst.ffi
    reader = lib.fstReaderOpen(str(path).encode())
    _, signals = pylibfst.get_scopes_signals2(reader)
    lib.fstReaderSetFacProcessMaskAll(reader)
    last = {}

    def changed(_, time, handle, value):
        last[handle] = ffi.string(value).decode()

    pylibfst.fstReaderIterBlocks(reader, changed)
    lib.fstReaderClose(reader)
    return {name.split(".")[1]: int(last[signal.handle], 2)
            for name, signal in signals.by_name.items()}


def test_the_file_ends_with_what_the_probes_show(workdir, rng):
    with Simulation(machine=MACHINE, clock_hz=int(MACHINE["clock_hz"]), seed=rng.getrandbits(32),
                    waves=workdir) as simulation:
        simulation.run(300_000)
        simulation.send(READY)
        simulation.press_arm()
        simulation.send(LINES)
        simulation.run(700_000)
        shown = {}
        for name, probe, _, _ in SIGNALS:
            shown[name] = simulation.probe(probe)
        simulation.run(1)  # the last clock's values are written when the next begins
    found = read(workdir / "waves.fst")
    assert shown["Pi"] < -100
    assert {name: value % 2**32 for name, value in shown.items() if name != "DAC"} == {
        name: value for name, value in found.items() if name != "DAC"}
    assert shown["DAC"] % 2**16 == found["DAC"]


def test_the_views_show_every_signal(workdir):
    with Simulation(machine=MACHINE, clock_hz=int(MACHINE["clock_hz"]), seed=1,
                    waves=workdir) as simulation:
        simulation.run(1000)
    found = set(read(workdir / "waves.fst"))
    gtkwave = re.findall(r"^gapkeeper\.(\w+)", (workdir / "waves.gtkw").read_text(), re.MULTILINE)
    surfer = re.findall(r"^variable_add gapkeeper\.(\w+)$", (workdir / "waves.sucl").read_text(),
                        re.MULTILINE)
    assert set(gtkwave) == set(surfer) == found == {name for name, _, _, _ in SIGNALS}
