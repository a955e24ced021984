# SPDX-License-Identifier: Apache-2.0
"""Scenario: the power of the controller is cut while a tape cuts, and the tape goes on afterwards.

The machine goes on without its controller: its axes brake, the workpiece stays as it is. Then the
operator leads a wire out of its slot, homes the axes, and lets the tape go on (``$FROM=last``).

``python -m testbench.cosim.power_loss`` tells what jobs without a cut have left, and with one.
"""

import argparse
import multiprocessing
import random
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from host.link.link import RESUME, Link
from host.machines import machine as machines
from host.machines.machine import Machine
from host.run.events import Scale, is_event, parse
from host.run.simulation import Simulation as Piped
from host.tape.tape import encode
from softcore.soc import MEMORY_SIZE
from softcore.tables.faults import named
from softcore.tables.settings import assign
from softcore.top import SIMULATED_JOURNAL
from testbench.cosim.job import MM
from testbench.cosim.whole_cuts import BIN_MM, Side, wall_um
from testbench.models import bookmark
from testbench.native.simulation import Simulation

__all__ = ["CAVITY", "SLOT", "Result", "Shop", "Work", "cuts", "interruptions", "listed",
           "machine_on", "whole"]

SWITCH_MM = 1.5             # reference switches, from where the axes start
PULL_OFF_MM = 0.1
OFF_S = 0.2
DAMAGED = 2                 # characters before a greeting after power-on
WRITTEN_S = 0.6             # the journal writes the zero
PATIENCE_S = 30.0
STUCK = [named(name).alarm for name in ("halt_limit", "halt_back_limit")]
MOST_STUCK = 2              # in a job
DEADLINE_S = 300.0          # of a process
FORK = multiprocessing.get_context("fork")
RING = bookmark.sectors(SIMULATED_JOURNAL, MEMORY_SIZE)
AXES = ("axis_x_command", "axis_y_command", "axis_z_command")


@dataclass(frozen=True)
class Result:
    """What a job has left, see ``Work.measure``; the axes' machine places; clocks it took.

    ``stuck``: how many shorts were still there at the retractable limit.
    """

    left_um: tuple[float, ...]
    places: tuple[int, ...]
    clocks: int
    stuck: int = 0


class Work:
    """A machine and a tape, and what the operator does there: a cavity, on the sinker."""

    name = "cavity"
    machine: Machine = machines.load("sinker")
    away = "Z1"         # words of a jog out of the work
    # 0.3 mm deep, with a change of the retraction data.
    tape = """%
G21 G90 G94 C130
G36 R300 L0.5 H600 E60 Q0.1
M08
M03
G00 Z0.05
G01 Z-0.1 F10
Z-0.15
Z-0.2
G36 R600 L0.3
Z-0.25
G91 Z-0.05
G04 P300
M05
G90 G00 Z0.9
M09
M02
%
"""

    @cached_property
    def blocks(self) -> range:
        """Blocks that a whole job tells. Block 1 is ``%``."""
        return range(2, self.tape.rstrip().count("\n") + 1)

    def zero(self, shop: "Shop") -> None:
        """Set the zero on the top of the workpiece, as a touch would; the journal keeps it."""
        height = shop.session.get("read.electrode_um") / 1000
        shop.link.command(f"G10 L20 P1 X0 Y0 Z{height:.4f}")
        shop.run(WRITTEN_S)

    def lead_out(self, shop: "Shop") -> None:
        """Before homing after power-off: nothing to do, as the jump axis goes up first."""

    def lead_in(self, shop: "Shop") -> None:
        """After that homing: nothing to do."""

    def measure(self, session: Simulation) -> tuple[float, ...]:
        """Depth of the cavity in um."""
        return (session.get("read.depth_um"),)


