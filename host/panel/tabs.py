# SPDX-License-Identifier: Apache-2.0
"""The tabs at the right of the page: tape, jog, lines by hand, settings, record of the run."""

import json
import tempfile
from html import escape
from pathlib import Path
from typing import Any

from nicegui import events, run, ui

from host.errors import UserError
from host.panel.frame import Frame
from host.panel.job import Job
from host.panel.scope_tab import ScopeTab
from host.panel.touch_tab import TouchTab
from host.panel.tune_card import TuneCard
from host.tape.start import LAST, block_of
from softcore.tables.settings import GROUPS, SETTINGS, Setting, named

__all__ = ["Tabs", "field_text", "html"]

MINUS = "\N{MINUS SIGN}"
BEFORE, SHOWN = 2, 24   # lines of the tape before the block under way, and in all
RECENT = 60         # rows of the record on the page
LARGEST = 4 << 20   # bytes of a tape that is uploaded
# Switches of the operator beside the tape, by the names of their settings.
SWITCHES = {"single_block": "Single block", "optional_stop": "Optional stop",
            "block_skip": "Block skip"}
FEEDS = {10: "10 mm/min", 60: "60 mm/min", 300: "300 mm/min", 600: "600 mm/min"}


def html(content: str = "") -> ui.html:
    """An element of HTML that this program has made; texts from elsewhere in it are escaped."""
    return ui.html(content, sanitize=False)


def field_text(value: float, digits: int) -> str:
    """A number with a fixed number of digits and a true minus sign."""
    text = f"{value:.{digits}f}"
    return text.replace("-", MINUS if float(text) else "")


