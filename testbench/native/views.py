# SPDX-License-Identifier: Apache-2.0
"""Saved views of a waveform file for GTKWave and Surfer: one for each kind of machine."""

import math

from testbench.native.signals import SIGNALS, Signal

__all__ = ["VIEWS", "gtkwave", "item", "surfer"]

OF_PATH = {f"{signal.scope}.{signal.name}": signal for signal in SIGNALS}
GAP = ("gap", {"machine.gap_mv": "curve", "machine.gap_state": "name", "gap.Ss": "bit",
               "gap.pulse": "name", "machine.gap_width_nm": "curve",
               "machine.debris_ppm": "curve"})
POWER = ("discharge", {"safety.safe": "bit", "safety.first": "name", "power.machining": "bit",
                       "power.gap_on": "bit", "power.gap_sense": "bit",
                       "power.gap_level": "number", "power.condition.on_time": "number",
                       "power.condition.off_time": "number"})
COUNTED = ("counters", {"gap.counter_5": "number", "gap.counter_6": "number",
                        "gap.counter_7": "number", "gap.UP": "bit", "gap.DOWN": "bit"})
MEAN = ("mean", {"gap.feed_mode": "name", "gap.mean": "curve", "gap.Ex": "curve",
                 "gap.ratio": "curve", "gap.feed": "curve"})
PATH = ("path", {"motion.state": "name", "motion.Zc": "curve", "motion.Ps": "curve",
                 "motion.Pp": "curve"})


def _axis(letter: str) -> tuple[str, dict[str, str]]:
    inside = {"Pi": "curve", "FP": "curve", "Er": "curve", "dac": "bit", "dac_negative": "bit"}
    return (letter.upper(), {f"motion.{letter}.{name}": style for name, style in inside.items()}
            | {f"machine.speed_{letter}": "curve"})


# Groups of each view: title, and signals with their style.
VIEWS = {
    "sinker": (PATH, _axis("z"), GAP, POWER, COUNTED, MEAN),
    "wire": (PATH, _axis("x"), _axis("y"), GAP, MEAN, POWER),
}
VIEWS["cavity"] = VIEWS["sinker"]
# GTKWave's flags of a trace: 0x20 to the right, 4 decimal, 8 binary, 0x400 signed, 0x8000 drawn as
# steps, 1 << 32 names of an enumeration.
FLAGS = {"curve": 0x8420, "number": 0x24, "bit": 0x28, "name": 0x100000028}
COMMENT, STRETCH = 0x200, 0x20000


def _range(signal: Signal) -> str:
    return f"[{signal.bits - 1}:0]" if signal.bits > 1 else ""


def gtkwave(kind: str, duration: int) -> str:
    """View of a whole run of so many units of time.

    GTKWave's zoom is the negative logarithm of the time in 200 pixels.
    """
    zoom = -math.log2(max(duration, 1) / 6)
    lines = ['[dumpfile] "waves.fst"', "[timestart] 0", "[size] 1600 1000", "[pos] -1 -1",
             f"*{zoom:.6f} 0" + 26 * " -1", "[signals_width] 260", "[sst_expanded] 0"]
    for title, rows in VIEWS[kind]:
        lines += [f"@{COMMENT:x}", f"-{title}"]
        for path, style in rows.items():
            signal = OF_PATH[path]
            signed = style != "curve" or signal.of.signed
            flags = FLAGS[style] if signed else FLAGS[style] & ~0x400 | 4
            lines += [f"@{flags:x}", f"{signal.path}{_range(signal)}"]
            if style == "curve":
                lines += [f"@{STRETCH:x}", "-", "-"]
    return "\n".join(lines) + "\n"


def item(index: int) -> str:
    """Surfer's name of an item: the digits of its number to base 16, written a to p."""
    return "".join(chr(ord("a") + int(digit, 16)) for digit in f"{index:x}")


def surfer(kind: str) -> str:
    """Commands: ``surfer --command-file waves.sucl waves.fst``."""
    lines, items = [], 0
    for title, rows in VIEWS[kind]:
        lines.append(f"divider_add {title}")
        items += 1
        for path, style in rows.items():
            lines.append(f"variable_add {OF_PATH[path].path}")
            if style in ("curve", "number"):
                signed = style == "curve" and OF_PATH[path].of.signed
                lines += [f"item_focus {item(items)}",
                          f"item_set_format {'Signed' if signed else 'Unsigned'}"]
            if style == "curve":
                lines += ["item_set_height 3", "item_set_analog step"]
            items += 1
    return "\n".join([*lines, "item_unfocus", "zoom_fit"]) + "\n"
