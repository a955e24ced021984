# SPDX-License-Identifier: Apache-2.0
"""The tab of the gap oscilloscope: trigger, orders, and what is in the record."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import ui

from host.errors import UsageError
from host.scope.acquire import BEFORE, CROSSES, MOST_BEFORE, TRIGGERS, Trigger
from host.scope.record import PULSES

if TYPE_CHECKING:
    from host.panel.tabs import Frame

__all__ = ["SHARES", "ScopeTab"]

SHARES = {1.0: "whole record", 0.25: "a quarter", 0.05: "a twentieth", 0.01: "a hundredth"}
STATES = {"idle": "Not armed.", "armed": "Armed: waits for the trigger.",
          "triggered": "Triggered: records what follows.", "reading": "Reads the record."}


class ScopeTab:
    """The tab; ``share`` is the part of the record that the page shows, around the trigger."""

    def __init__(self, page: "Frame") -> None:
        self.page, self.scope = page, page.session.scope
        ui.label("Voltage, comparators and pulse classes around a trigger. The picture is in "
                 "place of the strips, as long as this tab is open.").classes("soft")
        self.trigger = ui.select({word: f"{word}: {text}" for word, (_, text) in TRIGGERS.items()},
                                 value="short", label="trigger").props(
                                     'dense outlined data-testid="trigger"').style(
                                         "width:100%;margin:8px 0")
        with ui.row().style("gap:8px;width:100%;flex-wrap:nowrap"):
            self.level = ui.number("level, V", value=50, min=0, max=99).props(
                "dense outlined").bind_visibility_from(
                    self.trigger, "value", lambda word: word in CROSSES).style("flex:1")
            self.before = ui.number("before, %", value=BEFORE, min=0, max=MOST_BEFORE).props(
                "dense outlined").style("flex:1")
        for element in (self.trigger, self.level, self.before):
            page.locked(element)
        with ui.row().style("gap:8px;margin:8px 0;width:100%;flex-wrap:nowrap"):
            for title, order, kind in (("Single", "single", "key-resume"), ("Run", "run", "plain"),
                                       ("Force", "force", "plain"), ("Stop", "stop", "plain")):
                button = ui.button(title, color=None, on_click=lambda order=order:
                                   self._order(order)).props(
                                       f'no-caps data-testid="scope-{order}"').classes(kind)
                page.locked(button.style("flex:1;padding:4px 6px"))
        self.state = ui.label().props('data-testid="scope-state"')
        self.share = ui.select(SHARES, value=1.0, label="shown, around the trigger").props(
            'dense outlined data-testid="share"').style("width:100%;margin:8px 0")
        self.facts = ui.html(sanitize=False).classes("facts").props('data-testid="scope-facts"')
        ui.button("Save as gap.csv", color=None, on_click=self._save).props(
            "no-caps dense").classes("plain").style("padding:2px 10px;margin-top:8px")

    def _order(self, name: str) -> None:
        if name in ("stop", "force"):
            self.page.order(f"scope_{name}")
            return
        word = str(self.trigger.value)
        try:
            trigger = Trigger(word, float(self.level.value or 0) if word in CROSSES else None,
                              int(self.before.value or 0))
        except UsageError as error:
            ui.notify(f"{str(error)[:1].upper()}{str(error)[1:]}", type="warning", position="top")
            return
        self.page.order("scope", trigger, name == "run")

    def _save(self) -> None:
        record = self.scope.record
        if record is None:
            ui.notify("There is no record yet.", type="warning", position="top")
            return
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "gap.csv"
            record.write_csv(path)
            ui.download.content(path.read_bytes(), "gap.csv")

    def show(self) -> None:
        """Show the state, and the facts of the record."""
        scope = self.scope
        self.state.set_text(f"{scope.failed[:1].upper()}{scope.failed[1:]}" if scope.failed else
                            f"{STATES.get(scope.state, scope.state)}"
                            f"{' Goes on after each record.' if scope.runs else ''}")
        if not self.page.changed("scope facts", scope.number) or scope.record is None:
            return
        record = scope.record
        pulses = ", ".join(f"{count} {word.replace('_', ' ')}" for number, word in enumerate(PULSES)
                           if word and (count := int((record.pulse == number).sum())))
        rows = (("record", f"number {scope.number}, {len(record)} entries"),
                ("time", f"{record.time_us[0] / 1000:.2f} to {record.time_us[-1] / 1000:.2f} ms"),
                ("samples", str(len(record.samples))), ("pulses", pulses or "none"))
        self.facts.set_content("".join(
            f'<span class="key">{key}</span><span class="value">{value}</span>'
            for key, value in rows))
