# SPDX-License-Identifier: Apache-2.0
"""The bar with which the operator walks along the path; it is there while the machine is held."""

from nicegui import ui

from host.panel.frame import Frame
from host.panel.walking import STEPS_MM, Walking

__all__ = ["WalkBar"]

# Back from the front and forward again, in the order of the path.
STEPS = (*STEPS_MM, *(-step for step in reversed(STEPS_MM)))


class WalkBar:
    """How far the machine is before the front, and buttons that send it along the path."""

    def __init__(self, page: Frame) -> None:
        self.page, self.walking = page, Walking(page.session.pending)
        with ui.element("div").classes("card walk-card").props('data-testid="walk"') as self.bar:
            with ui.element("div").classes("spread"):
                self.place = ui.label().classes("walk-place").props('data-testid="walk-place"')
                ui.label("Walk back along the path and forward again: nothing is cut. Resume goes "
                         "to the front, and on with the work.").classes("soft")
            self.buttons = {step: self._button(step) for step in STEPS}

    def _button(self, step: float) -> ui.button:
        way, arrow = (("back", "icon=chevron_left") if step > 0 else
                      ("forward", "icon-right=chevron_right"))
        return ui.button(f"{abs(step):g} mm {way}", color=None,
                         on_click=lambda: self._walk(step)).classes("plain").props(
                             f'no-caps {arrow} data-testid="walk-{way}-{abs(step):g}"')

    def _walk(self, step: float) -> None:
        place = self.walking.place(self.page.session.heard, step)
        if place is not None:
            self.page.order("line", self.walking.order(place))

    def show(self, mine: bool) -> None:
        """Show the bar while the machine is held; ``mine``: this page has the controls."""
        session = self.page.session
        heard = session.heard
        shown = session.link == "connected" and self.walking.offered(heard)
        self.bar.set_visibility(shown)
        if not shown:
            return
        distance = self.walking.distance(heard)
        self.place.set_text("On hold at the front of the path" if not distance else
                            f"On hold {distance:.4f} mm before the front, along the path")
        for step, button in self.buttons.items():
            button.set_enabled(mine and self.walking.place(heard, step) is not None)