class WireWork(Work):
    """A straight slot into a plate, on the wire machine."""

    name = "slot"
    machine = machines.load("wire")
    tape = """%
G21 G90 G94 C500
G36 R60 L0.3 H120 E30 Q0.05
M08
M03
G01 X0.2 F10
X0.25
X0.3
G36 R120 L0.2
X0.35
G91 X0.05
M05
G90 G00 X0.
M09
M02
%
"""
    out_mm = 0.6        # by which the operator leads the wire back: out of any place of the slot
    away = f"X-{out_mm}"
    side = Side("x", 0.0, 0.2, 0.36, (1, -1))   # far enough from its two ends

    def zero(self, shop: "Shop") -> None:
        """Go from the reference switches to where the wire stood, and set the zero there."""
        way = SWITCH_MM - PULL_OFF_MM
        shop.link.command(f"G91 G00 X{way} Y{way}")
        shop.link.command("G10 L20 P1 X0 Y0")
        shop.run(WRITTEN_S)

    def lead_out(self, shop: "Shop") -> None:
        """Jog the wire back along its slot; where it stands is not known, but the way is."""
        for line in ("$X", "$POSITION=HERE", f"$J=G91 {self.away} F60"):
            shop.link.command(line)
        shop.run(1.2 * self.out_mm)
        shop.at_rest()

    def lead_in(self, shop: "Shop") -> None:
        """To the beginning of the slot, from where the way to any place of it is straight."""
        shop.link.command("G90 G00 X0 Y0")
        shop.at_rest()

    def measure(self, session: Simulation) -> tuple[float, ...]:
        """Distances of both walls from the path in um, in means of ``BIN_MM``."""
        found: list[float] = []
        for wall in self.side.walls:
            along, away = wall_um(session.workpiece(), self.side, wall)
            number = np.floor((along - along[0]) / BIN_MM + 1e-6).astype(int)
            found.extend(np.bincount(number, away) / np.bincount(number))
        return tuple(found)


CAVITY, SLOT = Work(), WireWork()


def machine_on(work: Work, seed: int) -> Simulation:
    """The machine, with reference switches near by and without scatter, so that frames compare."""
    tables = work.machine.tables
    side = tables["side"] | {"limit_low_mm": -SWITCH_MM, "limit_high_mm": SWITCH_MM,
                             "limit_scatter_um": 0.0}
    return Simulation(machine={**tables, "side": side}, clock_hz=work.machine.clock_hz, seed=seed,
                      trace=False)


class Shop:
    """An operator at a controller that has just been switched on. ``said``: lines, not events."""

    def __init__(self, session: Simulation, work: Work):
        self.session = session
        self.work = work
        self.pipe = Piped(session)
        self.link = Link(self.pipe, self._hear)
        self.events: list[dict] = []
        self.stuck = 0      # shorts that were still there at the retractable limit
        self._scale = Scale(session.clock_hz, MM)
        self.said = self._greeting()

    def _greeting(self) -> list[str]:
        """Lines of the first quarter of a second."""
        said, end = b"", self.session.cycle + self.session.clock_hz // 4
        while self.session.cycle < end:
            said += self.session.receive(end - self.session.cycle)
        # A character that was on the wire when the power went comes damaged: it may be any other.
        text = said.decode("ascii", "replace")
        begins = text.find("Grbl ")
        assert begins in range(DAMAGED + 1), text
        return text[begins:].split("\r\n")

    def _hear(self, line):
        if is_event(line):
            self.events.append(parse(line, self._scale))
        else:
            self.said.append(line)

    def run(self, seconds: float) -> None:
        """Let so much time pass."""
        end = self.session.cycle + round(seconds * self.session.clock_hz)
        while self.session.cycle < end:
            self.link.poll((end - self.session.cycle) / self.session.clock_hz)

    def told(self, event: str) -> list[dict]:
        """Events of a name."""
        return [one for one in self.events if one["event"] == event]

    def blocks(self) -> list[int]:
        """Blocks that were told."""
        return [event["line"] for event in self.told("block")]

    def places(self) -> tuple[int, ...]:
        """Commands to the axes, in the controller's own counts."""
        return tuple(self.session.probe(name) for name in AXES)

    def ready(self) -> None:
        """Home and arm."""
        pull_off_um = round(1000 * PULL_OFF_MM)
        for name, value in (("home_pull_off_um", pull_off_um), ("home_slow_mm_min", 60)):
            self.link.command(assign(name, value))
        self.link.command("$H")
        self.session.press_arm()
        self.run(0.05)
        self.at_rest()

    def at_rest(self) -> None:
        """Wait until nothing moves, and see that all is well."""
        end = self.session.cycle + round(PATIENCE_S * self.session.clock_hz)
        while (state := self.link.status()["state"]) in ("Run", "Jog"):
            assert self.session.cycle < end, state
            self.run(0.05)
        assert state == "Idle", (state, self.said)

    def start(self) -> None:
        """Send the tape."""
        assert self.link.send_tape(encode(self.work.tape).rows, lambda: False)

    def until(self, event: str) -> None:
        """Run to an event. An alarm is a failure, but for a few shorts at the retractable limit."""
        end = self.session.cycle + round(PATIENCE_S * self.session.clock_hz)
        while not self.told(event):
            if alarms := self.told("alarm"):
                assert len(alarms) == 1, alarms
                assert alarms[0]["code"] in STUCK, (alarms, self.said)
                assert self.stuck < MOST_STUCK, (alarms, self.said)
                self._clear_away()
            assert self.session.cycle < end, f"{event} did not come"
            self.link.poll(0.01)

    def _clear_away(self) -> None:
        """Lead the electrode out of the work, and go on at the pulse: debris is still in the gap.

        This happens without an interruption, too. The block that goes on is told once more.
        """
        self.stuck += 1
        at = max(at for at, one in enumerate(self.events) if one["event"] == "block")
        self.events = [one for one in self.events[:at] if one["event"] != "pause"]
        self.link.command("$X")
        self.at_rest()
        self.link.command(f"$J=G91 {self.work.away} F60")
        self.run(0.1)
        self.at_rest()
        self.session.press_arm()
        self.run(0.05)
        self.link.command("$FROM=last")
        self.start()
        self.until("pause")
        self.link.press(RESUME)

    def result(self, since: int) -> Result:
        """The end of the tape, which began in a clock."""
        self.until("program_end")
        took = self.session.cycle - since
        self.run(0.1)
        places = tuple(round(float(one) * MM) for one in self.link.status()["MPos"].split(","))
        return Result(self.work.measure(self.session), places, took, self.stuck)


