# SPDX-License-Identifier: Apache-2.0
"""Reference model of the interlock, with sets of causes."""

from dataclasses import dataclass, field

from testbench.models.debounce import Debounce

CAUSES = ("power_on", "estop", "drive_fault", "limit_low", "limit_high", "fluid_low", "watchdog",
          "error_saturated", "encoder", "following_stopped", "following_moving", "firmware",
          "coder", "travel", "contact", "gate", "memory", "guard")
POWER_ON = frozenset({"power_on"})


def vector(causes):
    """Return the bits of a set of causes."""
    return sum(1 << CAUSES.index(cause) for cause in causes)


@dataclass
class Interlock:
    """Call ``begin`` with the inputs of a clock, look, then ``end``. Times are in clocks."""

    release: int
    splash: int
    live: frozenset = frozenset()
    latched: frozenset = POWER_ON
    told: frozenset = POWER_ON    # causes of the trip that is told
    first: str = "power_on"
    tripped: bool = False
    inputs: dict = field(default_factory=dict)

    def __post_init__(self):
        self.low, self.high = (Debounce(2, self.release) for _ in range(2))
        self.fluid = Debounce(self.splash, self.splash)

    def begin(self, **inputs):
        self.inputs = inputs
        live = {"estop", "drive_fault", "watchdog", "error_saturated", "encoder",
                "following_stopped", "following_moving", "coder", "travel", "contact", "gate",
                "memory", "guard"}
        live = {name for name in live if inputs[name]}
        live |= {"limit_low"} if self.low.steady else set()
        live |= {"limit_high"} if self.high.steady else set()
        live |= {"firmware"} if inputs["stop"] else set()
        if self.fluid.steady and inputs["discharging"] and inputs["fluid_required"]:
            live |= {"fluid_low"}
        self.live = frozenset(live)

    @property
    def safe(self):
        return bool(self.live or self.latched)

    def end(self):
        cleared = self.inputs["clear"] and self.inputs["key"] == 0x5A
        self.tripped = bool(self.live and not self.latched)
        left_untold = cleared and self.live and self.first not in self.live
        if self.tripped or left_untold:
            self.told, self.first = self.live, min(self.live, key=CAUSES.index)
        self.latched = self.live if cleared else self.latched | self.live
        self.low.clock(self.inputs["limit_low"])
        self.high.clock(self.inputs["limit_high"])
        self.fluid.clock(self.inputs["fluid_low"])
