# SPDX-License-Identifier: Apache-2.0
"""Record of watched signals, exact to the clock, and the checks of a retraction in it."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field
from itertools import pairwise

from rtl.safety.watchdog import SECOND_KEY, THIRD_KEY
from rtl.states import State

__all__ = ["SIGNALS", "WATCHDOG", "WATCHDOG_S", "Excursion", "Record"]

SIGNALS = ("path_command", "path_position", "path_front", "path_status_state",
           "path_status_reverse", "axis_x_command", "axis_y_command", "axis_z_command",
           "gap_status_shorted", "completed", "pp", "go", "ramp_above", "retraction_first",
           "event_head_valid", "safety_status_safe", "power_control_machining")

WATCHDOG = ("safety_pet_strobe", "safety_pet")
WATCHDOG_S = 5e-3   # longest time between two calls

FEWEST_PULSES = 20  # a speed is measured over at least so many


@dataclass
class Excursion:
    """One way back and forth, from leaving the front to the return there.

    ``begin`` and ``end`` are clocks; ``end`` is None if the machine has not come back. ``states``
    are the states entered, with their clocks. ``front`` is the start point of the last retraction
    in it, ``first`` the first of its short burst; ``lowest`` the lowest coordinate commanded.
    """

    begin: int
    end: int | None
    states: list[tuple[int, State]]
    front: int
    first: int
    lowest: int

    def entered(self, state: State) -> list[int]:
        """Clocks in which a state was entered."""
        return [clock for clock, now in self.states if now is state]


@dataclass
class Record:
    """Changes of signals: for each, the clocks and the values from then on."""

    signals: dict[str, tuple[list[int], list[int]]] = field(default_factory=dict)

    def extend(self, changes: list[tuple[int, str, int]]) -> None:
        """Add later changes."""
        for clock, name, value in changes:
            clocks, values = self.signals.setdefault(name, ([], []))
            clocks.append(clock)
            values.append(value)

    def at(self, name: str, clock: int) -> int:
        """Value of a signal in a clock."""
        clocks, values = self.signals[name]
        return values[max(0, bisect_right(clocks, clock) - 1)]

    def changes(self, name: str, begin: int = 0, end: int | None = None) -> list[tuple[int, int]]:
        """Clock and new value of each change in ``begin`` <= clock < ``end``."""
        clocks, values = self.signals[name]
        span = slice(bisect_left(clocks, begin), None if end is None else bisect_left(clocks, end))
        return list(zip(clocks[span], values[span], strict=True))

    def rises(self, name: str, begin: int = 0, end: int | None = None) -> list[int]:
        """Clocks in which a signal of one bit became 1."""
        return [clock for clock, value in self.changes(name, begin, end) if value]

    def lowest(self, name: str, begin: int, end: int | None = None) -> int:
        """Lowest value from ``begin`` to before ``end``."""
        return min([self.at(name, begin), *(value for _, value in self.changes(name, begin, end))])

    # ---- the watchdog

    def watch_keys(self, begin: int = 0) -> list[tuple[int, int]]:
        """Clock and key of every write to it."""
        return [(clock, self.at("safety_pet", clock))
                for clock in self.rises("safety_pet_strobe", begin)]

    def last_care(self, end: int) -> int:
        """Clock before ``end`` from which the watchdog waited: the last call, or answer."""
        found = {key: clock for clock, key in self.watch_keys() if clock < end}
        return min(found[SECOND_KEY], found[THIRD_KEY])

    def longest_step(self, begin: int = 0) -> int:
        """Clocks of the main loop's longest step: from one of its keys to the next."""
        steps = [clock for clock, key in self.watch_keys(begin) if key != THIRD_KEY]
        return max(after - before for before, after in pairwise(steps))

    def watched_well(self, clock_hz: int, begin: int = 0) -> int:
        """Clocks of the longest step.

        Raises
        ------
        AssertionError
            If it takes more than three quarters of the watchdog's period. A call in the first
            quarter is too soon and left out; so the next step has the rest.
        """
        longest = self.longest_step(begin)
        assert longest < 0.75 * WATCHDOG_S * clock_hz, longest
        return longest

    # ---- motion

    def excursions(self) -> list[Excursion]:
        """Every time the machine left the front of the path, in order."""
        found, states = [], self.changes("path_status_state")
        leaving = [clock for (_, before), (clock, now) in pairwise(states)
                   if before == State.FRONT.value and now == State.STOPPING.value]
        for begin in leaving:
            end = next((clock for clock, now in states
                        if clock > begin and now == State.FRONT.value), None)
            found.append(Excursion(
                begin, end, [(clock, State(now)) for clock, now in states
                             if begin <= clock and (end is None or clock <= end)],
                front=self.at("path_front", self.last if end is None else end),
                first=self.at("retraction_first", self.last if end is None else end),
                lowest=self.lowest("path_command", begin, end)))
        return found

    @property
    def last(self) -> int:
        """Clock of the last change of anything."""
        return max(clocks[-1] for clocks, _ in self.signals.values())

    def check_path(self) -> None:
        """Check that the path goes pulse by pulse, and that each axis retraces itself exactly.

        Raises
        ------
        AssertionError
            If the path jumps, or an axis has a different place at a coordinate passed before.
        """
        for name in ("path_command", "path_position"):
            for (_, before), (clock, now) in pairwise(self.changes(name)):
                assert abs(now - before) == 1, (
                    f"{name} went from {before} to {now} in clock {clock}")
        places: dict[int, tuple[int, ...]] = {}
        steps = self.changes("path_position")
        for (_, coordinate), (until, _) in pairwise(steps):
            # The axes follow within a few clocks; pulses are at least 4 apart.
            place = tuple(self.at(f"axis_{axis}_command", until) for axis in "xyz")
            known = places.setdefault(coordinate, place)
            assert known == place, (
                f"at path coordinate {coordinate} the axes stood at {known}, later at {place}")

    def speed(self, begin: int, end: int) -> float | None:
        """Pulses per clock over the longest stretch at the highest speed; None if it is short."""
        steps = self.changes("ramp_above", begin, end)
        top = max([self.at("ramp_above", begin), *(value for _, value in steps)])
        edges = [(begin, self.at("ramp_above", begin)), *steps, (end, -1)]
        since, until = max(((a, b) for (a, value), (b, _) in pairwise(edges) if value == top),
                           key=lambda stretch: stretch[1] - stretch[0])
        pulses = self.rises("pp", since, until)
        if len(pulses) < FEWEST_PULSES:
            return None
        return (len(pulses) - 1) / (pulses[-1] - pulses[0])