def whole(work: Work, seed: int) -> Result:
    """Run the tape without an interruption."""
    with machine_on(work, seed) as session:
        shop = Shop(session, work)
        shop.ready()
        work.zero(shop)
        begun = session.cycle
        shop.start()
        result = shop.result(begun)
        assert shop.blocks() == list(work.blocks), shop.blocks()
        return result


def cuts(work: Work, seed: int,
         clocks: Iterable[int]) -> Iterator[tuple[int, int | None, Result]]:
    """Cut the power so many clocks after the start of the tape, and go on, for each number.

    Yield the clocks, the block in which the controller was interrupted, 0 for none, and the result.
    """
    return interruptions(work, seed, clocks, _gone_on)


def interruptions(work: Work, seed: int, clocks: Iterable[int],
                  gone_on: Callable[[Shop, int], tuple[int | None, Result]],
                  ) -> Iterator[tuple[int, int | None, Result]]:
    """As ``cuts``, with whatever ``gone_on(shop, begun)`` does to a tape that began in a clock.

    One job runs through all of these clocks; what follows an interruption is done in a process of
    its own, which has the machine as it was then.
    """
    with machine_on(work, seed) as session:
        shop = Shop(session, work)
        shop.ready()
        work.zero(shop)
        begun = session.cycle
        shop.start()
        for at in sorted(clocks):
            while session.cycle < begun + at:
                shop.link.poll((begun + at - session.cycle) / session.clock_hz)
            yield at, *_apart(lambda: gone_on(shop, begun))


def _apart(work: Callable[[], tuple[int | None, Result]]) -> tuple[int | None, Result]:
    """Result of ``work`` in a copy of this process. It fails as ``work`` does."""
    receiver, sender = FORK.Pipe(duplex=False)

    def tell():
        try:
            sender.send(work())
        except BaseException:  # the other process reports it
            sender.send(traceback.format_exc())
    process = FORK.Process(target=tell)
    with warnings.catch_warnings():
        # Python 3.12 and later warn of threads, as pytest-xdist has one. The copy does not use it.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()      # so that the end of the process is the end of the pipe
    try:
        assert receiver.poll(DEADLINE_S), f"no result within {DEADLINE_S:.0f} s"
        found = receiver.recv()
    except EOFError:
        process.join()
        found = f"the process has ended with {process.exitcode}, without a result"
    finally:
        process.kill()
        process.join()
        receiver.close()
    assert not isinstance(found, str), found
    return found


