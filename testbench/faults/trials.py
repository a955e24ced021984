# SPDX-License-Identifier: Apache-2.0
"""Trials: a program that cuts, one action at some phase, and the outcome.

The same program without the fault, its twin, shows the way that the machine should have gone.
"""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from host.machines import machine as machines
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import pace
from testbench.faults.outcome import Found, Outcome, away, judge, look
from testbench.faults.witness import Witness
from testbench.native.branch import branch

__all__ = ["Trial", "run_trials"]

ROUND = 20_000          # clocks in which the phases lie
LOOK = 4000             # clocks between two looks at where the axes are
LOOKS = 120             # 0.24 s: the twin ends after 0.16; twice as many with a short
SHORT = range(ROUND // LOOK, ROUND // LOOK + 4)     # looks at which a short is, if there is one
REST_S = 0.1            # until it rests and says so: 20 ms at rest, and a sleep of up to 36 ms
RESTING = 10            # looks at one place that count as rest
MACHINES = {"sinker": ("G01 X0.6 Y0.3 Z0.4 F300", 130), "wire": ("G01 X0.6 Y0.4 F300", 500)}


@dataclass(frozen=True)
class Trial:
    """One action in the middle of a cut.

    ``act`` gets the job and a random source, and may return a description. After it, outputs must
    be safe within ``deadline`` clocks at 2 MHz; None if the machine need not stop. ``count`` is the
    number of trials. With ``short`` a short comes after it and clears again, which shows whether
    the machine can still retract.
    """

    name: str
    act: Callable[[Job, random.Random], str | None]
    deadline: int | None
    expected: tuple[Outcome, ...] = (Outcome.SAFE_TOLD,)
    machine: str = "sinker"
    count: int = 1
    short: bool = False


def _follow(job, begun, short):
    """Run to the end of a trial; the places of the axes at every look."""
    session = job.session
    places = []
    looks = 2 * LOOKS if short else LOOKS
    for index in range(looks):
        session.run(max(0, begun + index * LOOK - session.cycle))
        if short:
            job.short(index in SHORT)
        places.append(session.true_places())
        if session.probe("safe") and places[-1] in places[-RESTING:-RESTING + 1]:
            break  # it does not move any more
    return places + [places[-1]] * (looks - len(places))


def _try(job, trial, rng, begun, way):
    session = job.session
    session.changes()
    fault = session.cycle
    deed = trial.act(job, rng)
    # Looks before the fault find it where it is by then: not ahead of its way.
    late = session.cycle - begun
    places = [place for index, place in enumerate(_follow(job, begun, trial.short))
              if index * LOOK >= late]
    seen = look(session, fault, REST_S, away(places, way))
    found = judge(seen, trial.deadline, way[-1])
    return [found.outcome.name, found.clocks, f"{deed}: {found.why}" if deed else found.why]


def run_trials(trials: Sequence[Trial], seed: int) -> list[tuple[Trial, list[Found]]]:
    """Run all trials of one machine, each ``count`` times, at its own random phases.

    Raises
    ------
    testbench.native.branch.BranchError
        If a trial cannot be run.
    """
    name, = {trial.machine for trial in trials}
    way, condition = MACHINES[name]
    machine = machines.load(name)
    rng = random.Random(f"{seed}/{name}")
    order = sorted(((rng.randrange(1, ROUND), index, rng.random())
                    for index, trial in enumerate(trials) for _ in range(trial.count)))
    found = [[] for _ in trials]
    with Witness(machine=machine.tables, clock_hz=machine.clock_hz, seed=seed) as session:
        job = Job(session, watched=("safe",))
        job.start(program(Data(), way, condition=condition))
        job.reach(1500, pace(session, 300))
        begun = session.cycle
        twins = {short: branch(partial(_follow, job, begun, short))
                 for short in {trial.short for trial in trials}}
        for phase, index, chance in order:
            session.run(begun + phase - session.cycle)
            trial = trials[index]
            outcome, clocks, why = branch(partial(
                _try, job, trial, random.Random(chance), begun, twins[trial.short]))
            found[index].append(Found(Outcome[outcome], clocks, why))
    return list(zip(trials, found, strict=True))
