# SPDX-License-Identifier: Apache-2.0
"""The condition and the sources at a board's pins, with what hangs on them, as compiled code."""

import ctypes
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace

from amaranth import *
from amaranth.lib import io, wiring
from amaranth.lib.wiring import In, Out

from rtl.gap.reference import References
from rtl.pads import CHAINED, INPUTS, OUTPUTS, Pads
from rtl.power.condition import Condition
from rtl.power.power import Power
from softcore.csr import interfaces
from softcore.regmap import BLOCKS
from testbench.native.build import HERE, PLANT
from testbench.native.component import component_library

__all__ = ["AtPins", "Figures", "switched"]

REFERENCES = "open", "arc", "short"
STAGED = {"level": 6, "on_time": 20, "off_time": 20, "supply_voltage": 4, "supply_negative": 1}


class AtPins(wiring.Component):
    """Condition, sources and references joined as in ``rtl.controller``, behind chained pads.

    The gap is dead between pulses, and nothing but the staged words moves.

    Parameters
    ----------
    clock_hz, latch, settle : int
        See ``rtl.power.power`` and ``rtl.power.settling``.

    Members
    -------
    level, on_time, off_time, supply_voltage, supply_negative : In
    reference_open, reference_arc, reference_short : In(10)
        The staged words.
    commit : In(1)
        Put them in force.
    machining : In(1)
        The discharge is on.
    take, pending : Out(1)
        They come into force in the next clock; they wait for that.
    chain, gap_reference : Out(3), gap_on, gap_sense : Out(1), gap_level : Out(6)
        The pins.
    """

    def __init__(self, *, clock_hz: int, latch: int, settle: int):
        self.clock_hz = clock_hz
        self.latch = latch
        self.settle = settle
        super().__init__({
            **{name: In(width) for name, width in STAGED.items()},
            **{f"reference_{name}": In(10) for name in REFERENCES}, "commit": In(1),
            "machining": In(1),
            "take": Out(1), "pending": Out(1), "chain": Out(3), "gap_reference": Out(3),
            "gap_on": Out(1), "gap_sense": Out(1), "gap_level": Out(6),
        })

    def elaborate(self, platform):
        m = Module()
        outputs = {name: width for name, (width, _) in OUTPUTS.items() if name not in CHAINED}
        ports = SimpleNamespace(
            **{name: io.SimulationPort("i", width, name=f"{name}_port")
               for name, (width, _) in INPUTS.items()},
            **{name: io.SimulationPort("o", width, name=f"{name}_port")
               for name, width in (outputs | {"chain": 3}).items()})
        m.submodules.pads = pads = Pads(ports)
        m.submodules.condition = condition = Condition(registers=interfaces(BLOCKS),
                                                       latch=self.latch, settle=self.settle)
        m.submodules.references = references = References()
        m.submodules.power = power = Power(clock_hz=self.clock_hz, level_max=20, on_max=100_000,
                                           off_min=self.clock_hz * 5 // 10**6)
        words, staged = condition.words, condition.staged
        m.d.comb += [
            condition.between.eq(power.between),
            condition.registers.order_strobe.eq(self.commit),
            condition.registers.order_commit.eq(self.commit),
            *(getattr(staged, f"power_{name}").eq(getattr(self, name)) for name in STAGED),
            *(getattr(staged, f"gap_reference_{name}").eq(getattr(self, f"reference_{name}"))
              for name in REFERENCES),
            self.take.eq(condition.switch.take),
            self.pending.eq(condition.registers.status_pending),
            *(level.eq(getattr(words, f"gap_reference_{name}"))
              for level, name in zip(references.level, REFERENCES, strict=True)),
            power.machining.eq(self.machining),
            power.latched.eq(condition.latched), power.settled.eq(condition.settled),
            *(getattr(power, name).eq(getattr(words, f"power_{name}"))
              for name in ("level", "on_time", "off_time")),
            power.sense_on.eq(self.clock_hz // 100_000), power.short.eq(1),
            power.sense_off.eq(self.clock_hz // 25_000),
            power.reference.eq(words.gap_reference_short),
            pads.gap_on.eq(power.on), pads.gap_sense.eq(power.sense),
            pads.gap_level.eq(power.level_out), pads.gap_reference.eq(references.stream),
            pads.gap_supply.eq(Cat(words.power_supply_voltage, words.power_supply_negative)),
            *(getattr(self, name).eq(getattr(ports, name).o) for name in (
                "chain", "gap_reference", "gap_on", "gap_sense", "gap_level")),
        ]
        return m


@dataclass(frozen=True)
class Figures:
    """Result of many switches.

    Members
    -------
    switches, skipped : int
        Conditions put in force, and those of them that the next one replaced before any pulse.
    pulses, mixed : int
        Pulses of the discharge, and those of them with a part of another condition at the pins.
    sensing, early : int
        Sensing pulses, and those of them at a supply that did not follow its order.
    longest, longest_latch : int
        Clocks from a change to the first pulse of the discharge, at most: if a reference changed,
        and if the supply alone did.
    shortest : int
        The same at least, if neither changed.
    clocks : int
        Clocks of the run.
    """

    switches: int
    skipped: int
    pulses: int
    mixed: int
    sensing: int
    early: int
    longest: int
    longest_latch: int
    shortest: int
    clocks: int


@cache
def _library(clock_hz, latch, settle):
    return component_library(AtPins(clock_hz=clock_hz, latch=latch, settle=settle),
                             HERE / "at_pins.cpp", PLANT / "outside.hpp")


def switched(switches: int, *, seed: int, clock_hz: int, rc_us: float, latch: int,
             settle: int) -> Figures:
    """Switch so many times between random conditions, at random phases, and look at the pins.

    ``rc_us`` is the filters' time constant outside; ``latch`` and ``settle`` are what the gateware
    waits.
    """
    figures = (ctypes.c_uint64 * len(Figures.__dataclass_fields__))()
    _library(clock_hz, latch, settle).at_pins_run(
        ctypes.c_uint64(switches), ctypes.c_uint64(seed), ctypes.c_double(1e6 / clock_hz),
        ctypes.c_double(rc_us), figures)
    return Figures(*figures)
