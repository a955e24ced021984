# SPDX-License-Identifier: Apache-2.0
"""A bit of the processor's memory inverts in the middle of a cut.

Every word of a region gets an inverted bit; the word that is read first shows it. One word alone
may stay in the processor's caches and not be read again soon.
"""

import random

import pytest

from host.link.link import HeldError
from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import load
from softcore.image import target_image
from softcore.soc import MEMORY_SIZE
from softcore.tables.faults import alarm_line, alarm_number
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import pace
from testbench.cosim.tapes import TAPES
from testbench.native.simulation import Simulation
from testbench.native.symbols import firmware_symbols
from testbench.refusal import refuses

MACHINE = machines.load("sinker")
HELD_TO_SAFE = 1    # clock, that of the pads' registers; the processor is held one after the ack
CALLS = 2           # writes that were on the register bus already
SAFE = {"gap_on": 0, "gap_sense": 0, "drive_enable": 0, "contactor": 0, "safe": 1}
WATCHED = ("processor_held", "safety_pet_strobe", "path_position", "dac", *SAFE)
MEMORY = 1 << 16    # of the interlock's causes


def region(kind):
    """Addresses of words of the firmware's code, data, stack, or history of the path."""
    symbols = firmware_symbols()
    if kind == "stack":
        top = symbols["__stack_top"][0]
        return range(top - 1024, top, 4)
    if kind == "data":
        return range(symbols["__bss_start"][0], symbols["__bss_end"][0] & -4, 4)
    begin, extent = symbols["ring" if kind == "path" else "main"]
    return range(begin + 3 & -4, begin + extent & -4, 4)


@pytest.mark.parametrize(("kind", "bit"), [
    ("code", 0), ("data", 32),
    *(pytest.param(kind, bit, marks=pytest.mark.soak) for kind, bit in (
        ("code", 32), ("data", 0), ("stack", 0), ("stack", 32), ("path", 0), ("path", 32)))])
def test_a_bit_of_the_memory_stops_the_machine_and_is_told(kind, bit):
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        job = Job(session, watched=WATCHED)
        # More blocks than the window holds: the way back reads the history.
        blocks = ["G91", *["G01 Z-0.01 F300"] * 100] if kind == "path" else ["G01 Z-0.9 F300"]
        job.start(program(Data(limit=5), *blocks))
        job.reach(9500 if kind == "path" else 2000, pace(session, 300))
        flipped = region(kind)
        begun = session.cycle
        job.short(True)
        for _ in range(1000):
            # A word that is written becomes right again; the stack is written before it is read.
            for address in flipped if kind == "stack" or session.cycle == begun else ():
                session.flip(address, bit)
            session.run(1009)
            if session.probe("processor_held"):
                break
        session.run(session.clock_hz + 10_000)
        record = job.collect()
        held = record.rises("processor_held", begun)[0]
        assert record.rises("safe", begun)[0] - held <= HELD_TO_SAFE
        for pin, level in SAFE.items():
            assert record.at(pin, held + HELD_TO_SAFE) == level, pin
            assert not record.changes(pin, held + HELD_TO_SAFE + 1), pin
        assert not record.changes("dac", held + 3)
        assert not record.changes("path_position", held + 2)
        assert not record.rises("safety_pet_strobe", held + CALLS)
        assert session.probe("safety_latched") & MEMORY
        job.link.poll(0.01)
        told = [line for line in job.said if line.startswith("ALARM:")]
        assert len(told) == 2
        assert told[0] == told[1]
        code, _, place = told[0].partition(" memory parity at 0x")
        assert code == alarm_line("guard")
        assert int(place, 16) in flipped
        # Nothing but power brings it back, neither the operator's reset nor a line; and that only
        # if what is damaged is cleared when firmware starts, or not read before it is written, as
        # the history of the path. Code and stack are neither.
        job.press(b"\x18")
        with pytest.raises(HeldError):
            job.link.command("$X")
        assert session.probe("processor_held")
        session.set("force.brown_out", 1)
        session.run(1000)
        session.set("force.brown_out", 0)
        session.run(300_000)
        assert session.probe("processor_held") == (kind in ("code", "stack"))


@pytest.mark.soak
def test_what_the_ring_of_the_path_held_before_a_start_is_never_read():
    """A start does not clear it: the way back over a hundred blocks is the same with any words."""
    ring, extent = firmware_symbols()["ring"]
    image = target_image().read_bytes()
    assert len(image) == ring, "the ring follows the image"
    seen = []
    for held in (b"", random.Random(1).randbytes(extent)):
        with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                        trace=False) as session:
            session.load(image + held)
            job = Job(session, watched=("path_position", *SAFE))
            job.start(program(Data(limit=5), "G91", *["G01 Z-0.01 F300"] * 100))
            job.reach(9500, pace(session, 300))
            job.short(True)
            job.until(lambda job=job: job.probe("path_position") < 1500, "the way back")
            job.short(False)
            job.finish()
            assert job.told("retraction_end")[0]["distance"] > 0.8
            seen.append((job.events, job.collect().changes("path_position")))
    assert seen[0] == seen[1]


def test_a_run_ends_with_the_alarm():
    """As `gapkeeper run` does it: with the place, and the status of an alarm."""
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        def damage(run):
            if run.events and run.events[-1]["event"] == "block":
                for address in region("code"):
                    session.flip(address, 7)

        job = Run(MACHINE, load(TAPES / "sink_shallow_deep.nc"), Piped(session), watch=damage)
        assert job.execute() == "alarm"
        assert job.alarm["code"] == alarm_number("guard")
        assert job.alarm["text"].startswith("memory parity at 0x0000")
        assert job.events[-1]["event"] == "alarm"
        assert job.events[-1]["line"] > 0


def test_a_bit_that_is_none_is_refused():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1) as session:
        for address, bit in ((1, 0), (-4, 0), (MEMORY_SIZE, 0), (0, 33), (0, -1)):
            refuses(session.flip, r"^the memory has no bit", address, bit)
