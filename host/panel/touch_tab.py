# SPDX-License-Identifier: Apache-2.0
"""The tab in which the machine is homed and the work is found by touching it."""

from typing import Any

from nicegui import ui

from host.errors import UserError
from host.panel.session import Session
from host.panel.touching import Touching
from host.touch.cycles import Probe

__all__ = ["TouchTab"]

SHAPES = {"edge": "an edge, or a surface", "corner": "a corner", "hole": "the middle of a hole",
          "boss": "the middle of a boss or block"}
STEPS = {
    "edge": "Jog before the surface, not further from it than the reach.",
    "corner": "Jog beside the side that the X sign leads to, at most 2 mm from the corner.",
    "hole": "Jog into the hole, anywhere. The reach must be more than its diameter.",
    "boss": "With a lift: jog over its middle. Without: jog beside it at least X, 0.5 mm off.",
}
NO_ZERO = 0
ZEROS = {NO_ZERO: "set no zero", **{number: f"set the zero of G{53 + number}"
                                    for number in range(1, 7)}}


class TouchTab:
    """The tab *Touch*; ``page`` is the page that it is on (``host.panel.tabs.Frame``)."""

    def __init__(self, page: Any) -> None:
        self.page = page
        session: Session = page.session
        self.round = session.machine.kind == "wire"
        axes = "XY" if self.round else "XYZ"
        ui.label("Home").classes("heading")
        ui.label("Every axis goes onto its reference switch, first the jump axis. Z needs room "
                 "above it.").classes("soft")
        page.locked(ui.button("Home all axes ($H)", color=None,
                              on_click=lambda: page.order("line", "$H")).classes("plain").props(
                                  'no-caps data-testid="home"').style("margin:8px 0"))
        ui.label("Find the work by touching it").classes("heading")
        self.shape = self._select("what", SHAPES, "edge", "shape")
        self.step = ui.label().classes("soft").style("margin:4px 0")
        self.shape.on_value_change(self._suit)
        self.edge = self._select("direction", {f"{axis}{sign}": f"{axis} {sign}" for axis in axes
                                               for sign in "+-"},
                                 "X+" if self.round else "Z-", "edge")
        self.corner = self._select("direction", [f"X{x}Y{y}" for x in "+-" for y in "+-"], "X+Y+",
                                   "corner")
        with ui.element("div").style(
                "display:grid;grid-template-columns:repeat(2,1fr);gap:8px;margin-top:8px"):
            diameter = session.machine.tables.get("wire", {}).get("diameter_mm", 0.0)
            self.radius = self._number("radius of electrode or wire", diameter / 2, "radius")
            self.offset = self._number("contact offset", 0.0, "offset")
            self.reach = self._number("reach", 5.0, "reach")
            self.size = self._number("size, roughly", 10.0, "size")
            self.lift = self._number("lift (0: go round)", 0.0 if self.round else 5.0, "lift")
            self.known = self._number("true diameter, to calibrate the offset", None, "known")
        self.zero = self._select("zero", ZEROS, NO_ZERO, "zero")
        page.locked(ui.button("Touch", color=None, on_click=self._touch).classes(
            "key-resume").props('no-caps data-testid="touch"').style("width:100%;margin-top:8px"))
        ui.label("The discharge stays off. Each side is touched quickly, then slowly. Hold stops "
                 "it, Stop ends it; so does letting go of the controls.").classes("soft").style(
                     "margin-top:8px")
        self._suit()

    def _select(self, label: str, options: Any, value: Any, name: str) -> Any:
        return self.page.locked(ui.select(options, value=value, label=label).props(
            f'dense outlined data-testid="touch-{name}"').style("width:100%;margin-top:4px"))

    def _number(self, label: str, value: float | None, name: str) -> Any:
        return self.page.locked(ui.number(label, value=value, step=0.001, format="%.4g").props(
            f'dense outlined suffix=mm data-testid="touch-{name}"'))

    def _suit(self) -> None:
        """Show what the shape needs."""
        shape = self.shape.value
        self.step.set_text(STEPS[shape])
        self.edge.set_visibility(shape == "edge")
        self.corner.set_visibility(shape == "corner")
        for field in (self.size, self.lift):
            field.set_visibility(shape == "boss")
        self.known.set_visibility(shape in ("hole", "boss"))

    def _touch(self) -> None:
        shape = self.shape.value

        def number(field: Any) -> float:
            return float(field.value or 0.0)

        known = float(self.known.value) if self.known.value and shape in ("hole", "boss") else None
        try:
            touching = Touching(
                shape, Probe(radius=number(self.radius), offset=number(self.offset),
                             reach=number(self.reach)),
                toward=self.corner.value if shape == "corner" else self.edge.value,
                size=number(self.size), lift=number(self.lift), known=known,
                system=self.zero.value or None)
        except UserError as error:
            text = str(error)
            ui.notify(f"{text[:1].upper()}{text[1:]}", type="warning", position="top")
            return
        self.page.order("touch", touching)

    def show(self) -> None:
        """Take over a contact offset that has been calibrated."""
        offset = self.page.session.offset
        if offset is not None and self.page.changed("offset", offset):
            self.offset.set_value(offset)
