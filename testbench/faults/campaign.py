# SPDX-License-Identifier: Apache-2.0
"""The campaign: every class of faults, case by case; results as data and as a page."""

import json
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from testbench.faults.cases import Case
from testbench.faults.flips import Flips
from testbench.faults.outcome import Found, Outcome
from testbench.faults.stops import Figure
from testbench.faults.table import CLASSES, FaultClass
from testbench.faults.trials import Trial, run_trials

__all__ = ["ClassResult", "Result", "chosen", "run", "write"]


@dataclass(frozen=True)
class Result:
    """A case and the outcome of each trial; ``failure`` says why it could not be tried."""

    case: Case
    found: tuple[Found, ...]
    failure: str = ""

    @property
    def good(self) -> bool:
        """It was tried, and every outcome is one that is expected."""
        return bool(self.found) and all(one.outcome in self.case.expected for one in self.found)

    @property
    def worst(self) -> int | None:
        """Most clocks to safe outputs."""
        return max((one.clocks for one in self.found if one.clocks is not None), default=None)


@dataclass(frozen=True)
class ClassResult:
    """A class, its cases, and the seconds that they took."""

    fault: FaultClass
    results: tuple[Result, ...]
    seconds: float

    @property
    def outcomes(self) -> Counter:
        """How often each outcome was found."""
        return Counter(one.outcome for result in self.results for one in result.found)

    @property
    def good(self) -> bool:
        """Every case is; a class without cases says why."""
        return all(result.good for result in self.results) and bool(
            self.results or self.fault.lacks)


def chosen(names: Iterable[str]) -> list[FaultClass]:
    """Classes by number (``F3``) or by a part of their name; all if ``names`` is empty.

    Raises
    ------
    ValueError
        If there is none of a name.
    """
    wanted = []
    for name in names:
        found = [one for one in CLASSES
                 if name.upper() == one.number or (len(name) > 3 and name.lower() in one.name)]
        if not found:
            raise ValueError(f"there is no class {name!r}")
        wanted += found
    return [one for one in CLASSES if one in wanted] if wanted else list(CLASSES)


def _tried(case, seed):
    try:
        return Result(case, tuple(case.run(seed)))
    except Exception as error:  # whatever it is, the table must say so, and the others go on
        return Result(case, (), f"{type(error).__name__}: {error}")


def _all_tried(trials, seed):
    """Trials of one machine, together."""
    try:
        return [Result(trial, tuple(found)) for trial, found in run_trials(trials, seed)]
    except Exception as error:  # likewise: a trial that did not run ends with status 1
        return [Result(trial, (), f"{type(error).__name__}: {error}") for trial in trials]


def run(classes: Iterable[FaultClass], seed: int,
        told: Callable[[ClassResult], None] = lambda _: None) -> list[ClassResult]:
    """Run classes; ``told`` is called with each result."""
    done = []
    for fault in classes:
        began = time.perf_counter()
        results = []
        for kind, cases in groupby(fault.cases, lambda case: (type(case), case.machine)):
            if kind[0] is Trial:
                results += _all_tried(list(cases), seed)
            else:
                results += [_tried(case, seed) for case in cases]
        one = ClassResult(fault, tuple(results), time.perf_counter() - began)
        done.append(one)
        told(one)
    return done


def _plain(one):
    return {
        "class": one.fault.number, "name": one.fault.name, "injected": one.fault.injected,
        "where": one.fault.where, "must": one.fault.must, "lacks": one.fault.lacks,
        "good": one.good,
        "outcomes": {outcome.value: one.outcomes[outcome] for outcome in Outcome},
        "cases": [{
            "name": result.case.name, "deadline": result.case.deadline, "good": result.good,
            "expected": [outcome.value for outcome in result.case.expected],
            "failure": result.failure,
            "found": [{"outcome": found.outcome.value, "clocks": found.clocks, "why": found.why}
                      for found in result.found]} for result in one.results]}


def write(done: Iterable[ClassResult], seed: int, folder: Path,
          figures: Iterable[Figure] = (), flips: Flips | None = None) -> None:
    """Write ``results.json``; the same seed gives the same file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "results.json").write_text(json.dumps(
        {"seed": seed, "classes": [_plain(one) for one in done],
         "stops": {figure.stop.name: figure.clocks for figure in figures},
         "flips": [[one.outcome.value, one.why] for one in (flips.found if flips else ())]},
        indent=1) + "\n", encoding="utf-8")
