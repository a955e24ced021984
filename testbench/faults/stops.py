# SPDX-License-Identifier: Apache-2.0
"""Every stop: clocks from its cause to safe outputs, at the pins, worst of many phases.

A controller is brought into a situation once. Then the cause comes at one phase after the other,
each in a copy of the simulation. A phase is a random number of clocks after the situation, from a
range longer than the periods of the pulse train, of the processor's loop and of the watchdog, and
at F12 than a stretch of the coder's supervision.
"""

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from host.machines import machine as machines
from softcore.image import target_image
from softcore.tables.causes import numbers
from testbench.cosim.coder import SITUATIONS, jump_between_edges
from testbench.cosim.faults import LOOP
from testbench.cosim.gates import KINDS
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import pace
from testbench.faults.flips import bend_code
from testbench.faults.pins import PINS, safe_from
from testbench.native.branch import branch
from testbench.native.simulation import Simulation

__all__ = ["STOPS", "Figure", "Stop", "measure"]

ROUND = 20_000      # range of the phases, in clocks, at any frequency
AFTER = 2_000       # clocks for which outputs must stay safe to count
STEP = 500          # clocks between two looks whether it has stopped
WATCHED = (*PINS, "safety_latched", "safety_pet_strobe", "safety_pet", "pp", "path_status_reverse",
           "processor_held")
NUMBER = numbers()

def _cut(job):
    """In the middle of a cut along Z, pulses burning."""
    job.start(program(Data(), "G01 Z-0.9 F300", condition=130))
    job.reach(2000, pace(job.session, 300))


def _travel(way):
    """A motion with the discharge off and a wide gap."""
    def begin(job):
        job.session.set("force.gap_um", 500)
        job.link.command("M05")
        job.press(way)
        job.run(round(0.25 * job.session.clock_hz))
    return begin


def _situation(name, way):
    """A situation of ``testbench.cosim.coder``."""
    def begin(job):
        job.start(program(Data(), way, condition=130))
        SITUATIONS[name].reach(job)
    return begin


def _force(name, value=1):
    return lambda job: job.session.set(f"force.{name}", value)


def _flip(register, bit):
    return lambda job: job.session.poke(register, job.probe(register) ^ 1 << bit)


