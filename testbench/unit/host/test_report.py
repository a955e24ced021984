# SPDX-License-Identifier: Apache-2.0
"""The report: whole, self-contained, the same for the same run, also for runs that went wrong."""

import re

import numpy as np
import pytest

from host.run import figures, report
from host.run.retractions import collect
from host.run.workpiece import coarser, wall_surface

EVENTS = [
    {"event": "program_start"},
    {"event": "retraction_set", "speed": 300.0, "limit": 0.5, "high": 600.0, "low": 60.0,
     "changeover": 0.1, "ceiling": None, "source": "tape"},
    {"event": "retraction_start", "cause": "short", "speed": 6.0, "latency_cycles": 5},
    {"event": "retraction_end", "reason": "cleared", "distance": 0.3, "speed": 299.9,
     "overshoot": 0.0012},
    {"event": "readvance", "phase": "high", "from": 0.3, "to": 0.1, "speed": 600.0},
    {"event": "readvance", "phase": "low", "from": 0.1, "to": 0.0, "speed": 60.0},
    {"event": "resume"},
    {"event": "retraction_start", "cause": "operator", "speed": 6.0},
    {"event": "fluid_class", "class": 1, "presets": {"dame": 5, "open": 6, "ok": 18}},
    {"event": "alarm", "code": 115, "text": "Block 9: <B> is unknown."},
]
EVENTS = [{"cycle": 1000 * n, "t": n / 10, "line": 7, "pos": {"x": 0.0, "y": 0.0, "z": -0.1 * n}}
          | event for n, event in enumerate(EVENTS)]
SUMMARY = {
    "outcome": "end", "alarm": None, "time_s": 1.0, "cycles": 2_000_000, "wall_s": 0.5,
    "cycles_per_s": 4_000_000, "discharges": {"open": 1, "ok": 2, "dame": 3, "short": 4},
    "retractions": {"count": 2, "short": 1, "jump": 0, "operator": 1}, "pos": {"z": -1.0},
    "max_depth_mm": 1.0, "pressed_mm": 0.0, "removed_mm3": 4.5, "guards_off": [],
    "short_by": "voltage", "seed": 3,
    "clock_hz": 2_000_000, "removal_scale": 250,
    "versions": {"gapkeeper": "0.1.0"},
}


def trace(samples):
    t = np.arange(samples) / 1000
    columns = {name: np.zeros(samples) for name in (
        "x", "y", "z", "error_x", "error_y", "error_z", "path", "feed", "gap_v", "gap_um", "open",
        "ok", "dame", "short")}
    return {"t": t} | columns | {"z": -t, "ok": np.full(samples, 10.0)}


def page(events=EVENTS, samples=1000, **changes):
    return report.render(title="tape", listing=[(1, "%"), (2, "G01 (A < B)")], machine="sinker",
                         parameters={"pulses_per_mm": 10_000, "gap": {"width_um": 50}},
                         summary=SUMMARY | changes, events=events, trace=trace(samples))


