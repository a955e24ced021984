# SPDX-License-Identifier: Apache-2.0
"""One axis with its drive and its position loop, as a controller that ``host.tune`` may measure."""

import math
import random
import re
from dataclasses import dataclass
from types import SimpleNamespace

from rtl.motion.supervision import TICK_S as MODEL_TICK_S
from rtl.motion.supervision import Supervision
from softcore.tables.settings import NO_OFFSET, PULSES_PER_MM, SETTINGS

__all__ = ["HEARD_S", "MODEL_LAG_S", "NAMES", "SET", "TICK_S", "Machine", "Real"]

TICK_S = 5e-5
MODEL_LAG_S = MODEL_TICK_S * 2**Supervision.LAG     # of the model that the supervision has
SET = {row.name: row.default for row in SETTINGS}
HEARD_S = 0.02
SLOWEST = 8e-4      # mm/s of the gateware's model: 2**-12 pulses a tick
NAMES = {row.number: row.name for row in SETTINGS}


@dataclass
class Real:
    """A drive: speed loop and filter, dead time, Coulomb friction, limit of acceleration."""

    gain: float = 1.0
    offset: float = 0.0
    dead_s: float = 0.0
    friction: float = 0.0       # mm/s that the speed loop falls short of by it
    acceleration: float = 5000.0


class Machine:
    """One axis in its loop, as a link that answers: commands of motion, and status reports.

    The loop is that of ``rtl.motion.axis``, in pulses and steps of the DAC.
    """

    def __init__(self, real, settings, seed=1):
        self.real, self.settings = real, dict(settings)
        self.rng = random.Random(seed)
        self.time_s = 0.0
        self.command_mm = self.place = self.filtered = self.speed = self.model = 0.0
        self.behind = 0.0       # what the feed-forward leaves out, in pulses
        self.goals, self.goal, self.line, self.feed = [], 0.0, 0, 0.0
        self.line_before, self.line_s = 0, 0.0
        self.late = [0.0] * max(1, round(real.dead_s / TICK_S))
        self.on_line, self.pipe = print, SimpleNamespace(time_s=lambda: self.time_s)
        self.furthest, self.pressed = [], b""
        self.run(0.5)

    def run(self, seconds):
        real, read = self.real, self.settings
        by_step = read["loop_gain"] / PULSES_PER_MM     # mm/s
        share = read["feed_forward"] / 100
        offset = read["drive_offset_y"] - NO_OFFSET
        for _ in range(round(seconds / TICK_S)):
            self.time_s += TICK_S
            if self.goals and self.command_mm == self.goal:
                self.line_before, self.line_s = self.line, self.time_s
                self.line, self.goal = self.goals.pop(0)
            left = self.goal - self.command_mm
            rests = left == 0
            way = math.copysign(min(abs(left), self.feed * TICK_S), left)
            self.command_mm += way
            moving = way / TICK_S if abs(left) > self.feed * TICK_S else 0.0
            error = round((self.command_mm - self.place) * PULSES_PER_MM)
            core = error
            if share:   # in pulses, as Er
                core += share * moving / by_step - self.behind
            stands = abs(error) <= read["window"] and abs(core) <= (63 if rests else 15)
            told = (not stands) * core * by_step
            self.model += (told - self.model) * TICK_S / MODEL_LAG_S
            self.behind += (told * PULSES_PER_MM - self.behind * 1e6 / read["model_lag_y_us"]
                            ) * TICK_S
            way = (self.model > SLOWEST) - (self.model < -SLOWEST)
            self.late.append((core + offset + read["drive_friction_y"] * way) * by_step)
            self.filtered += (real.gain * self.late.pop(0) + real.offset
                              - self.filtered) * TICK_S / 1e-3
            most = real.acceleration * TICK_S
            self.speed += max(-most, min(most, (self.filtered - self.speed) * TICK_S / 3e-3))
            # Coulomb friction takes speed, but turns none round.
            held = real.friction * TICK_S / 3e-3
            self.speed -= max(-held, min(held, self.speed))
            self.place += self.speed * TICK_S
            self.furthest.append(self.place)

    def status(self):
        self.run(self.rng.uniform(0.002, 0.008))
        error = self.command_mm - self.place
        rests = (self.command_mm == self.goal and not self.goals
                 and abs(self.speed) < 0.05)
        told = {"state": "Idle" if rests else "Run", "MPos": f"0.0000,{self.place:.4f},0.0000",
                "Er": f"0,{round(error * 10_000)},0"}
        self.run(self.rng.uniform(0, 0.001))
        # The firmware may hear late of a block that has begun.
        heard = self.time_s - self.line_s >= self.rng.choice((0.0, HEARD_S))
        return told | {"Ln": str(self.line if heard else self.line_before)}

    def press(self, button):
        self.pressed = button

    def poll(self, timeout_s):
        self.run(max(timeout_s, TICK_S))

    def send_line(self, line):
        if line == "$$":
            for row in SETTINGS:
                self.on_line(f"${row.number}={self.settings[row.name]}")
        else:
            self.command(line)
        return SimpleNamespace(text=line, answer="ok")

    def command(self, line):
        if entered := re.fullmatch(r"\$(\d+)=(\d+)", line):
            self.settings[NAMES[int(entered[1])]] = int(entered[2])
            return
        number, mode, axis, value, feed = re.fullmatch(
            r"(?:N(\d+) G53 )?G21 (G9[01]) G94 G01 ([XYZ])(-?[\d.]+) F([\d.]+)", line).groups()
        assert axis == "Y"
        assert (mode == "G90") == (number is not None)
        end = self.goals[-1][1] if self.goals else self.goal
        self.goals.append((int(number or 0), float(value) + (end if mode == "G91" else 0)))
        self.feed = float(feed) / 60
