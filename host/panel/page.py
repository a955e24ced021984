# SPDX-License-Identifier: Apache-2.0
"""The page of the panel: what it shows of a session, and its buttons.

Every browser window has a ``Page`` of its own, which looks at the session five times a second. What
a page may not do is refused by the session; the page greys it as well.
"""

from pathlib import Path
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from host import alarms
from host.panel import draw
from host.panel.heard import FEED_MODES, MOTION, condition_words
from host.panel.outline import Outline
from host.panel.session import Session
from host.panel.tabs import Tabs, field_text, html
from host.panel.trace import trace
from host.panel.walk_bar import WalkBar
from host.panel.walking import Walking

__all__ = ["Page", "build"]

SHOW_S = 0.2
FRESH = 3           # beats that a jog's message may be behind: older ones have been delayed
HERE = Path(__file__).parent
NO_STOP = "no emergency stop: that is the button at the machine"
KEYS = (("hold", "Hold", "the feed; resume goes on"),
        ("resume", "Resume", "go on after a hold or M00"),
        ("retract", "Retract", "back along the path now"),
        ("stop", "Stop", NO_STOP))


def build(session: Session, tapes: list[Path]) -> None:
    """Serve the page of a session at ``/``; ``tapes`` may be chosen without an upload."""
    style = (HERE / "panel.css").read_text(encoding="utf-8")
    script = (HERE / "panel.js").read_text(encoding="utf-8")

    @ui.page("/", title=f"Gapkeeper: {session.machine.name}", dark=None)
    def index() -> None:
        ui.add_css(style)
        ui.add_body_html(f"<script>{script}</script>")
        Page(session, tapes)


