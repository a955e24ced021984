# SPDX-License-Identifier: Apache-2.0
"""CPU seconds of the tests: measured for each, summed by part, printed beside their budget.

CPU seconds hardly depend on other programs. They count the test's own process and the processes
that it started and waited for. Work that tests share, such as the build of the simulated machine,
counts for the first test that needs it. The budget is not enforced: no test fails because of time.
It shows where to look when ``make test`` has become slow.
"""

import resource
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["BUDGET_S", "Measured", "cpu_s", "part_of", "table"]

# Parts of ``make test`` and the CPU seconds that each may take: measured in a fresh clone on
# 2026-11-27, and a quarter.
BUDGET_S: dict[str, int] = {
    "breaks": 16, "budget": 26, "cosim": 884, "faults": 20, "formal": 152, "unit/firmware": 140,
    "unit/host": 150, "unit/plant": 28, "unit/project": 70, "unit/rtl": 702,
    "unit/simulators": 14, "unit/softcore": 102}
LONGEST = 12   # number of files in the table


@dataclass(frozen=True)
class Measured:
    """CPU seconds of one test, with its place in the project."""

    test: str
    seconds: float


def cpu_s() -> float:
    """CPU seconds that this process and the children it has waited for have taken so far."""
    usages = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def part_of(test: str) -> str:
    """Part of the tests that one belongs to: the folders of its file below ``testbench``."""
    return test.split("::")[0].rpartition("/")[0].removeprefix("testbench/")


def table(measured: Iterable[Measured]) -> list[str]:
    """Lines that say how long each part took, and its longest files."""
    parts: dict[str, float] = defaultdict(float)
    files: dict[str, float] = defaultdict(float)
    for one in measured:
        parts[part_of(one.test)] += one.seconds
        files[one.test.split("::")[0]] += one.seconds
    lines = [f"{'part':<16}{'CPU s':>8}{'budget':>8}"]
    for part, seconds in sorted(parts.items()):
        budget = BUDGET_S.get(part)
        over = "  over its budget" if budget is not None and seconds > budget else ""
        lines.append(f"{part:<16}{seconds:8.0f}{'-' if budget is None else budget:>8}{over}")
    lines.append(f"{'all':<16}{sum(parts.values()):8.0f}{sum(BUDGET_S.values()):>8}")
    longest = sorted(files.items(), key=lambda item: -item[1])[:LONGEST]
    return [*lines, "", *(f"{seconds:8.1f}  {file}" for file, seconds in longest)]