class Tabs:
    """The tabs of a page."""

    def __init__(self, page: Frame, tapes: list[Path]) -> None:
        self.page, self.session = page, page.session
        self._values: dict[int, Any] = {}
        self._given: dict[int, str] = {}    # lines that set them and are not yet answered
        with ui.tabs().props("dense no-caps align=justify") as tabs:
            names = [ui.tab(name) for name in ("Tape", "Jog", "Touch", "Line", "Settings", "Record",
                                               "Gap")]
        self.tabs = tabs
        with ui.tab_panels(tabs, value=names[0], animated=False).props("keep-alive"):
            with ui.tab_panel(names[0]):
                self._tape(tapes)
            fills = (self._jog, self._touch, self._line, self._settings, self._record, self._scope)
            for name, fill in zip(names[1:], fills, strict=True):
                with ui.tab_panel(name):
                    fill()

    # ---- tape

    def _tape(self, tapes: list[Path]) -> None:
        self._known = {str(path): path.stem for path in tapes}
        self._reads: Path | None = None     # the tape that is being read
        self.choose = ui.select(self._known, label="tape", with_input=True,
                                on_change=self._chosen).props(
                                    'dense outlined data-testid="choose"').style("width:100%")
        self.page.locked(self.choose)
        self.named = ui.label().classes("soft").props('data-testid="named"')
        with ui.row().style("gap:8px;margin:8px 0;width:100%;flex-wrap:nowrap"):
            for title, order, kind in (("Start", "run", "key-resume"), ("Arm", "arm", "key-hold")):
                button = ui.button(title, color=None, on_click=self._run if order == "run" else
                                   lambda: self.page.order("arm"))
                self.page.locked(button.classes(kind).style("flex:1").props(
                    f'no-caps data-testid="{order}"'))
            self.arm = button
            self.begin = self.page.locked(ui.input("from block").props(
                'dense outlined data-testid="from"').style("flex:0 0 112px"))
        self._switches()
        upload = ui.upload(label="or a file: .nc, .ptp", auto_upload=True,
                           max_file_size=LARGEST, on_upload=self._upload,
                           on_rejected=lambda: ui.notify(
                               f"A tape has at most {LARGEST >> 20} MB.", type="warning"))
        self.page.locked(upload.props("flat bordered accept=.nc,.ptp").style(
            "width:100%;margin-bottom:8px"))
        self.listing = html().classes("tape").props('data-testid="tape"')

    def _run(self) -> None:
        wanted, job = (self.begin.value or "").strip(), self.session.job
        if self._reads is not None:
            ui.notify(f"{self._reads.name} is still being read.", type="warning", position="top")
            return
        try:
            self.page.order("run", LAST if wanted.lower() == LAST else
                            block_of(job.tape, wanted) if wanted and job else 1)
        except UserError as error:
            ui.notify(str(error), type="warning", position="top")

    def _switches(self) -> None:
        self._states: dict[int, tuple[Setting, Any]] = {}
        with ui.row().style("gap:8px;margin:0 0 8px;width:100%;flex-wrap:nowrap"):
            for setting in map(named, SWITCHES):
                button = ui.button(color=None, on_click=lambda setting=setting:
                                   self._turn(setting)).props(
                                       f'no-caps dense data-testid="{setting.name}"')
                self._states[setting.number] = setting, self.page.locked(
                    button.classes("plain switch"))
        self.dry = ui.label().classes("alarm-title").props('data-testid="dry"')

    def _turn(self, setting: Setting) -> None:
        told = self.session.heard.settings.get(setting.number)
        if told is None:
            ui.notify("It is not known yet whether this is on.", type="warning", position="top")
        else:
            self.page.order("line", f"${setting.number}={int(told == '0')}")

    def _show_switches(self) -> None:
        settings = self.session.heard.settings
        for number, (setting, button) in self._states.items():
            told = settings.get(number)
            if self.page.changed(f"switch {number}", told):
                button.set_text(f"{SWITCHES[setting.name]}: "
                                f"{'on' if told == '1' else 'off' if told else '?'}")
        feed = settings.get(named("dry_run_mm_min").number, "")
        if self.page.changed("dry", feed):
            self.dry.set_visibility(feed != "0")
            self.dry.set_text("" if feed == "0" else "Dry run: not known yet" if not feed else
                              f"Dry run: no discharge, cuts at F{feed}")

    async def _chosen(self, event: events.ValueChangeEventArguments[Any]) -> None:
        if event.value == self._in_force():     # given up what is being read
            self._reads = None
            self._show_name()
        elif event.value is not None:
            await self._choose(Path(event.value))

    def _in_force(self) -> str | None:
        """What the field of the tape shows of the one that is in force; None if it was uploaded."""
        path = str(self.session.job.path) if self.session.job else ""
        return path if path in self._known else None

    async def _choose(self, path: Path) -> None:
        """Read a tape and put it in force, unless another has been chosen meanwhile."""
        self._reads = path
        self._show_name()
        try:
            job = await run.io_bound(Job.of, path)
            if self._reads is path:
                self.page.order("choose", job)
        except UserError as error:
            ui.notify(str(error), type="warning", position="top")
        if self._reads is path:
            self._reads = None
            self._show_name()

    def _show_name(self) -> None:
        """Name the tape that is in force, which a refused choice leaves there."""
        job = self.session.job
        self.named.set_text(f"{self._reads.name} is being read" if self._reads is not None else
                            f"in force: {job.path.name}" if job else "")
        if self._reads is None:
            self.choose.set_value(self._in_force())

    async def _upload(self, event: events.UploadEventArguments) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / Path(event.file.name).name
            path.write_bytes(await event.file.read())
            await self._choose(path)

    def _show_tape(self) -> None:
        job, line = self.session.job, self.session.heard.line
        if self.page.changed("job", job):
            self._show_name()
        if not self.page.changed("tape", (job, line)):
            return
        if job is None:
            self.listing.set_content('<div class="note">No tape is chosen.</div>')
            return
        first = max(0, line - 1 - BEFORE)
        shown = job.lines[first:first + SHOWN]
        self.listing.set_content("".join(
            f'<div class="{"now" if number == line else "note" if text.startswith("(") else ""}">'
            f"<span>{number}</span>{escape(text)}</div>"
            for number, text in enumerate(shown, start=first + 1)))

    # ---- jog

    def _jog(self) -> None:
        ui.label("Move an axis as long as its button is pressed.").classes("soft")
        self.feed = ui.select(FEEDS, value=60, label="speed").props("dense outlined").style(
            "width:100%;margin:8px 0")
        self.page.locked(self.feed)
        axes = "XY" if self.session.machine.kind == "wire" else "XYZ"
        with ui.element("div").classes("jog").style(
                f"grid-template-columns:repeat({len(axes)},1fr)"):
            for way, sign in ((1, "+"), (-1, MINUS)):
                for axis in axes:
                    button = ui.button(f"{axis} {sign}", color=None).props(
                        f'no-caps unelevated data-testid="jog{axis}{sign}"').classes("plain").on(
                            "pointerdown", js_handler=f"() => jogStart('{axis}', {way})")
                    self.page.locked(button)
        ui.label("The motion is ordered a tenth of a second at a time, so it stops by itself when "
                 "the page, the computer or the cable is gone.").classes("soft").style(
                     "margin-top:10px")

    def jog_feed(self) -> float:
        """Speed of a jog, mm/min."""
        return float(self.feed.value or 60)

    # ---- home, and touch

    def _touch(self) -> None:
        self.touch = TouchTab(self.page)

    # ---- lines by hand

    def _line(self) -> None:
        ui.label("A line entered by hand (MDI): G-code, or a command such as $#.").classes("soft")
        self.line = ui.input(placeholder="G00 Z2").props(
            'outlined dense clearable autocomplete=off data-testid="mdi"').style(
                "width:100%;margin:8px 0").on("keydown.enter", self._send)
        self.page.locked(self.line)
        self.page.locked(ui.button("Send", color=None, on_click=self._send).props(
            "no-caps").classes("plain"))
        self.told = html().classes("record").style("margin-top:10px")

    def _send(self) -> None:
        if self.page.order("line", self.line.value or ""):
            self.line.set_value("")

    # ---- settings

    def _settings(self) -> None:
        ui.label("Kept when the controller is switched off. Enter sends a value.").classes("soft")
        with ui.expansion("Tune the position loops").props(
                'dense dense-toggle data-testid="tune-card"').style("width:100%"):
            self.tune = TuneCard(self.page)
        for group, heading in GROUPS.items():
            fold = ui.expansion(heading).props("dense dense-toggle").style("width:100%")
            fold.on_value_change(lambda _, group=group, fold=fold: self._unfold(group, fold))

    def _unfold(self, group: str, fold: ui.expansion) -> None:
        """Put the fields of a group onto the page, once: all at once keep a browser for seconds."""
        if list(fold):
            return
        with fold:
            for setting in SETTINGS:
                if setting.group == group:
                    self._setting(setting)
        with self.session.lock:
            self._show_settings()

    def _setting(self, setting: Setting) -> None:
        with ui.element("div").classes("setting"):
            with ui.element("div"):
                ui.label(f"${setting.number} {setting.title}")
                ui.label(f"{setting.lowest} to {setting.highest} {setting.unit}".strip()).classes(
                    "soft")
            field = ui.input().props(f'dense outlined inputmode=numeric suffix="{setting.unit}"')
            field.on("keydown.enter", lambda: self._enter(setting))
        self._values[setting.number] = self.page.locked(field)

    def _enter(self, setting: Setting) -> None:
        field = self._values[setting.number]
        text = str(field.value or "").strip()
        line = f"${setting.number}={text}"
        if not (text.isdecimal() and setting.lowest <= int(text) <= setting.highest):
            ui.notify(f"${setting.number} must be a whole number, {setting.lowest} to "
                      f"{setting.highest}.", type="warning", position="top")
        elif self.page.order("line", line):
            self._given[setting.number] = line
            return
        field.set_value(self.session.heard.settings.get(setting.number, ""))

    def _show_settings(self) -> None:
        settings = self.session.heard.settings
        for number, field in self._values.items():
            told = settings.get(number, "")     # empty: not known
            line = self._given.get(number)
            answered = line is not None and not self.session.pending(line)
            if self.page.changed(f"${number}", told) or answered:
                field.set_value(told)
            if answered:
                del self._given[number]

    # ---- record

    def _record(self) -> None:
        ui.button("Save as events.jsonl", color=None, on_click=self._save).props(
            "no-caps dense").classes("plain").style("padding:2px 10px")
        self.record = html().props('data-testid="record"')

    def _save(self) -> None:
        with self.session.lock:
            rows = [event for event, _ in self.session.heard.record]
        ui.download.content("".join(json.dumps(row) + "\n" for row in rows), "events.jsonl")

    def _show_record(self) -> None:
        record, notices = self.session.heard.record, self.session.notices
        last = record[-1][0] if record else None
        if self.page.changed("record", (len(record), last)):
            rows = [f"<tr><td>{event['t']:.2f} s</td><td>{escape(text)}</td></tr>"
                    for event, text in list(record)[:-RECENT - 1:-1]]
            self.record.set_content(
                f'<table class="record">{"".join(rows)}</table>' if rows else
                '<p class="soft">Nothing has happened yet.</p>')
        if self.page.changed("notices", notices[-1] if notices else None):
            self.told.set_content("".join(f"<div>{escape(text)}</div>"
                                          for _, text in list(notices)[:-13:-1]))

    # ---- the gap oscilloscope

    def _scope(self) -> None:
        self.scope = ScopeTab(self.page)

    @property
    def scope_shown(self) -> bool:
        """The tab of the oscilloscope is open."""
        return bool(self.tabs.value == "Gap")

    def show(self) -> None:
        """Show what has changed."""
        self.scope.show()
        self._show_tape()
        self._show_switches()
        self._show_settings()
        self._show_record()
        self.touch.show()
        self.tune.show()
        self.arm.set_visibility(self.session.simulated)
