# SPDX-License-Identifier: Apache-2.0
"""Which tests are quick: those that ``make check`` runs.

All unit tests but those of the files named here, which take longest. Proofs, cosimulation, planted
breaks, faults and budgets are left to ``make test``.
"""

from pathlib import PurePosixPath

__all__ = ["FOLDERS", "SLOW", "is_quick"]

# Markers of the other tests, by their folder below ``testbench``.
FOLDERS = {"cosim": "cosim", "formal": "formal"}
# More than some 5 s each on one core, all of them five sixths of the unit tests' time.
SLOW = frozenset({
    "test_axis", "test_boards", "test_cli", "test_condition_switch", "test_constant_removal",
    "test_experiment_removal", "test_firmware_arc", "test_firmware_fuzz", "test_firmware_image",
    "test_firmware_planned", "test_fluid", "test_live", "test_preset_counter",
    "test_preset_counter_race", "test_removal", "test_report", "test_retraction",
    "test_retraction_contact",
    "test_retraction_ramps", "test_retraction_servo", "test_roughing", "test_staircase",
    "test_supervision", "test_tables_firmware"})


def is_quick(path: str) -> bool:
    """Whether the tests of a file are quick, given by its place in the project."""
    place = PurePosixPath(path)
    return place.parts[:2] == ("testbench", "unit") and place.stem not in SLOW
