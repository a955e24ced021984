# SPDX-License-Identifier: Apache-2.0
"""Cases of the campaign: how each is run, and how its outcome is found.

A ``Trial`` does one thing during a cut. A ``Scene`` is a scenario of the cosimulation or of
``testbench.faults.scenes``; it has its own checks, and afterwards its machine is judged like every
other. A ``Coder`` is compared with the same run with a sound coder. A ``Check`` is about the tests
or the proofs, not about a machine.
"""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from host.machines import machine as machines
from testbench.breaks.harness import Verdict, try_break
from testbench.breaks.table import TABLE
from testbench.cosim import coder
from testbench.faults.outcome import LIED, MISPLACED, Found, Outcome, look, misplaced
from testbench.faults.trials import Trial
from testbench.faults.witness import Witness
from testbench.native.simulation import Simulation

__all__ = ["Case", "Check", "Coder", "Scene", "Trial", "planted", "proof"]

REST_S = 0.02


@dataclass(frozen=True)
class Scene:
    """A scenario: a function of a session, which raises ``AssertionError`` if a check fails.

    ``arguments`` may be a function of the seed. ``tables`` are those of the machine, if it is not
    exactly a built-in one.
    """

    name: str
    function: Callable[..., object]
    arguments: dict | Callable[[int], dict] = field(default_factory=dict)
    expected: tuple[Outcome, ...] = (Outcome.SAFE_TOLD,)
    deadline: int | None = None
    machine: str = "sinker"
    tables: Callable[[], dict] | None = None

    def run(self, seed: int) -> list[Found]:
        machine = machines.load(self.machine)
        arguments = self.arguments(seed) if callable(self.arguments) else self.arguments
        tables = self.tables() if self.tables else machine.tables
        with Witness(machine=tables, clock_hz=machine.clock_hz, seed=seed) as session:
            try:
                self.function(session, **arguments)
            except (AssertionError, ValueError) as error:
                return [Found(Outcome.WRONG, None, str(error).split("\n")[0])]
            return [self._found(session)]

    def _found(self, session):
        session.changes()
        armed = session.pins.rises("contactor")
        begun = session.begun or (armed[0] if armed else 1)
        seen = look(session, begun, REST_S)
        safe = [clock for clock in session.pins.rises("safe", begun) if clock > begun]
        clocks = safe[0] - begun if safe and session.begun else None
        if seen.lied:
            return Found(Outcome.WRONG, clocks, LIED)
        if misplaced(seen):
            return Found(Outcome.WRONG, clocks,
                         f"{MISPLACED}: it tells {seen.told.places} and is at {seen.true}")
        if self.deadline is not None and (clocks is None or clocks > self.deadline):
            return Found(Outcome.WRONG, clocks, f"not safe in {self.deadline} clocks")
        if seen.reasons:
            return Found(Outcome.SAFE_TOLD, clocks, seen.reasons[0])
        if safe:
            return Found(Outcome.SAFE_UNTOLD, clocks, "not a word")
        return Found(Outcome.NO_EFFECT, None, "as without the fault")


# Machine: a condition, and the highest speed in mm/min.
CODERS = {"sinker": (100, 1800), "wire": (500, 900)}


@dataclass(frozen=True)
class Coder:
    """A coder of one axis fails in a situation; both of ``testbench.cosim.coder``."""

    situation: str
    axis: str
    fault: str
    machine: str = "sinker"
    expected: tuple[Outcome, ...] = (Outcome.SAFE_TOLD,)

    @property
    def name(self) -> str:
        return f"{self.machine}, {self.axis.upper()}: {self.fault} at {self.situation}"

    @property
    def deadline(self) -> int:
        """Clocks until everything is over; for a coder the distance counts, not the clocks."""
        return round(coder.SITUATIONS[self.situation].seconds * 2_000_000)

    def run(self, seed: int) -> list[Found]:
        machine = machines.load(self.machine)
        options = {"machine": machine.tables, "clock_hz": machine.clock_hz, "seed": seed}
        with Simulation(trace=False, **options) as session:
            sound, _ = coder.course(session, self.situation, self.axis, "", *CODERS[self.machine])
        with Witness(**options) as session:
            found, begun = coder.course(session, self.situation, self.axis, self.fault,
                                        *CODERS[self.machine])
            seen = look(session, begun, REST_S)
        try:
            figures = coder.judge(self.situation, self.axis, self.fault, found, sound, begun,
                                  machine.clock_hz)
        except AssertionError as error:
            return [Found(Outcome.WRONG, seen.clocks, str(error).split("\n")[0])]
        if seen.lied or seen.clocks is None or misplaced(seen):
            return [Found(Outcome.WRONG, seen.clocks, "not safe at the pins, or not where told")]
        return [Found(Outcome.SAFE_TOLD, found.safe - begun,
                      f"{figures['text']} {figures['away_um']:.0f} um off")]


@dataclass(frozen=True)
class Check:
    """A check of the tests themselves: ``check`` returns its finding."""

    name: str
    check: Callable[[], Found]
    expected: tuple[Outcome, ...] = (Outcome.SAFE_TOLD,)
    deadline: int | None = None
    machine: str = ""

    def run(self, seed: int) -> list[Found]:
        return [self.check()]


Case = Trial | Scene | Coder | Check


def planted(name: str) -> Check:
    """A planted break, by its name in ``testbench.breaks.table``: a test must see it."""
    def check():
        one, = (one for one in TABLE if str(one) == name)
        verdict, said = try_break(one)
        seen = verdict is Verdict.SEEN
        return Found(Outcome.SAFE_TOLD if seen else Outcome.WRONG, None,
                     "seen by its tests" if seen else f"{verdict.value}: {said[-200:]}")
    return Check(f"break planted: {name}", check)


def proof(test: Callable[[Path], None]) -> Check:
    """A proof, as a function of ``testbench.formal`` that gets a folder."""
    def check():
        with tempfile.TemporaryDirectory() as place:
            try:
                test(Path(place))
            except AssertionError as error:
                return Found(Outcome.WRONG, None, str(error)[-200:])
        return Found(Outcome.SAFE_TOLD, None, "proven")
    return Check(test.__name__.removeprefix("test_").replace("_", " "), check)
