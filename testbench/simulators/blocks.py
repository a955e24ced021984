# SPDX-License-Identifier: Apache-2.0
"""Which blocks of the gateware the tests have run, and how: the table at the end of ``make test``.

A block is a ``Component`` of ``rtl`` or ``softcore``. A test reaches it as the design itself or as
a part of one. The table is made from what ran and passed.
"""

import importlib
import pkgutil
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from amaranth.hdl import Fragment
from amaranth.lib import wiring

import rtl
import softcore

__all__ = ["AMARANTH", "COCOTB", "HOW", "PROOF", "Reached", "add", "blocks", "gaps",
           "joined", "note", "parts_of", "table", "taken"]

COCOTB = "cocotb on Verilog"
AMARANTH = "Amaranth"
PROOF = "proof"
HOW = (COCOTB, AMARANTH, PROOF)
Reached = tuple[str, str, bool]   # how, block, whether it is the design itself

# Blocks that only join others have no unit test: the whole controller runs with its firmware. The
# processor is Verilog that others wrote.
JOINING = ("controller.Controller", "motion.axes.Axes", "report.Report", "softcore.cpu.VexRiscv",
           "softcore.sleep.ClockGate", "softcore.soc.Soc")
# An element of the device, which nothing here can simulate.
DEVICE = ("softcore.clock.Pll",)

# Blocks whose tests run a design that they are a part of, and look at what they do there. Every
# other block must be the design of a test itself.
WITHIN = {
    **dict.fromkeys(JOINING, "the whole controller"),
    "gap.feed_mode.FeedCalculator": "its detector of the removal",
    "motion.axis.Overshoot": "motion.axis.Axis",
    "motion.dac.PulseWidth": "motion.dac.Dac", "motion.dac.SigmaDelta": "motion.dac.Dac",
    "motion.figures.Figures": "the joined motion", "motion.motion.Motion": "the joined motion",
    "motion.retraction.Retraction": "the joined motion",
    "power.limiter.Limiter": "power.power.Power",
    "softcore.csr.RegisterFile": "a bench with the owners of its fields",
}

_noted: list[Reached] = []


@dataclass(frozen=True)
class Count:
    """Number of tests that reach a block: as the design itself, and as a part of it."""

    itself: int = 0
    part: int = 0

    def __str__(self):
        return (str(self.itself) if self.itself or not self.part else "") + (
            f" +{self.part}" if self.part else "")


def _name(kind: type) -> str:
    return f"{kind.__module__.removeprefix('rtl.')}.{kind.__qualname__}"


def blocks() -> list[str]:
    """Names of all blocks, from the sources: ``motion.arc.Arc``, ``softcore.uart.Uart``."""
    found = []
    for module in (one for package in (rtl, softcore) for one in pkgutil.walk_packages(
            package.__path__, f"{package.__name__}.")):
        for kind in vars(importlib.import_module(module.name)).values():
            if (isinstance(kind, type) and issubclass(kind, wiring.Component)
                    and kind.__module__ == module.name):
                found.append(_name(kind))
    return sorted(set(found) - set(DEVICE))


def parts_of(fragment: Fragment) -> list[tuple[str, bool]]:
    """Blocks in an elaborated design, and whether each is the design itself."""
    found = {}

    def walk(place, top):
        for origin in place.origins or ():
            if type(origin).__module__.startswith(("rtl.", "softcore.")):
                found[_name(type(origin))] = found.get(_name(type(origin))) or top
        for part, *_ in place.subfragments:
            walk(part, False)

    walk(fragment, True)
    return sorted(found.items())


def note(how: str, fragment: Fragment) -> None:
    """A test of this process runs the blocks of a design."""
    add((how, name, itself) for name, itself in parts_of(fragment))


def add(reached: Iterable[Reached]) -> None:
    """Note what a test has reached in another process."""
    _noted.extend(reached)


def taken() -> list[Reached]:
    """What was noted since the last call."""
    found = sorted(set(_noted))
    _noted.clear()
    return found


def joined() -> None:
    """The whole controller has run under cocotb: note the blocks that only join others.

    Its other parts have unit tests, which would not be missed in the table if they were noted here.
    """
    add((COCOTB, name, False) for name in JOINING)


def _counts(ran: Iterable[Iterable[Reached]]) -> dict[str, dict[str, Count]]:
    itself: dict[str, Counter] = defaultdict(Counter)
    part: dict[str, Counter] = defaultdict(Counter)
    for test in ran:
        for how, name, top in test:
            (itself if top else part)[name][how] += 1
    return {name: {how: Count(itself[name][how], part[name][how]) for how in HOW}
            for name in blocks()}


def gaps(ran: Iterable[Iterable[Reached]]) -> list[str]:
    """Blocks that no test has run under cocotb, given what each passed test reached.

    A block that ran as a part of another design only is one, too, unless it is in ``WITHIN``.
    """
    return [name for name, counts in _counts(ran).items()
            if not counts[COCOTB].itself and not (name in WITHIN and counts[COCOTB].part)]


def table(ran: Iterable[Iterable[Reached]]) -> list[str]:
    """Lines of the table, given what each passed test reached."""
    lines = [f"{'tests of a block itself, +as a part':<42}" + "".join(f"{how:>20}" for how in HOW)]
    for name, counts in _counts(ran).items():
        lines.append(f"{name:<42}" + "".join(
            f"{'-' if counts[how] == Count() else str(counts[how]):>20}" for how in HOW))
    return lines
