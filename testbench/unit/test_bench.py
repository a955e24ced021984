# SPDX-License-Identifier: Apache-2.0
"""What ``make bench`` reckons from the changes of a run."""

from testbench.bench import Reaction, reactions


def test_reactions_are_counted_from_the_completing_sample():
    changes = [
        (90, "pp", 1), (91, "pp", 0),
        (100, "completed", 1), (101, "completed", 0),
        (103, "pp", 1), (104, "pp", 0),             # the last forward pulse
        (106, "path_status_reverse", 1),
        (108, "pp", 1),                              # backwards already
        (110, "event_head_valid", 1), (130, "event_head_valid", 0),
        (500, "event_head_valid", 1), (520, "event_head_valid", 0),
        (900, "completed", 1), (902, "path_status_reverse", 1), (940, "event_head_valid", 0),
        (990, "completed", 1),                       # the run ended here
    ]
    assert reactions(changes) == [Reaction(3, 6, 30), Reaction(0, 2, 40)]
