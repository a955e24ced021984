# SPDX-License-Identifier: Apache-2.0
"""Which tests are quick: those that ``make check`` runs.

All unit tests but those of the files named here, which take longest. Proofs, cosimulation, planted
breaks, faults and budgets are left to ``make test``.
"""

from pathlib import PurePosixPath

__all__ = ["FOLDERS", "SLOW", "is_quick"]

# Markers of the other tests, by their folder below ``testbench``.
FOLDERS = {"cosim": "cosim", "formal": "formal"}
SLOW: frozenset[str] = frozenset()


def is_quick(path: str) -> bool:
    """Whether the tests of a file are quick, given by its place in the project."""
    place = PurePosixPath(path)
    return place.parts[:2] == ("testbench", "unit") and place.stem not in SLOW
