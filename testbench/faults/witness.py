# SPDX-License-Identifier: Apache-2.0
"""A simulation that records pins, lines from the controller, and actions from outside.

A controller's own reports are no evidence of its state. So the outcome of a fault is judged by the
pins, by the true places of the plant's axes, and by the bytes on the line.
"""

import re
from dataclasses import dataclass

from testbench.cosim.record import Record
from testbench.faults.pins import PINS
from testbench.native.simulation import Simulation
from testbench.native.station import AXES

__all__ = ["MM", "Told", "Witness"]

MM = 10_000             # pulses
REPORT = re.compile(r"^<(\w+)[^|>]*\|MPos:([-\d.,]+)([^>]*)>", re.MULTILINE)
ASKED_S = 0.05          # time within which a working controller answers a `?`
# Forces that are no faults: the place of the work, and the operator's hand.
NO_FAULT = {"force.arm", "force.gap_um", "force.debris", "force.fluid_ohm_cm", "force.short"}


@dataclass(frozen=True)
class Told:
    """A status report: state, places in pulses, and whether it calls them lost."""

    state: str
    places: list[int]
    lost: bool


class Witness(Simulation):
    """A ``Simulation`` that keeps a record.

    ``pins`` is the record of the pins, from the first ``watch`` on. ``deeds`` lists the forces,
    writes and damages from outside, each with its clock. The parameters are those of
    ``Simulation``.
    """

    def __init__(self, **options):
        self.pins = Record()
        self.deeds: list[tuple[int, str]] = []
        self._heard: list[tuple[int, bytes]] = []
        self._made = False
        super().__init__(trace=False, **options)
        self._made = True
        self.watch(())

    # ---- what is done to it

    def _note(self, deed):
        if self._made:
            self.deeds.append((self.cycle, deed))

    def set(self, name, value):
        if name.startswith("force.") and name not in NO_FAULT and value:
            self._note(f"{name} = {value:g}")
        super().set(name, value)

    def poke(self, name, value):
        self._note(f"{name} = {value}")
        super().poke(name, value)

    def load(self, image):
        self._note("the memory is overwritten")
        super().load(image)

    def send_broken(self, byte):
        self._note(f"0x{byte:02X} without its stop bit")
        super().send_broken(byte)

    def damage(self, seed, **shares):
        self._note("the line is bad from now on")
        super().damage(seed, **shares)

    @property
    def begun(self) -> int | None:
        """Clock of the first fault; None if there was none."""
        return self.deeds[0][0] if self.deeds else None

    # ---- what it does

    def watch(self, names):
        super().watch(dict.fromkeys([*names, *PINS]))

    def changes(self):
        rows = super().changes()
        self.pins.extend([row for row in rows if row[1] in PINS])
        return rows

    def received(self):
        data = super().received()
        if data:
            self._heard.append((self.cycle, data))
        return data

    def said(self, since: int = 0) -> str:
        """All lines of the controller from a clock on, as text."""
        return b"".join(data for clock, data in self._heard if clock >= since).decode(
            "ascii", "replace")

    def true_places(self) -> list[float]:
        """True places of the axes, in pulses."""
        return [self.get(f"read.{axis}_pulses") for axis in AXES]

    def told(self) -> Told | None:
        """State and places that the controller reports on request; None if it does not answer."""
        since = self.cycle
        self.send(b"?")
        self.run(round(ASKED_S * self.clock_hz))
        self.received()
        found = REPORT.findall(self.said(since + 1))
        if not found:
            return None
        state, places, rest = found[-1]
        return Told(state, [round(float(place) * MM) for place in places.split(",")],
                    "|Lost" in rest)
