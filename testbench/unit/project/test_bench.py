# SPDX-License-Identifier: Apache-2.0
"""Figures that ``make bench`` computes from the changes of a run."""

import re
from dataclasses import asdict

from softcore.image import SOURCES
from testbench.bench import NO_PLANNER, PLANNER
from testbench.cosim.checks import Reaction, reactions
from testbench.cosim.reaction import summary
from testbench.cosim.record import Record

# Sample in clock 99, Ss in 100. Every signal has its first value in clock 0.
BELOW = [
    *((0, name, 0) for name in ("completed", "pp", "path_status_reverse", "go", "ramp_above",
                                "event_head_valid")),
    (90, "pp", 1), (91, "pp", 0),
    (100, "completed", 1), (101, "completed", 0),
    (102, "pp", 1), (103, "pp", 0),                 # the last forward pulse
    (105, "path_status_reverse", 1), (106, "event_head_valid", 1),
    (111, "go", 1), (115, "pp", 1), (116, "pp", 0),  # backwards already
    (120, "completed", 1), (121, "completed", 0),   # no matter while it goes back
    (130, "event_head_valid", 0),
    (300, "path_status_reverse", 0), (301, "go", 0),
]
ABOVE = [
    (400, "ramp_above", 500), (401, "go", 1),
    (500, "completed", 1), (501, "completed", 0),
    (503, "ramp_above", 490), (600, "ramp_above", 0),
    (610, "pp", 1), (611, "pp", 0),
    (612, "go", 0), (613, "path_status_reverse", 1), (614, "event_head_valid", 1),
    (618, "go", 1), (634, "event_head_valid", 0),
]


def test_reactions_are_counted_from_the_completing_sample():
    record = Record()
    record.extend(BELOW + ABOVE)
    found = reactions(record)
    assert found == [Reaction(last_forward=3, slowed=0, reversed=12, taken=31),
                     Reaction(last_forward=111, slowed=4, reversed=8, taken=20)]
    assert list(summary([asdict(found[0])]).values()) == [(3, 3), (12, 12), (31, 31)]
    assert list(summary([asdict(found[1])]).values()) == [(4, 4), (8, 8), (20, 20)]


def test_firmware_without_a_planner_lacks_what_its_source_has():
    """Else both would be linked, or the planner would stay in the firmware."""
    calls = r"^(?:void|bool|roughing_\w+) (roughing_\w+)\("
    found = re.findall(calls, (SOURCES / PLANNER).read_text(), re.MULTILINE)
    assert sorted(found) == sorted(re.findall(calls, NO_PLANNER, re.MULTILINE))
    assert len(found) == 5
