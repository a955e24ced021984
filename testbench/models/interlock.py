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


BY_AXIS = ("drive_fault", "limit_low", "limit_high", "error_saturated", "encoder",
           "following_stopped", "following_moving", "coder", "travel")
ENDS = ("limit_low", "limit_high")


@dataclass
class Interlock:
    """Call ``begin`` with the inputs of a clock, look, then ``end``. Times are in clocks."""

    release: int
    splash: int
    axes: int = 3
    blamed: int = 0
    left: dict = field(default_factory=lambda: dict.fromkeys(ENDS, 0))  # excused, bit by axis
    live: frozenset = frozenset()
    latched: frozenset = POWER_ON
    told: frozenset = POWER_ON    # causes of the trip that is told
    first: str = "power_on"
    tripped: bool = False
    inputs: dict = field(default_factory=dict)

    def __post_init__(self):
        self.switches = {end: [Debounce(2, self.release) for _ in range(self.axes)]
                         for end in ENDS}
        self.fluid = Debounce(self.splash, self.splash)

    def begin(self, **inputs):
        self.inputs = inputs
        live = {"estop", "drive_fault", "watchdog", "error_saturated", "encoder",
                "following_stopped", "following_moving", "coder", "travel", "contact", "gate",
                "memory", "guard"}
        live = {name for name in live if inputs[name]}
        live |= {end for end in ENDS if self.at(end) & ~self.left[end]}
        live |= {"firmware"} if inputs["stop"] else set()
        if self.fluid.steady and inputs["discharging"] and inputs["fluid_required"]:
            live |= {"fluid_low"}
        self.live = frozenset(live)

    @property
    def safe(self):
        return bool(self.live or self.latched)

    @property
    def leaving(self):
        return any(self.left.values())

    def at(self, end):
        """Bits of the switches of an end."""
        return sum(switch.steady << axis for axis, switch in enumerate(self.switches[end]))

    def _whose(self, cause):
        if cause in ENDS:
            return self.at(cause) & ~self.left[cause]
        return self.inputs[cause] if cause in BY_AXIS else 0

    def end(self):
        cleared = self.inputs["clear"] and self.inputs["key"] == 0x5A
        self.tripped = bool(self.live and not self.latched)
        left_untold = cleared and self.live and self.first not in self.live
        if self.tripped or left_untold:
            self.told, self.first = self.live, min(self.live, key=CAUSES.index)
            self.blamed = self._whose(self.first)
        leave = self.inputs["leave"] and self.inputs["leave_key"] == 0x5A and self.safe
        for end in ENDS:
            kept = 0 if self.inputs["onto"] or self.live else self.left[end] & self.at(end)
            self.left[end] = self.at(end) if leave else kept
        self.latched = self.live if cleared else self.latched | self.live
        for end, switches in self.switches.items():
            for axis, switch in enumerate(switches):
                switch.clock(self.inputs[end] >> axis & 1)
        self.fluid.clock(self.inputs["fluid_low"])