def page_text(**changes):
    """The page without its drawings, which take most of its time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "svg", lambda draw, width, height, *arguments: "<svg/>")
        return page(**changes)


def test_page_needs_nothing_else():
    html = page()
    assert not re.findall(r'(?:src|href)="(?!#)[^"]*"|url\((?!#)|<script|@import', html)
    assert html.count("<svg") == 2


def test_conditions_by_depth_are_drawn():
    assert "Conditions by depth" not in page()
    told = [{"event": "condition", "number": 150, "ip": 12, "by": "program"},
            {"event": "condition", "number": 108, "ip": 5.333, "by": "series", "depth": -0.2}]
    html = page(events=[*EVENTS, *(EVENTS[n] | one for n, one in enumerate(told))])
    assert html.count("<svg") == 3
    for text in ("Conditions by depth", "C108, 5.333 IP", "current (IP)"):
        assert text in html


def test_walls_of_a_cavity_are_drawn():
    assert "Walls of the cavity" not in page()
    html = page(cavity={"widest_um": 51.25, "depth_mm": [0.1, 0.2, 0.25],
                        "opening_um": [51.25, 47.0, 44.5]})
    assert "Walls of the cavity" in html
    assert "widest, 51.2 µm" in html
    assert html.count("<svg") == 3


def wire_page():
    """Page of a wire that has gone along a quarter of a circle."""
    turn = np.linspace(0, np.pi / 2, 1000)
    place = np.arange(-0.2, 1.2, 0.002) + 0.001
    plan = {"x": place, "y": place,
            "left": (np.hypot(*np.meshgrid(place, place)) > 1.1).astype(np.float32)}
    events = [event | {"pos": {"x": 0.25, "y": -0.125, "z": 0.0}} for event in EVENTS]
    columns = trace(1000) | {"x": np.cos(turn), "y": np.sin(turn), "z": np.zeros(1000)}
    return report.render(title="tape", listing=[], machine="wire", plan=plan, events=events,
                         parameters={"pulses_per_mm": 10_000, "wire": {"diameter_mm": 0.2},
                                     "stock": {"steps": [[0.0, 30.0]]}},
                         summary=SUMMARY, trace=columns)


def test_a_wire_is_seen_from_above():
    html = wire_page()
    assert not re.findall(r'(?:src|href)="(?!#)[^"]*"|url\((?!#)|<script|@import', html)
    assert html.count("<svg") == 3
    assert wire_page() == html
    for text in ("Seen from above", "X (mm)", "Y (mm)", "0.2500", "\u22120.1250", "4.5 mm³",
                 "[[0.0, 30.0]]"):
        assert text in html, text
    assert "Seen from above" not in page()


def test_a_plan_is_made_coarser_and_its_wall_found():
    left = np.zeros((7, 5), dtype=np.float32)
    left[3:] = 1
    left[2] = [0, 0.25, 0.5, 0.75, 1]
    plan = {"x": 0.1 + 0.2 * np.arange(5), "y": 1 + 0.2 * np.arange(7), "left": left}
    assert wall_surface(plan) == pytest.approx([1.5, 1.45, 1.4, 1.35, 1.3])
    coarse = coarser(plan, 4)
    assert coarse["x"] == pytest.approx([0.2, 0.6])
    assert coarse["y"] == pytest.approx([1.1, 1.5, 1.9])
    assert coarse["left"] == pytest.approx(np.array([[0, 0], [0.5625, 0.8125], [1, 1]]))


def test_page_tells_how_soon_the_electrode_was_clear():
    figure = {"median": 7.11, "worst": 8.22, "shorts": 2}
    row = {"speed": 300.0, "shorts": 3, "sample_ms": None, "forward_us": None, "back_us": figure,
           "turn_ms": None,
           "clear_20_um_ms": figure | {"drive": 6.33}, "clear_100_um_ms": None}
    html = page_text(clear_of_shorts=[row])
    assert "sample to first backward command (µs)" in html
    assert "contact to completing sample (ms)" in html
    assert "7.11, 8.22 (6.33)</td>" in html
    assert "7.11, 8.22</td>" in html
    assert "first backward command" not in page_text()


def test_page_says_what_a_person_asks_first():
    html = page_text()
    for text in ("</html>", "program end", "Machine <b>sinker</b>", "seed <b>3</b>", "5 clocks",
                 "250 times", "gap.width_um", "class 1, presets.dame 5, presets.open 6",
                 "G01 (A &lt; B)", "Retraction 1, close up"):
        assert text in html, text


RETRACTION = range(2, 7)
FULL = "forward at H, forward at E, then the feed resumed at the start point BS."


@pytest.mark.parametrize(("cause", "numbers", "story"), [
    ("short",    RETRACTION,      f"Back at R, {FULL}"),
    ("operator", RETRACTION,      f"Back at R, {FULL}"),
    ("jump",     RETRACTION,      f"Back at R of the jump, {FULL}"),
    ("short",    [2, 3, 5, 6],    "Back at R, forward at E, then the feed resumed at the start "
                                  "point BS."),
    ("short",    [2, 3, 8],       "Back at R, but the run ended before the feed resumed."),
    ("jump",     [2, 3, 4, 8],    "Back at R of the jump, forward at H, but the run ended before "
                                  "the feed resumed."),
    ("short",    [2, 3, 4, 7, 8], "Back at R, forward at H, but the next one began before the feed "
                                  "resumed."),
])
def test_a_close_up_tells_what_happened(cause, numbers, story):
    start = EVENTS[2] | {"cause": cause}
    events = [*EVENTS[:2], *(start if n == 2 else EVENTS[n] for n in numbers)]
    said = re.search(r"<p>At .* of the tape\. (.*)</p>", page_text(events=events))
    assert said[1] == story


@pytest.mark.parametrize(("cause", "shown"), [("short", "0.5000"), ("operator", "0.5000"),
                                              ("jump", "\u2013")])
def test_a_jump_is_not_under_the_retractable_limit(cause, shown):
    """A jump has its own distance, which events do not give."""
    html = page_text(events=[*EVENTS[:2], EVENTS[2] | {"cause": cause}, *EVENTS[3:7]])
    cells = re.findall(r'<td class="n">(.*?)</td>', html.split("<tbody>")[1])
    assert cells[4:6] == ["0.3000", shown]


@pytest.mark.parametrize(("pulses", "told"), [
    ({"open": 10, "ok": 3, "dame": 1, "short": 6},
     (">4</div>", "75 % good; of 20 pulses 10 were open and 6 short")),
    ({"open": 10, "ok": 0, "dame": 0, "short": 0},
     (">0</div>", "of 10 pulses 10 were open and 0 short")),
    (dict.fromkeys(("open", "ok", "dame", "short"), 0), (">0</div>", "no pulse was given")),
])
def test_discharges_are_the_pulses_that_discharged(pulses, told):
    html = page_text(discharges=pulses)
    tile = re.search(r">discharges</div>(.*?</div>)\s*(.*?</div>)", html, re.S)
    assert all(text in tile[0] for text in told), tile[0]


def rules(html, medium):
    """Rules of the page's style for a medium, by selector."""
    inside = html.split(f"@media {medium}", 1)[1].split("\n  }\n", 1)[0]
    return dict(re.findall(r"([.\w][^{}]*?) \{([^{}]*)\}", inside.split("{", 1)[1]))