def _lose_program(job):
    job.session.load(LOOP * (len(target_image().read_bytes()) // 4))
    job.session.send(b"?")  # makes it execute words that it does not use otherwise


# ---- starts of the count of clocks other than the cause itself

def _gate_off(record, begun, safe):
    """The last clock with both gates off as ordered: until the next, a gate may be on."""
    return max([begun, *(clock for pin in ("gap_on", "gap_sense")
                         for clock, level in record.changes(pin, 0, safe) if not level)])


def _read(record, begun, safe):
    """The clock of the read that was wrong: the processor is held in the next."""
    return record.rises("processor_held", begun)[0] - 1


def _last_call(record, begun, safe):
    """The last call of the watchdog, or the last answer to it if that was before."""
    return record.last_care(safe)


# ---- ends of the count

def _safe(record, begun, end):
    """The clock from which every output is safe."""
    return safe_from(record, begun, end)


def _halted(record, begun, end):
    """The clock after the last path pulse forwards; the main gate is off anyway."""
    assert not record.rises("gap_on", begun), "a main pulse with the discharge off"
    pulses = [clock for clock in record.rises("pp", begun)
              if not record.at("path_status_reverse", clock)]
    last = max(pulses, default=begun)
    return last + 1 if last < end - AFTER else None


@dataclass(frozen=True)
class Stop:
    """A way to be stopped.

    ``begin`` reaches the situation. ``act`` makes the cause, and returns its clock if it did not
    come at once. Clocks count from ``since`` (described in ``counted``) to ``stopped``; ``bound``
    is their greatest allowed number at 2 MHz. ``latched`` is the cause that the interlock must
    name, of ``softcore.tables.causes``; empty for none. The phases are drawn from ``range`` clocks.
    """

    name: str
    what: str
    counted: str
    begin: Callable[[Job], None]
    act: Callable[[Job], int | None]
    latched: str
    bound: int
    since: Callable = lambda record, begun, safe: begun
    stopped: Callable = _safe
    until: str = "all outputs safe"
    range: int = ROUND

    @property
    def longest(self) -> int:
        """Clocks after which it has not stopped at all."""
        return 3 * self.bound + 30_000


STOPS = (
    Stop("emergency stop", "its input", "the pin", _cut, _force("estop"), "estop", 6),
    Stop("drive", "a drive's fault output", "the pin", _cut, _force("drive_fault", 2),
         "drive_fault", 6),
    Stop("limit", "a limit switch", "the pin", _cut, _force("limit_low", 4), "limit_low", 8),
    Stop("fluid", "the level falls; 50 ms against splashing", "the pin", _cut,
         _force("fluid_low"), "fluid_low", 100_006),
    Stop("coder, illegal", "both phases change at once", "the edge", _cut,
         lambda job: jump_between_edges(job.session), "encoder", 9),
    Stop("coder cut, F12", "both lines keep their level", "the cut",
         _situation("F12", "G01 Z-2 F12"), _force("encoder_cut", 4), "coder", 84_000,
         range=135_000),
    Stop("coder cut, F300", "both lines keep their level", "the cut", _cut,
         _force("encoder_cut", 4), "coder", 36_000),
    Stop("coder cut, G00", "both lines keep their level", "the cut",
         _situation("G00", "G00 Z-9"), _force("encoder_cut", 4), "coder", 24_000),
    Stop("gate", "the main gate does not let go", "the end of its pulse", _cut,
         _force("gate_stuck", KINDS["main"]), "gate", 1_100, since=_gate_off),
    Stop("guard", "a bit of a guarded register turns over", "the bit", _cut,
         _flip("guard_command", 5), "guard", 3),
    Stop("memory", "a bit of every word of the main loop turns over", "the read of one", _cut,
         lambda job: bend_code(job, random.Random(1)) and None, "memory", 3, since=_read),
    Stop("watchdog, clock", "the processor stands still", "its last call", _cut,
         lambda job: job.session.poke("sleep_left", 0xFFFF), "watchdog", 10_002, since=_last_call),
    Stop("watchdog, program", "the processor runs in a circle", "its last call", _cut,
         _lose_program, "watchdog", 10_002, since=_last_call),
    Stop("contact, F300", "the electrode touches, discharge off", "the touch",
         _travel("G91 G01 X9 F300"), _force("short"), "", 450, stopped=_halted,
         until="last pulse forwards"),
    Stop("contact, G00", "the electrode touches, discharge off", "the touch",
         _travel("G91 G00 X90"), _force("short"), "contact", 460),
    Stop("supply", "the supply fails (reset)", "the pin", _cut, _force("brown_out"), "", 4),
)


@dataclass(frozen=True)
class Figure:
    """Measurements of a stop: clocks by phase."""

    stop: Stop
    clocks: tuple[int, ...]

    @property
    def worst(self) -> int:
        return max(self.clocks)

    @property
    def least(self) -> int:
        return min(self.clocks)

    @property
    def good(self) -> bool:
        """Within its bound at every phase."""
        return self.worst <= self.stop.bound


def _try(job, stop):
    """Let the cause come, in a copy; clocks to the stop."""
    session = job.session
    job.collect()
    begun = session.cycle
    begun = stop.act(job) or begun
    while session.cycle < begun + stop.longest:
        session.run(STEP)
        if stop.stopped is _safe and job.probe("safe"):
            break
        if stop.stopped is _halted and session.cycle > begun + stop.bound + AFTER:
            break
    session.run(AFTER)
    record = job.collect()
    stopped = stop.stopped(record, begun, session.cycle)
    assert stopped is not None, f"{stop.name}: not stopped after {session.cycle - begun} clocks"
    if stop.latched:  # others may follow: of a processor that is held, the watchdog
        latched = record.changes("safety_latched", begun)[0][1]
        assert latched == 1 << NUMBER[stop.latched], f"{stop.name}: causes {latched:#x}"
    return stopped - stop.since(record, begun, stopped)


def _measure(begin, stops, count, seed):
    """Figures of stops from one situation."""
    machine = machines.load("sinker")
    longest = max(stop.range for stop in stops)
    phases = sorted(random.Random(seed).sample(range(longest), count))
    clocks = {stop: [] for stop in stops}
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=seed,
                    trace=False) as session:
        job = Job(session, watched=WATCHED)
        begin(job)
        reached = session.cycle
        for phase in phases:
            session.run(reached + phase - session.cycle)
            for stop in stops:
                clocks[stop].append(branch(partial(_try, job, stop)))
    return [Figure(stop, tuple(found)) for stop, found in clocks.items()]


def measure(count: int, seed: int) -> Iterator[Figure]:
    """Measure every stop at so many phases, situation by situation.

    Raises
    ------
    testbench.native.branch.BranchError
        If the machine does not stop, or names another cause.
    """
    for begin in dict.fromkeys(stop.begin for stop in STOPS):
        yield from _measure(begin, [stop for stop in STOPS if stop.begin is begin], count, seed)
