# SPDX-License-Identifier: Apache-2.0
"""Waveforms of a run, read by a library that is not ours.

They are held against the changes, the events, the coders and the outputs of the same run.
"""

import re
import shutil
import subprocess

import pytest
import pywellen

from host.link.link import RETRACT
from host.machines import machine as machines
from host.run import simulation
from host.run.run import Run
from host.tape.tape import encode, load
from softcore.top import Top
from testbench.cosim.runner import cosimulate
from testbench.installed import left_out
from testbench.native import views
from testbench.native.signals import NAMES, SIGNALS
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

SINKER, WIRE = machines.load("sinker"), machines.load("wire")
READY = b"$X\n$POSITION=HERE\n"
LINES = b"G92 X0 Y0 Z0.1\nG36 R300 L1 H600 E60 Q0.05\nC130\nM03\nG94 F60\nG01 X0.2 Z-0.2\n"
# Round a bend of the kerf at a feed by the mean voltage.
BEND = """%
G21 G90 G94
G10 C900 I8 P5 Q40 R40 E80 K-1 U5
C900
G36 R60 L0.3 H120 E30 Q0.05
M08
M03
G01 X0.16 F12
G95 P4 G03 X0.36 Y0.2 J0.2
M02
%
"""
START, CUT, END = 300_000, 300_000, 1000      # clocks
# The events' clock begins with the end of the reset, that of the file at power-on.
RESET = Top.RESET_CLOCKS + 1


