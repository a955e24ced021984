# SPDX-License-Identifier: Apache-2.0
"""Measuring the drives from the panel: what ``gapkeeper tune`` does, while the panel goes on."""

import threading
from collections.abc import Callable, Mapping

from host.errors import UserError
from host.link.link import Link
from host.tune.command import drawn, moves_of, told_of
from host.tune.drive import Sample
from host.tune.motions import measuring, sampled, settings_of
from host.tune.tune import Proposal, explained, proposal
from softcore.tables.settings import named

__all__ = ["Tuning"]


class Tuning:
    """One measurement of the axes of ``ways`` ("X+Z-"); nothing is changed by it.

    ``told`` are its sentences so far. At its end ``wanted`` has the proposal, ``lines`` the line
    that enters each of its values and what it is, and ``picture`` an SVG.

    Raises
    ------
    UsageError
        If ``ways`` or ``travel_mm`` is wrong.
    """

    def __init__(self, ways: str, travel_mm: float) -> None:
        self.travel_mm, self._moves = travel_mm, moves_of(ways, travel_mm)
        self.told: list[str] = []
        self.wanted: Proposal | None = None
        self.lines: list[tuple[str, str]] = []
        self.picture = ""

    def run(self, link: Link, tend: Callable[[], bool]) -> None:
        """Move the axes; ``tend`` is called often, and says whether to go on.

        The drives are found in a thread of its own: it takes seconds, in which the panel must hear
        its buttons.

        Raises
        ------
        UserError
            If an axis cannot be moved, or ``tend`` has ended it. ``told`` ends with the reason.
        """
        self.told = ["The axes move to and fro; this takes some seconds for each."]
        tended = _Tended(link, tend)
        try:
            settings = settings_of(tended)
            with measuring(link, settings) as kept:
                samples = {axis: sampled(tended, settings, axis, way, self.travel_mm,
                                         time_s=link.pipe.time_s)
                           for axis, way in self._moves.items()}
        except UserError as error:
            self.told.append(str(error))
            raise
        self.told += [*kept, "The axes have moved. Now the drives are calculated."]
        threading.Thread(target=self._find, args=(settings, samples), name="tuning",
                         daemon=True).start()

    def _find(self, settings: Mapping[str, int], samples: Mapping[str, list[Sample]]) -> None:
        try:
            found = []
            for axis, some in samples.items():
                found.append(explained(settings, axis, self.travel_mm, some))
                self.told.append(told_of(found[-1], settings))
            wanted = proposal(settings, found)
            self.picture = drawn(settings, found, wanted)
        except UserError as error:
            self.told.append(str(error))
            return
        except Exception as error:  # a fault of this program: nobody waits for what never comes
            self.told.append(f"unexpected failure, {type(error).__name__}: {error}")
            return
        self.told += wanted.notes
        self.lines = [(f"${named(name).number}={value}", f"{named(name).title}, now "
                       f"{settings[name]}") for name, value in wanted.values.items()]
        self.wanted = wanted


class _Tended:
    """A link whose reports and waits let the panel go on before."""

    def __init__(self, link: Link, tend: Callable[[], bool]) -> None:
        self._link, self._tend = link, tend
        self.pipe, self.send_line, self.press = link.pipe, link.send_line, link.press
        self.command, self.await_greeting = link.command, link.await_greeting

    @property
    def on_line(self) -> Callable[[str], None]:
        """What hears the controller's lines."""
        return self._link.on_line

    @on_line.setter
    def on_line(self, hear: Callable[[str], None]) -> None:
        self._link.on_line = hear

    def _go_on(self) -> None:
        if not self._tend():
            raise UserError("the drives have not been measured to the end.")

    def poll(self, timeout_s: float) -> None:
        """As the link's."""
        self._go_on()
        self._link.poll(timeout_s)

    def status(self) -> dict[str, str]:
        """As the link's."""
        self._go_on()
        return self._link.status()