def _gone_on(shop: Shop, begun: int) -> tuple[int | None, Result]:
    """Cut the power now, in a tape that began in a clock; the operator lets it go on."""
    session, work = shop.session, shop.work
    last = work.blocks[-1]
    told, ended = shop.blocks(), bool(shop.told("program_end"))
    old = max((event["line"] for event in shop.told("block")
               if event["cycle"] < session.cycle - 1.1 * session.clock_hz), default=0)
    burnt = session.get("read.sparks")

    session.power_off_and_on(OFF_S)
    again = Shop(session, work)
    kept = bookmark.newest(session.flash.read, RING)
    block = kept.line if kept else 0
    assert [line for line in again.said if "was interrupted" in line] == (
        [f"[MSG:a tape was interrupted in block {block}: $H, $FROM=last and the same tape "
         "go on there.]"] if block else [])
    assert again.link.status()["state"] == "Alarm", "locked as always"
    assert session.probe("safety_status_safe")
    stood = [session.get(f"read.{axis}_pulses") for axis in "xyz"]
    again.run(0.1)
    assert [session.get(f"read.{axis}_pulses") for axis in "xyz"] == stood, "it stands"
    sparks = session.get("read.sparks")
    assert sparks - burnt <= 1, "without power nothing burns"
    # A block may have been kept whose event was still on the line.
    assert block <= max(told, default=1) + 1
    assert block >= old or ended or told[-1:] == [last], "at most a block or a second old"
    work.lead_out(again)
    again.ready()
    work.lead_in(again)
    if block:
        again.link.command("$FROM=last")
    elif told and (ended or told[-1] == last):
        return 0, again_result(again, session.cycle - begun)
    begun = session.cycle
    again.start()
    if block:
        again.until("pause")
        stood = again.places()
        again.run(0.05)
        assert again.places() == stood, "nothing moves before the operator's word"
        assert session.get("read.sparks") == sparks, "nor does anything burn"
        assert not again.blocks()
        again.link.press(RESUME)
    result = again.result(begun)
    assert again.blocks() == list(range(block or work.blocks[0], last + 1)), "none is skipped"
    return block, result


def again_result(shop: Shop, took: int) -> Result:
    """A job that had ended before the cut; only its workpiece counts."""
    return Result(shop.work.measure(shop.session), (), took)


def main() -> None:
    """Print a line for each job without a cut, and for each with one: what it has left, in um."""
    parser = argparse.ArgumentParser(prog="python -m testbench.cosim.power_loss",
                                     description=main.__doc__)
    parser.add_argument("--work", choices=[work.name for work in (CAVITY, SLOT)],
                        default=CAVITY.name, help="a cavity on the sinker, a slot by the wire")
    parser.add_argument("--jobs", type=int, default=10, help="jobs without a cut: seeds 1 to N")
    parser.add_argument("--cuts", type=int, default=60, help="cuts in random clocks of one job")
    parser.add_argument("--seed", type=int, default=20261128, help="of the clocks")
    chosen = parser.parse_args()
    work = next(work for work in (CAVITY, SLOT) if work.name == chosen.work)
    clocks = 0
    for seed in range(1, chosen.jobs + 1):
        result = whole(work, seed)
        clocks = clocks or result.clocks
        print(f"seed {seed}, no cut: {listed(result.left_um)}", flush=True)
    rng = random.Random(chosen.seed)
    wanted = [rng.randrange(clocks) for _ in range(chosen.cuts)] if clocks else []
    for at, block, result in cuts(work, rng.randrange(1 << 32), wanted):
        print(f"cut after {at} clocks, in block {block}: {listed(result.left_um)}", flush=True)


def listed(numbers: Iterable[float]) -> str:
    """Numbers as ``main`` prints them."""
    return " ".join(f"{one:.1f}" for one in numbers)


if __name__ == "__main__":
    main()
