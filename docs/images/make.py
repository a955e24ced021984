# SPDX-License-Identifier: Apache-2.0
"""Draws ``architecture.svg``: ``python docs/images/make.py``."""

from pathlib import Path
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 1000, 560
INK, SOFT, LINE = "#1f2933", "#52606d", "#9aa5b1"
ROOMS = {"host": "#fff4e0", "firmware": "#e6f2ff", "gateware": "#e8f6ec", "machine": "#f4ecf7"}

# Room, left, top, width, height, title.
AREAS = (
    ("host", 20, 20, 190, 520, "PC"),
    ("firmware", 230, 20, 190, 520, "soft core: firmware"),
    ("gateware", 440, 20, 340, 520, "gateware"),
    ("machine", 800, 20, 180, 520, "machine"),
)
# Name, left, top, width, height, lines.
BOXES = {
    "tape": (40, 70, 150, 54, ("tape", "ISO 840, EIA RS-244")),
    "report": (40, 440, 150, 54, ("events, report", "")),
    "reader": (250, 70, 150, 54, ("reader, interpreter", "101, 102a, 102c")),
    "memory": (250, 170, 150, 54, ("retraction memory", "102b")),
    "history": (250, 270, 150, 54, ("path, look-ahead,", "history")),
    "events": (250, 440, 150, 54, ("main loop: events,", "alarms, link")),
    "feed": (460, 70, 140, 54, ("path pulses Ps", "103")),
    "ramp": (620, 70, 140, 54, ("ramp: Pp", "104")),
    "retraction": (460, 170, 140, 54, ("retraction", "starts by itself")),
    "distributor": (620, 170, 140, 54, ("distributor: Pi", "line, arc")),
    "error": (620, 270, 140, 54, ("error counter Er", "107")),
    "gap": (460, 270, 140, 54, ("gap: classes, Ss,", "servo, Es/Ex")),
    "power": (460, 355, 140, 54, ("discharge pulses,", "conditions")),
    "interlock": (460, 440, 300, 54, ("interlock: every output off",
                                      "watchdog, arming, supervision")),
    "dac": (620, 355, 140, 54, ("DAC or step/dir", "108")),
    "drive": (815, 355, 150, 54, ("drive, motor", "109, 105")),
    "coder": (815, 270, 150, 54, ("pulse coder FP", "106")),
    "spark": (815, 170, 150, 54, ("spark gap", "electrode, work")),
    "switches": (815, 440, 150, 54, ("stop, limits, fluid,", "contactor, arm")),
}
# Points of each arrow.
ARROWS = (
    ((190, 97), (250, 97)),                      # tape to reader
    ((325, 124), (325, 170)),                    # reader to memory
    ((400, 197), (460, 197)),                    # memory to retraction
    ((400, 97), (460, 97)),                      # reader to feed
    ((250, 112), (238, 112), (238, 297), (250, 297)),  # reader to history
    ((400, 297), (430, 297), (430, 110), (460, 110)),
    ((600, 97), (620, 97)),
    ((690, 124), (690, 170)),
    ((530, 170), (530, 124)),
    ((690, 224), (690, 270)),
    ((690, 324), (690, 355)),
    ((760, 382), (815, 382)),
    ((890, 355), (890, 324)),
    ((815, 297), (760, 297)),
    ((815, 205), (785, 205), (785, 255), (530, 255), (530, 270)),
    ((510, 270), (510, 224)),
    ((600, 375), (608, 375), (608, 245), (790, 245), (790, 190), (815, 190)),
    ((460, 467), (400, 467)),
    ((250, 467), (190, 467)),
    ((815, 467), (760, 467)),
)


def _text(x, y, words, size, colour, weight="400"):
    return (f'<text x="{x}" y="{y}" font-size="{size}" fill="{colour}" font-weight="{weight}" '
            f'text-anchor="middle">{escape(words)}</text>')


def draw() -> str:
    """The drawing, as SVG."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'font-family="system-ui, DejaVu Sans, sans-serif" role="img" '
        'aria-label="Block diagram: tape, firmware, gateware, machine">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
        f'markerHeight="7" orient="auto"><path d="M0 0 8 4 0 8z" fill="{SOFT}"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>']
    for room, left, top, width, height, title in AREAS:
        parts.append(f'<rect x="{left}" y="{top}" width="{width}" height="{height}" rx="12" '
                     f'fill="{ROOMS[room]}"/>')
        parts.append(_text(left + width / 2, top + 28, title, 15, SOFT, "600"))
    for points in ARROWS:
        way = " ".join(f"{x},{y}" for x, y in points)
        parts.append(f'<polyline points="{way}" fill="none" stroke="{SOFT}" stroke-width="1.6" '
                     'marker-end="url(#tip)"/>')
    for left, top, width, height, (first, second) in BOXES.values():
        parts.append(f'<rect x="{left}" y="{top}" width="{width}" height="{height}" rx="8" '
                     f'fill="#fff" stroke="{LINE}"/>')
        middle = left + width / 2
        number = second.replace(",", "").replace(" ", "").isdigit()
        parts.append(_text(middle, top + (24 if second else 32), first, 13, INK, "600"))
        if second:
            parts.append(_text(middle, top + 42, second, 12 if number else 12.5,
                               SOFT if number else INK))
    return "\n".join([*parts, "</svg>"]) + "\n"


if __name__ == "__main__":
    Path(__file__).with_name("architecture.svg").write_text(draw(), encoding="utf-8")
