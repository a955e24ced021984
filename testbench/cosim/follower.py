# SPDX-License-Identifier: Apache-2.0
"""Retractions of a run of any length, followed pulse by pulse during the run."""

from dataclasses import dataclass, field
from itertools import groupby

from rtl.states import State

__all__ = ["WATCHED", "Follower", "Way"]

WATCHED = ("path_command", "path_position", "path_front", "path_status_state", "retraction_first",
           "axis_z_command")


@dataclass
class Way:
    """One way back and forth: clocks, start points, the lowest coordinate commanded.

    ``net`` is the sum of its path pulses from the first backward one on: a pulse under way when the
    short came still belongs to the way forward. ``changeovers`` are the distances to the start
    point at which the re-advance changed from high to low.
    """

    begin: int
    front: int
    first: int = 0
    lowest: int = 0
    back: bool = False
    net: int = 0
    changeovers: list[int] = field(default_factory=list)
    end: int | None = None


@dataclass
class Follower:
    """Takes the changes of ``WATCHED`` piece by piece; ``ways`` are the excursions so far.

    Raises
    ------
    AssertionError
        If the path jumps, or Z has a different place at a coordinate that was passed before.
    """

    ways: list[Way] = field(default_factory=list)
    values: dict[str, int] = field(default_factory=dict)
    places: dict[int, int] = field(default_factory=dict)

    def take(self, changes: list[tuple[int, str, int]]) -> None:
        """Go on with the changes that came after those before."""
        for clock, together in groupby(changes, key=lambda change: change[0]):
            now = self.values | {name: value for _, name, value in together}
            if self.values:
                self._clock(clock, self.values, now)
            self.values = now

    def _clock(self, clock, before, now):
        pulses = now["path_position"] - before["path_position"]
        for name in ("path_command", "path_position"):
            assert abs(now[name] - before[name]) <= 1, f"{name} jumps in clock {clock}"
        if pulses:
            # The axis has followed the pulse before: pulses are at least 4 clocks apart.
            at, z = before["path_position"], before["axis_z_command"]
            assert self.places.setdefault(at, z) == z, f"path coordinate {at}, clock {clock}"
        was, state = State(before["path_status_state"]), State(now["path_status_state"])
        if was is State.FRONT and state is State.STOPPING:
            self.ways.append(Way(clock, now["path_front"], lowest=now["path_command"]))
        way = self.ways[-1] if self.ways else None
        if way is None or way.end is not None:
            return
        way.back = way.back or state is State.RETRACTING
        way.net += pulses if way.back else 0
        way.front = now["path_front"]
        way.first = now["retraction_first"]
        way.lowest = min(way.lowest, now["path_command"])
        if was is State.HIGH and state is State.LOW:
            way.changeovers.append(now["path_front"] - now["path_position"])
        if state is State.FRONT and was is not State.FRONT:
            way.end = clock
