# SPDX-License-Identifier: Apache-2.0
"""Which tests are quick: those that ``make check`` runs.

They are all unit tests except those in the files named here, which take longest. Proofs,
cosimulation, planted breaks, faults and budgets are left to ``make test``.
"""

from pathlib import PurePosixPath

__all__ = ["FOLDERS", "SLOW", "is_quick"]

# Markers of the other tests, by their folder below ``testbench``.
FOLDERS = {"cosim": "cosim", "formal": "formal"}
# The slowest: nearly all of them take more than 4 s on one core.
SLOW = frozenset({
    "firmware/test_arc", "firmware/test_corpus", "firmware/test_fuzz", "firmware/test_image",
    "firmware/test_journal", "firmware/test_path", "firmware/test_planned",
    "firmware/test_realtime_bytes", "firmware/test_tables", "host/test_cli",
    "host/test_experiment_removal", "host/test_interrupted", "host/test_live", "host/test_load",
    "host/test_report", "host/test_roughing", "host/test_staircase", "host/test_subprograms",
    "host/test_tune", "plant/test_gap", "plant/test_ignition", "project/test_boards",
    "project/test_pages", "project/test_types", "rtl/test_axis", "rtl/test_condition_switch",
    "rtl/test_constant_removal", "rtl/test_dac", "rtl/test_discriminator", "rtl/test_fluid",
    "rtl/test_from_ignition", "rtl/test_from_ignition_many", "rtl/test_motion_forward",
    "rtl/test_preset_counter", "rtl/test_preset_counter_race", "rtl/test_ramp",
    "rtl/test_removal", "rtl/test_retraction", "rtl/test_retraction_contact",
    "rtl/test_retraction_orders", "rtl/test_retraction_ramps", "rtl/test_retraction_servo",
    "rtl/test_sampler", "rtl/test_supervision",
    "simulators/test_whole_tests", "softcore/test_cpu", "softcore/test_link_decoder",
    "softcore/test_memory"})


def is_quick(path: str) -> bool:
    """Whether the tests of a file are quick, given by its place in the project."""
    place = PurePosixPath(path)
    unit = PurePosixPath("testbench/unit")
    return (place.is_relative_to(unit)
            and place.relative_to(unit).with_suffix("").as_posix() not in SLOW)