class Page:
    """One browser window."""

    def __init__(self, session: Session, tapes: list[Path]) -> None:
        self.session = session
        self.client = ui.context.client
        self.name = self.client.id
        self.beat = 0
        self._was: dict[str, Any] = {}
        self._locked: list[Any] = []        # what needs the controls
        self.dark = ui.dark_mode(True)
        with ui.element("div").classes("panel"):
            with ui.element("div").classes("head"):
                self._head()
            with ui.element("div").classes("alarm"):
                self.alarm_area = ui.element("div")
                self.walk = WalkBar(self)
            with ui.element("div").classes("left"):
                self._left()
            with ui.element("div").classes("middle"):
                self._middle()
            with ui.element("div").classes("right"), ui.element("div").classes("card grow"):
                self.tabs = Tabs(self, tapes)
            with ui.element("div").classes("keys"):
                for order, title, under in KEYS:
                    self._key(order, title, under)
        self.beat_label = ui.label("0").props('id="beat"').style("display:none")
        ui.on("panel_here", lambda _: session.seen(self.name))
        ui.on("panel_jog", self._jog)
        ui.on("panel_jog_end", lambda _: self.order("jog_end", quiet=True))
        self.client.on_disconnect(lambda: session.gone(self.name))
        session.seen(self.name)
        self.show()
        ui.timer(SHOW_S, self.show)

    # ---- parts

    def _head(self) -> None:
        self.title = ui.label().classes("name")
        self.state = ui.label().classes("state").props('data-testid="state"')
        self.meaning = ui.label().classes("meaning")
        ui.element("div").classes("spread")
        self.pages = ui.label().classes("soft")
        self.take = ui.button("Take the controls", color=None, on_click=self._take).props(
            "no-caps").classes("plain")
        ui.button(icon="contrast", on_click=self.dark.toggle).props(
            'flat dense round aria-label="dark or bright" data-testid="theme"')

    def _left(self) -> None:
        with ui.element("div").classes("card"):
            self.digits = html().classes("digits").props('data-testid="place"')
        with ui.element("div").classes("card grow"):
            self.facts = html().classes("facts")
            self.chips = html().classes("chips").style("margin-top:10px")
        with ui.element("div").classes("card notice"):
            self.notice = ui.label().props('data-testid="notice"')

    def _middle(self) -> None:
        wire = self.session.machine.kind == "wire"
        with ui.element("div").classes("card pictures"):
            self.plan = html().classes("picture").style("flex:2 1 0")
            self.depth = None if wire else html().classes("picture").style("flex:1 1 0")
        with ui.element("div").classes("card strips"):
            self.strip = html().classes("picture strip")
            self.trace = html().classes("picture strip trace").props('data-testid="trace"')
            html('<span><i class="open"></i>open</span><span><i class="good"></i>good</span>'
                 '<span><i class="arc"></i>arc</span><span><i class="short"></i>short</span>'
                 '<span><i class="back"></i>retraction</span>').classes("legend")

    def _key(self, order: str, title: str, under: str) -> None:
        with ui.button(color=None, on_click=lambda: self.order(order)).props(
                f'no-caps data-testid="{order}"').classes(f"key-button key-{order}") as button:
            html(f'{title}<span class="under">{under}</span>')
        self.locked(button)

    def locked(self, element: Any) -> Any:
        """Grey an element on a page that watches; return it."""
        element.set_enabled(self._was.get("mine", False))
        self._locked.append(element)
        return element

    # ---- orders

    def order(self, name: str, *words: Any, quiet: bool = False) -> bool:
        """Order something; tell here why it cannot be. Return whether it was taken."""
        why = self.session.order(self.name, name, *words)
        if why and not quiet:
            with self.client:
                ui.notify(why, type="warning", position="top")
        return not why

    def _jog(self, event: GenericEventArguments) -> None:
        told = event.args if isinstance(event.args, dict) else {}
        axis, way, beat = told.get("axis"), told.get("way"), told.get("beat")
        if (axis in ("X", "Y", "Z") and way in (1, -1) and isinstance(beat, int)
                and beat >= self.beat - FRESH):
            self.order("jog", axis, way, self.tabs.jog_feed(), quiet=True)

    def _take(self) -> None:
        if self.session.sharing.holder == self.name:
            self.session.let_go(self.name)
        elif not self.session.take(self.name):
            ui.notify("Another page holds the controls: it must let go of them first.",
                      type="warning", position="top")
        self.show()

    # ---- the picture

    def changed(self, key: str, value: Any) -> bool:
        """Whether a value differs from that of the last look; keep it."""
        if key in self._was and self._was[key] == value:
            return False
        self._was[key] = value
        return True

    def show(self) -> None:
        """Show the session as it is now."""
        self.beat += 1
        self.beat_label.set_text(str(self.beat))
        with self.session.lock:
            self._show_sharing()
            self._show_state()
            self._show_alarm()
            self.walk.show(self.session.sharing.holder == self.name)
            self._show_facts()
            self._show_trace()
            self._show_pictures()
            self.tabs.show()

    def _show_sharing(self) -> None:
        holder, pages = self.session.sharing.holder, self.session.sharing.pages
        mine = holder == self.name
        self.pages.set_text(
            f"{pages} page{'s' * (pages != 1)}; "
            + ("this one holds the controls" if mine else
               "another one holds the controls" if holder else "nobody holds the controls"))
        self.take.set_text("Let go of the controls" if mine else "Take the controls")
        self.take.set_enabled(mine or holder is None)
        if self.changed("mine", mine):
            for element in self._locked:
                element.set_enabled(mine)

    def _show_state(self) -> None:
        session, heard = self.session, self.session.heard
        name = session.machine.name
        self.title.set_text(f"{name}, simulated" if session.simulated else name)
        connected = session.link == "connected"
        state = heard.state if connected else session.link.capitalize()
        self.state.set_text(state or "…")
        colour = heard.fields.get("state", "") if connected else (
            "Alarm" if session.link == "lost" else "")
        if self.changed("colour", colour):
            self.state.classes(replace=f"state state-{colour}")
        self.meaning.set_text(
            heard.meaning if connected else "switching the machine on" if session.link == "starting"
            else "no connection to the controller; what stands below is old")
        self.notice.set_text(session.notice or "Nothing to tell.")

    def _show_alarm(self) -> None:
        alarm = self.session.heard.alarm
        locked = self.session.heard.fields.get("state") == "Alarm"
        lost = self.session.link == "lost"
        if not self.changed("alarm", (alarm, locked, lost)):
            return
        self.alarm_area.clear()
        self._locked = [one for one in self._locked if not one.is_deleted]
        if not (alarm or locked or lost):
            return
        with self.alarm_area, ui.element("div").classes("card alarm-card"):
            with ui.element("div").classes("spread"):
                if lost:
                    ui.label("No connection to the controller").classes("alarm-title")
                    ui.label(self.session.notice)
                elif alarm:
                    code, text = alarm
                    ui.label(f"Alarm {code}: {text}").classes("alarm-title").props(
                        'data-testid="alarm"')
                    ui.label(alarms.cause(code)).classes("soft")
                    ui.label(f"What to do: {alarms.remedy(code)}")
                else:
                    ui.label("The machine is locked, or its position is not known.").classes(
                        "alarm-title")
                    ui.label("Unlock it; then reference it, or declare that the counted position "
                             "is the true one.")
            for title, order, *words in (
                    [("Connect again", "connect")] if lost else
                    [("Unlock ($X)", "line", "$X"),
                     ("The position is true", "line", "$POSITION=HERE")]):
                button = ui.button(title, color=None, on_click=lambda order=order, words=words:
                                   self.order(order, *words)).props("no-caps").classes("plain")
                self.locked(button)

    def _show_facts(self) -> None:
        session, heard = self.session, self.session.heard
        machine = heard.numbers("MPos")
        self.digits.set_content('<span></span><span class="machine">machine</span>'
                                '<span class="machine">program, mm</span>' + "".join(
            f'<span class="axis">{axis}</span><span class="machine">{field_text(place, 4)}</span>'
            f'<span class="work">{field_text(work, 4)}</span>'
            for axis, work, place in zip("XYZ", heard.place, machine, strict=False)))
        words = heard.modal.split()
        by_gap = "G95" in words
        mode = (f"G95 P{heard.feed_mode}: {FEED_MODES.get(heard.feed_mode, 'by the gap')}"
                if by_gap and heard.feed_mode else "G95: by the gap" if by_gap else
                "G94: constant feed")
        last = heard.samples[-1] if heard.samples else None
        volts = "not told" if last is None or last.volts is None else f"{last.volts:.0f} V"
        turns = heard.retractions
        rows = [("speed", f"{field_text(last.feed, 1)} mm/min" if last else "…"),
                ("feed mode", mode), ("condition", condition_words(heard.condition)),
                ("gap", f"{volts}{', ' + str(last.pulses) + ' pulses' if last else ''}"),
                ("motion", Walking.motion(heard) or (
                    MOTION[heard.motion] if heard.motion < len(MOTION) else "…")),
                ("retractions", f"{sum(turns.values())}: {turns['short']} short, {turns['jump']} "
                                f"jump, {turns['operator']} by order"),
                ("words", " ".join(words) or "…"),
                *([("time", session.pace)] if session.pace else []),
                ("lag", f"{', '.join(f'{number:g}' for number in heard.numbers('Er'))} pulses")]
        off = heard.fields.get("Off")
        if off:
            rows.append(("guards off", off.replace(",", ", ")))
        if told := heard.fields.get("Ss"):
            rows.append(("shorts by", told.replace(",", ", ")))
        self.facts.set_content("".join(
            f'<span class="key">{key}</span><span class="value">{value}</span>'
            for key, value in rows))
        on = heard.fields.get("A", "")
        self.chips.set_content("".join(
            f'<span class="chip {"on" * lit}">{text}</span>' for text, lit in (
                ("armed" if "Armed" in heard.fields else "not armed", "Armed" in heard.fields),
                ("discharge on" if "S" in on else "discharge off", "S" in on),
                ("fluid on" if "F" in on else "fluid off", "F" in on))))

    def _show_trace(self) -> None:
        """The oscilloscope's record, in place of the strips while its tab is open."""
        scope, shown, share = self.session.scope, self.tabs.scope_shown, self.tabs.scope.share.value
        if self.changed("trace shown", shown):
            self.strip.set_visibility(not shown)
            self.trace.set_visibility(shown)
        if shown and self.changed("trace", (scope.number, share)):
            self.trace.set_content(
                '<p class="soft">The oscilloscope has no record yet: choose a trigger, then Single '
                "or Run.</p>" if scope.record is None else trace(scope.record, float(share or 1)))

    def _show_pictures(self) -> None:
        session, heard = self.session, self.session.heard
        last = heard.samples[-1] if heard.samples else None
        if not self.changed("sample", (last, heard.line, session.job)) or self.beat % 2 == 0:
            return
        trail = list(heard.trail)
        way = session.job.outline if session.job else Outline()
        self.plan.set_content(draw.plan(way, trail, heard.place, heard.line))
        if self.depth is not None:
            self.depth.set_content(draw.depth(way, trail, heard.place))
        self.strip.set_content(draw.strip(list(heard.samples), session.machine.kind == "wire"))