def test_the_page_prints_whole_tables_and_reads_on_a_telephone():
    """On paper nothing scrolls; a narrow screen gets one column, and drawings that scroll."""
    html = page()
    on_paper, narrow = rules(html, "print"), rules(html, "(max-width: 760px)")
    assert "max-height: none" in on_paper[".scroll, .figure"]
    assert "overflow: visible" in on_paper[".scroll, .figure"]
    assert "columns: 1" in narrow[".columns"]
    assert "min-width" in narrow[".figure svg"]
    assert 'name="viewport" content="width=device-width, initial-scale=1"' in html
    assert html.count('<div class="figure">') == html.count("<svg")
    for table in re.findall(r".{40}<table", html, re.S):
        assert '<div class="' in table, "a table that is wider than the screen must scroll"


def test_a_run_at_one_height_is_drawn():
    still = trace(100) | {"z": np.zeros(100)}
    assert "<svg" in figures.overview(still, [], [])


def test_a_shifted_frame_does_not_shift_the_drawing():
    """Events are in the program's frame; the plots have one frame only."""
    def drawn(shift):
        events = [event | {"pos": {"x": 0.0, "y": 0.0, "z": event["pos"]["z"] + shift}}
                  for event in EVENTS]
        found = collect(events)
        return (figures.overview(trace(1000), events, found),
                figures.close_up(trace(1000), found[0], 10_000))

    assert drawn(0.0) == drawn(7.0)


def test_same_run_gives_the_same_page():
    assert page(samples=50) == page(samples=50)


@pytest.mark.parametrize(("changes", "words"), [
    ({"outcome": "alarm", "alarm": {"code": 115, "text": "Block 9: <B> is unknown."}},
     "<b>Alarm 115.</b> Block 9: &lt;B&gt; is unknown."),
    ({"outcome": "alarm", "alarm": {"code": 153, "text": "No."}},
     "<b>What to do:</b> Make sure that nobody is in danger, press ARM, and start again.</div>"),
    ({"outcome": "stopped"}, "stopped"),
    ({"outcome": "rejected", "alarm": {"code": 101, "text": "no start"}}, "tape rejected"),
])
def test_every_outcome_has_its_page(changes, words):
    assert words in page_text(**changes)


@pytest.mark.parametrize(("told", "said"), [
    ("voltage", "by the gap voltage of each pulse."),
    ("current", "by the current without an ignition delay."),
    ("mean", "by the mean gap voltage; they end by the voltage of sensing pulses."),
    ("mean,current", "by the mean gap voltage; they end by the current of sensing pulses."),
])
def test_what_tells_a_short_is_said(told, said):
    assert f"Shorts (Ss) {said}" in page_text(short_by=told)


def test_guards_that_are_switched_off_are_told():
    assert "Switched off" not in page_text()
    assert "Switched off by settings: fluid, coder Z." in page_text(guards_off=["fluid", "coder Z"])


def test_a_tape_begun_at_a_block_is_said():
    assert "Begun at block 7: the blocks before it only" in page_text(from_block=7)
    assert "Begun at block" not in page_text(from_block=0)


@pytest.mark.parametrize(("pressed_mm", "said"), [(0.0, False), (0.004, False), (0.1373, True)])
def test_an_electrode_pushed_into_the_work_is_a_collision(pressed_mm, said):
    sentence = ("The electrode was pressed 0.137 mm into the workpiece: on a real machine, a "
                "collision.")
    assert report.collision(SUMMARY | {"pressed_mm": pressed_mm}) == (sentence if said else "")
    assert (sentence in page_text(pressed_mm=pressed_mm)) is said


@pytest.mark.parametrize(("events", "samples"), [(0, 0), (0, 2), (3, 2), (4, 5000), (6, 1), (6, 2)])
def test_a_run_may_end_anywhere(events, samples):
    assert "</html>" in page(events=EVENTS[:events], samples=samples)


def test_no_peak_is_lost_by_thinning(rng):
    t = np.arange(100_000) / 1000
    values = np.zeros(len(t))
    peaks = [rng.randrange(len(t)) for _ in range(20)]
    values[peaks] = 1.0
    few_t, few = figures.envelope(t, values)
    assert len(few) < 4 * figures.COLUMNS
    columns = {int(peak // (len(t) // figures.COLUMNS)) for peak in peaks}
    assert few.sum() >= len(columns)
    assert (np.diff(few_t) >= 0).all()
