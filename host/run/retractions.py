# SPDX-License-Identifier: Apache-2.0
"""Retractions of a run, put together from its events."""

from dataclasses import dataclass, field

from host.run.events import Event


@dataclass
class Retraction:
    """One retraction: its start, its end, the way back and the resumption, as events.

    ``limit`` is the retractable limit in force, mm; it does not hold for a jump, and events do not
    give a jump's distance.
    """

    number: int
    start: Event
    limit: float | None
    end: Event | None = None
    advances: list[Event] = field(default_factory=list)
    resume: Event | None = None

    @property
    def cause(self) -> str:
        return str(self.start["cause"])

    @property
    def distance(self) -> float:
        """Millimetres of commanded path from the first start point; 0 if it did not end."""
        return self.end["distance"] if self.end else 0.0

    @property
    def seconds(self) -> float | None:
        """Time from the start to the resumption of the feed."""
        return self.resume["t"] - self.start["t"] if self.resume else None

    def phase(self, name: str) -> Event | None:
        """The re-advance ``high`` or ``low``, if there was one."""
        return next((event for event in self.advances if event["phase"] == name), None)


def collect(events: list[Event]) -> list[Retraction]:
    """Retractions of a run, in order."""
    found: list[Retraction] = []
    limit: float | None = None
    for event in events:
        kind = event["event"]
        if kind == "retraction_set":
            limit = event["limit"]
        elif kind == "retraction_start":
            bound = None if event["cause"] == "jump" else limit
            found.append(Retraction(len(found) + 1, event, bound))
        elif found and kind == "retraction_end":
            found[-1].end = event
        elif found and kind == "readvance":
            found[-1].advances.append(event)
        elif found and kind == "resume" and found[-1].resume is None:
            found[-1].resume = event
    return found


def most_telling(retractions: list[Retraction]) -> Retraction | None:
    """The retraction to show in close-up: the longest that is complete and has every phase.

    If there is none, the nearest to that.
    """
    def worth(one: Retraction) -> tuple[bool, int, bool, float]:
        return (one.resume is not None, len(one.advances), one.cause == "short", one.distance)
    return max(retractions, key=worth, default=None)
