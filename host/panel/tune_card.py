# SPDX-License-Identifier: Apache-2.0
"""The part of the settings in which the drives are measured and their loops are tuned."""

from html import escape

from nicegui import ui

from host.errors import UserError
from host.panel.frame import Frame
from host.panel.tuning import Tuning

__all__ = ["TuneCard"]

NOT = ""            # of an axis that is not measured
TRAVEL_MM = 3.0


class TuneCard:
    """One window's choice of axes, and what the last measurement of the session says."""

    def __init__(self, page: Frame) -> None:
        self.page = page
        ui.label("Measures each drive by small motions to and fro, and proposes settings of its "
                 "position loop. Discharge off; each axis must be free to go by the travel. Stop "
                 "ends it. Nothing is changed until you enter it.").classes("soft")
        axes = "XY" if page.session.machine.kind == "wire" else "XYZ"
        with ui.element("div").style(
                "display:grid;grid-template-columns:repeat(2,1fr);gap:8px;margin:8px 0"):
            self.ways = [page.locked(ui.select(
                {NOT: f"not {axis}", f"{axis}+": f"{axis} +", f"{axis}-": f"{axis} \N{MINUS SIGN}"},
                value=f"{axis}+", label=axis).props(f'dense outlined data-testid="tune-{axis}"'))
                for axis in axes]
            self.travel = page.locked(ui.number("travel", value=TRAVEL_MM, step=0.5).props(
                'dense outlined suffix=mm data-testid="tune-travel"'))
        page.locked(ui.button("Measure", color=None, on_click=self._measure).classes(
            "key-resume").props('no-caps data-testid="tune"').style("width:100%"))
        self.told = ui.html("", sanitize=False).classes("record").props(
            'data-testid="tune-told"').style("margin-top:8px")
        self.entries = ui.element("div")
        self.picture = ui.html("", sanitize=False).classes("picture tune-picture")

    def _measure(self) -> None:
        ways = "".join(field.value for field in self.ways)
        if not ways:
            ui.notify("Choose an axis to measure.", type="warning", position="top")
            return
        try:
            tuning = Tuning(ways, float(self.travel.value or 0.0))
        except UserError as error:
            text = str(error)
            ui.notify(f"{text[:1].upper()}{text[1:]}", type="warning", position="top")
            return
        self.page.order("tune", tuning)

    def show(self) -> None:
        """Show what has changed."""
        tuning = self.page.session.tuning
        told = tuple(tuning.told) if tuning else ()
        if self.page.changed("tune told", told):
            self.told.set_content("".join(f"<div>{escape(text)}</div>" for text in told))
        lines = tuple(tuning.lines) if tuning else ()
        if self.page.changed("tune lines", lines):
            self.picture.set_content(tuning.picture if tuning else "")
            self.entries.clear()
            with self.entries:
                for line, meaning in lines:
                    button = ui.button(f"Enter {line}", color=None, on_click=lambda line=line:
                                       self.page.order("line", line)).props(
                                           "no-caps dense").classes("plain")
                    self.page.locked(button)
                    ui.label(meaning).classes("soft")