class Waves:
    """A file: ``at`` gives a signal's value in a clock, ``changes`` its clocks and values."""

    def __init__(self, folder, clock_hz):
        self._file = pywellen.Waveform(str(folder / "waves.fst"))
        scale = self._file.timescale
        self.step = round(10**-scale.unit.to_exponent() / scale.factor / clock_hz)
        self.variables = {one.full_name: one for one in self._file.all_vars()}

    def changes(self, name):
        signal = self.variables[f"gapkeeper.{name}"].signal
        found = [signal[index] for index in range(len(signal))]
        assert all(time % self.step == 0 for time, _ in found)
        return [(time // self.step, value) for time, value in found]

    def values(self, name, end):
        """The value in every clock before ``end``."""
        found = []
        for (clock, value), (until, _) in zip(self.changes(name),
                                              [*self.changes(name)[1:], (end, 0)], strict=True):
            found += [value] * (until - clock)
        return found


def play(session):
    """A short cut with a short and an emergency stop, the same natively and under cocotb.

    Returns the clocks so far.
    """
    session.run(START)
    session.send(READY)
    session.press_arm()
    session.send(LINES)
    session.run(CUT)
    session.set("force.short", 1)
    session.run(CUT // 3)
    session.set("force.estop", 1)
    session.run(END)
    return session.cycle


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """Folder of the file, all changes that the simulation has told, and the last clock."""
    folder = tmp_path_factory.mktemp("waves")
    with Simulation(machine=SINKER.tables, clock_hz=SINKER.clock_hz, seed=1, trace=False,
                    waves=folder) as session:
        session.watch(dict.fromkeys(signal.probe for signal in SIGNALS))
        end = play(session)
        told = {}
        for clock, name, value in session.changes():
            told.setdefault(name, []).append((clock, value))
    return folder, told, end


def test_file_has_the_signals_of_the_table(played):
    folder, _, _ = played
    found = Waves(folder, SINKER.clock_hz).variables
    assert {name: one.bitwidth for name, one in found.items()} == {
        signal.path: signal.bits for signal in SIGNALS}
    named = {signal.path: signal for signal in SIGNALS if signal.names}
    for path, one in found.items():
        if path not in named:
            assert one.enum_type is None
            continue
        names, pairs = one.enum_type
        assert names == named[path].names
        assert [(int(bits, 2), word) for bits, word in pairs] == list(enumerate(NAMES[names]))
    assert len(named) > 5


def test_file_has_every_change_that_the_simulation_tells(played):
    folder, told, end = played
    waves = Waves(folder, SINKER.clock_hz)
    moved = 0
    for signal in SIGNALS:
        expected = []
        for clock, value in told[signal.probe]:
            now = value >> (signal.bit or 0) & (1 << signal.bits) - 1
            if not expected or expected[-1][1] != now:
                expected.append((clock, now))
        found = waves.changes(f"{signal.scope}.{signal.name}")
        assert found == [one for one in expected if one[0] < end], signal.path
        moved += len(found) > 1
    assert moved > 60


def test_outputs_are_dead_in_every_clock_of_the_safe_state(played):
    folder, _, end = played
    waves = Waves(folder, SINKER.clock_hz)
    safe = waves.values("safety.safe", end)
    assert waves.values("safety.estop", end)[-1] == safe[-1] == 1
    held = [clock for clock, level in enumerate(safe) if level]
    assert START / 2 < len(held) < end - CUT
    outputs = ["power.gap_on", "safety.contactor",
               *(f"motion.{axis}.{pin}" for axis in "xyz" for pin in ("dac", "drive_enable"))]
    for name in outputs:
        values = waves.values(name, end)
        assert not any(values[clock] for clock in held), name
        if not name.startswith("motion.y.dac"):
            assert any(values), name
    # The error counter is not at rest: what the drive is told is not worked out from it.
    assert waves.values("motion.z.Er", end)[-1] != 0


def test_coders_pins_count_to_the_fed_back_position(played):
    folder, _, end = played
    waves = Waves(folder, SINKER.clock_hz)
    for axis, way in (("x", 1), ("z", -1)):
        a, b, fed = (waves.values(f"motion.{axis}.{name}", end)
                     for name in ("enc_a", "enc_b", "FP"))
        place = [{(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}[pair]
                 for pair in zip(a, b, strict=True)]
        count, counts = 0, []
        for before, now in zip([place[0], *place], place, strict=False):
            count += {0: 0, 1: 1, 3: -1}[(now - before) % 4]
            counts.append(count)
        late = 7    # clocks from the pin to the counter: pad, synchroniser, decoder, counter
        signed = [value - (value >> 31 << 32) for value in fed]
        assert signed[late:] == counts[:-late]
        assert max(way * value for value in signed) > 100


def test_states_and_places_agree_with_the_events(workdir):
    machine_on = simulation.start(SINKER, clock_hz=SINKER.clock_hz, seed=7, waves=workdir,
                                  trace=False, progress=print)
    pressed = []

    def retract(run):
        """The operator takes the electrode back once, so far that the way forward begins at VH."""
        if not pressed and machine_on.cycle > 0.9 * SINKER.clock_hz:
            run.link.press(RETRACT)
            pressed.append(machine_on.cycle)

    job = Run(SINKER, load(TAPES / "sink_shallow_deep.nc"), machine_on, watch=retract,
              until_s=1.7)
    try:
        job.execute()
    finally:
        machine_on.close()
    waves = Waves(workdir, SINKER.clock_hz)
    changes = waves.changes("motion.state")
    state = dict(changes)
    wanted = {"retraction_start": "stopping", "readvance high": "high", "readvance low": "low",
              "resume": "front"}
    seen = set()
    begin = job.events[0]["pos"]    # the machine has not moved yet
    for event in job.events:
        kind = f"{event['event']} {event.get('phase', '')}".strip()
        if kind in wanted:
            # A retraction's event has the clock of its order: state and place are one later.
            clock = event["cycle"] + RESET
            late = event["event"] == "retraction_start"
            assert NAMES["state"][state[clock + late]] == wanted[kind]
            for axis, mm in event["pos"].items():
                register = [value for at, value in waves.changes(f"motion.{axis}.FP")
                            if at <= clock + late][-1]
                assert register - (register >> 31 << 32) == round((mm - begin[axis]) * 10_000)
            seen.add(kind)
    assert seen == set(wanted)


def shown(folder):
    """Names of the signals in the two views of a folder, with their bits in GTKWave's."""
    gtkwave = re.findall(r"^(gapkeeper\.[\w.]+)(?:\[(\d+):0\])?$",
                         (folder / "waves.gtkw").read_text(), re.MULTILINE)
    surfer = re.findall(r"^variable_add (\S+)$", (folder / "waves.sucl").read_text(),
                        re.MULTILINE)
    return {name: int(high or 0) + 1 for name, high in gtkwave}, surfer


@pytest.mark.parametrize("machine", [SINKER, WIRE], ids=lambda machine: machine.name)
def test_views_show_signals_of_the_file(machine, workdir):
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1, trace=False,
                    waves=workdir) as session:
        session.run(1000)
    gtkwave, surfer = shown(workdir)
    found = Waves(workdir, machine.clock_hz).variables
    assert {name: found[name].bitwidth for name in gtkwave} == gtkwave
    assert list(gtkwave) == surfer
    assert len(surfer) == sum(len(rows) for _, rows in views.VIEWS[machine.tables["kind"]])


@pytest.mark.parametrize("machine", [SINKER, WIRE], ids=lambda machine: machine.name)
def test_gtkwave_opens_the_view_without_a_complaint(machine, workdir):
    """GTKWave itself, on a screen that nobody sees; it says what it shows."""
    if not (shutil.which("gtkwave") and shutil.which("xvfb-run")):
        left_out("the saved views in GTKWave, as this computer lacks it or Xvfb",
                 "gtkwave xvfb xauth", "GAPKEEPER_GTKWAVE")
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=1, trace=False,
                    waves=workdir) as session:
        session.run(1000)
    (workdir / "ask.tcl").write_text(
        'puts "shown: [gtkwave::getDisplayedSignals]"\n'
        "gtkwave::setMarker 0\n"
        "foreach one [gtkwave::getDisplayedSignals] {\n"
        '    puts "value: $one [gtkwave::getTraceValueAtMarkerFromName $one]"\n'
        "}\ngtkwave::/File/Quit\n")
    done = subprocess.run(["xvfb-run", "-a", "gtkwave", "--script=ask.tcl", "waves.gtkw"],
                          cwd=workdir, capture_output=True, text=True, timeout=120, check=False)
    said = (done.stdout + done.stderr).splitlines()
    expected = [name + (f"[{bits - 1}:0]" if bits > 1 else "")
                for name, bits in shown(workdir)[0].items()]
    (told,) = (line for line in said if line.startswith("shown: "))
    assert told.split()[1:] == expected
    values = dict(line.split()[1:3] for line in said if line.startswith("value: "))
    named = {name: signal.names for signal in SIGNALS if signal.names
             for name in expected if name.partition("[")[0] == signal.path}
    assert len(named) > 2
    assert all(values[name] in NAMES[names] for name, names in named.items()), values
    usual = re.compile(r"shown: |value: |GTKWave Analyzer |GTKWAVE \| Executing Tcl script "
                       r"|FSTLOAD \| (Processing|Built|Building|Sorting) |Exiting\.|\s*$")
    assert [line for line in said if not usual.match(line)] == []


def test_surfer_names_an_item_by_its_number_to_base_16():
    assert [views.item(number) for number in (0, 9, 15, 16, 31, 42)] == [
        "a", "j", "p", "ba", "bp", "ck"]


def test_view_of_a_wire_machine_is_not_flat(workdir):
    machine_on = simulation.start(WIRE, clock_hz=WIRE.clock_hz, seed=1, waves=workdir,
                                  trace=False, progress=print)
    job = Run(WIRE, encode(BEND), machine_on, watch=lambda run: None, until_s=3)
    try:
        job.execute()
    finally:
        machine_on.close()
    assert job.outcome == "stopped", job.alarm
    waves = Waves(workdir, WIRE.clock_hz)
    _, surfer = shown(workdir)
    still = [name for name in surfer if len(waves.changes(name.removeprefix("gapkeeper."))) < 2]
    assert still == ["gapkeeper.safety.first"], "there is one cause only, power-on"
    modes = {NAMES["feed"][value] for _, value in waves.changes("gap.feed_mode")}
    assert modes == {"constant", "removal"}


@pytest.mark.soak
@pytest.mark.cocotb
def test_file_is_the_same_under_cocotb(played, workdir):
    folder, _, end = played
    assert cosimulate(play, workdir, machine=SINKER.tables, seed=1, waves=workdir) == end
    assert (workdir / "waves.fst").read_bytes() == (folder / "waves.fst").read_bytes()
    assert shown(workdir) == shown(folder)


def test_same_run_gives_the_same_file(played, workdir):
    folder, _, end = played
    with Simulation(machine=SINKER.tables, clock_hz=SINKER.clock_hz, seed=1, trace=False,
                    waves=workdir) as session:
        assert play(session) == end
    assert (workdir / "waves.fst").read_bytes() == (folder / "waves.fst").read_bytes()
