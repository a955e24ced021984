# SPDX-License-Identifier: Apache-2.0
"""The list of scenarios: each runs natively and under cocotb, and must return the same."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field

from testbench.cosim import (
    bursts,
    contact,
    faults,
    gates,
    programs,
    reaction,
    retractions,
    servo,
    staircase,
    tapes,
)
from testbench.native.station import Session

__all__ = ["SCENARIOS", "Scenario"]


@dataclass(frozen=True)
class Scenario:
    """A function of a session, its further arguments, and the machine of the session."""

    function: Callable[..., dict]
    arguments: dict = field(default_factory=dict)
    machine: str = "sinker"

    def __str__(self):
        return "-".join([self.function.__name__, *map(str, self.arguments.values())])

    def run(self, session: Session) -> dict:
        """Run it; return its figures, as JSON gives them back."""
        return json.loads(json.dumps(self.function(session, **self.arguments)))


SCENARIOS = (
    Scenario(retractions.simple),
    Scenario(retractions.above_start_speed),
    Scenario(retractions.at_corners),
    Scenario(retractions.during_readvance, {"phase": "high"}),
    Scenario(retractions.during_readvance, {"phase": "low"}),
    Scenario(retractions.before_first_point, {"bound": "limit"}),
    Scenario(retractions.before_first_point, {"bound": "ceiling"}),
    Scenario(retractions.before_first_point, {"bound": "soft"}),
    Scenario(retractions.clearing_at_limit),
    Scenario(retractions.never_clearing, {"speed": 300}),
    Scenario(retractions.never_clearing, {"speed": 1500}),
    Scenario(retractions.limit_between_blocks),
    Scenario(retractions.from_mdi),
    Scenario(retractions.by_current, machine="wire"),
    Scenario(bursts.burst),
    Scenario(bursts.rapid),
    Scenario(bursts.ceiling_wins),
    Scenario(bursts.jump),
    Scenario(bursts.jump_into_short),
    Scenario(bursts.operator_retracts),
    Scenario(bursts.hold_and_resume),
    Scenario(bursts.no_data),
    *(Scenario(reaction.at_speed, {"speed": speed, "shorts": shorts})
      for speed, shorts in reaction.SPEEDS),
    *(Scenario(faults.tripped, {"cause": cause}) for cause in faults.FAULTS),
    *(Scenario(faults.hung, {"kind": kind, "delay": delay})
      for kind, delay in (("clock", 0), ("clock", 1234), ("clock", 7777), ("memory", 0),
                          ("memory", 1234), ("memory", 7777))),
    *(Scenario(faults.browned_out, {"clocks": clocks}) for clocks in (1, 20_000)),
    Scenario(contact.touches, dict(zip(("blocks", "highest"), contact.WAYS["feed"], strict=True))),
    Scenario(gates.stuck, {"kind": "main", "when": "cut"}),
    Scenario(servo.both_ways),
    Scenario(servo.widens_beyond),
    Scenario(servo.stuck_open),
    Scenario(servo.never_down),
    Scenario(servo.stuck_short),
    Scenario(servo.thresholds),
    *(Scenario(servo.cell, {"trouble": trouble}) for trouble in servo.TROUBLES),
    Scenario(staircase.steps_in_one_block),
    Scenario(staircase.steps_under_servo),
    Scenario(staircase.crowded_steps),
    Scenario(tapes.flipped_bits, {"count": 20, "choice": 1}),
    Scenario(tapes.flipped_bits, {"count": 5, "choice": 1}),
    Scenario(tapes.broken_tapes),
    Scenario(tapes.noisy_line),
    Scenario(tapes.hard_work),
    Scenario(programs.begins, {"on": "wire", "tape": "wire_slot", "until_s": 1.0}, "wire"),
    # The feed mode is in force from 0.5 s on; the last event, after a retraction, is at 1.03 s.
    *(Scenario(programs.begins, {"on": "wall", "tape": f"wire_finish_p{mode}", "until_s": 1.1},
               "wall") for mode in (2, 3, 4, 5)),
    Scenario(programs.planned_series),
    # To the first natural short, a jump, and the alarm; in both codes.
    Scenario(tapes.natural, {"name": "sink_shallow_deep.ptp", "until_s": 3.1}),
    Scenario(tapes.natural, {"name": "sink_jump.eia.ptp", "until_s": 1.4}),
    Scenario(tapes.natural, {"name": "sink_persistent_short.ptp", "until_s": 3}),
)
