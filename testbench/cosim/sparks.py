# SPDX-License-Identifier: Apache-2.0
"""Burning time of every spark, by the simulated gap's own state; run it for a table of figures.

``python -m testbench.cosim.sparks`` compares on-times from the gate and from the ignition.
"""

import sys
from dataclasses import dataclass
from statistics import fmean, pstdev

from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.tape.tape import encode
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

__all__ = ["PLACES", "UNSEEN", "Cut", "Spark", "cut", "row_of"]

OPEN, BURNING, ARCING, SHORTED = range(1, 5)   # ``plant::Gap::State``
UNSEEN = 5      # clocks from an ignition to the generator: pads, and the simulated machine's own
COUNTS = "gap_open_count", "gap_ok_count", "gap_dame_count", "gap_short_count"
WATCHED = ("gap_on", "gap_state", "gap_status_shorted", *COUNTS)
# Machine, tape, and the row that takes the place of its condition, but for the word A.
PLACES = {
    "wire": ("wire", "wire_slot", "C500", "G10 C900 I8 P5 Q40 R40 K-1"),
    "sinker": ("small", "sink_servo", "C100", "G10 C900 I1 P15 Q25 R25"),
}

WORDS = {"wire": ("A0", "A1", "A1 B20"), "sinker": ("A0", "A1", "A1 B30")}


@dataclass(frozen=True)
class Spark:
    """A discharge of the main source: clocks that it burnt, and what became of its pulse.

    ``ended`` is ``wait`` if the gate was high for the longest wait, exactly, and the ignition came
    too late in it to be seen; ``guard`` if the gateware classed it as an arc or a short, or saw Ss
    meanwhile, and so may have cut it off; else ``time``. An arc or a short of the plant is none.
    """

    clocks: int
    ended: str


@dataclass(frozen=True)
class Cut:
    """Result of a run: sparks, classes (open, ok, dame, short), and what was removed."""

    sparks: list[Spark]
    pulses: int
    classes: tuple[int, ...]
    arcs: int
    clock_hz: int
    seconds: float
    removed_mm3: float
    retractions: int
    way_mm: float

    def times_us(self, *ends):
        """Burning times of the sparks that ended so."""
        return [spark.clocks * 1e6 / self.clock_hz for spark in self.sparks if spark.ended in ends]

    def spread(self, *ends):
        """Mean burning time in us, and its deviation as a share of it."""
        times = self.times_us(*ends)
        return fmean(times), pstdev(times) / fmean(times)


def cut(place: str, words: str, *, seconds: float, seed: int = 1) -> Cut:
    """Run the beginning of a tape with a condition that has other words, such as ``A1``."""
    name, tape, condition, row = PLACES[place]
    machine = machines.load(name)
    text = (TAPES / f"{tape}.nc").read_text(encoding="utf-8")
    assert f" {condition}\n" in text
    text = text.replace(f" {condition}\n", f" {row} {words}\nC900\n")
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=seed) as session:
        session.watch(WATCHED)
        done = Run(machine, encode(text), Piped(session), until_s=seconds)
        done.execute()
        assert done.alarm is None, done.alarm
        changes, trace, clock_hz = session.changes(), session.trace(), session.clock_hz
    found, pulses, arcs = _sparks(changes, _wait(row, words, clock_hz))
    counts = dict.fromkeys(COUNTS, 0)
    counts.update({name: value for _, name, value in changes if name in counts})
    shorts = sum(name == "gap_status_shorted" and value for _, name, value in changes)
    return Cut(found, pulses, tuple(counts.values()), arcs, clock_hz, trace["t"][-1],
               float(trace["removed_mm3"][-1]), shorts,
               float(trace["path"].max()) / machine.pulses_per_mm)


def _wait(row, words, clock_hz):
    """Clocks of the longest wait, or 0."""
    letters = {word[0]: word[1:] for word in f"{row} {words}".split()[1:]}
    if letters.get("A", "0") == "0":
        return 0
    return round(float(letters.get("B", letters["P"])) * clock_hz / 1e6)


@dataclass
class _Pulse:
    begin: int
    ignition: int | None = None
    end: int | None = None
    length: int = 0
    foul: bool = False      # the plant's arc, or its short
    guarded: bool = False

    def unseen(self, wait):
        """Whether the wait ended before the ignition had come through."""
        return self.length == wait and self.ignition - self.begin >= wait - UNSEEN


def _sparks(changes, wait):
    """Sparks, number of main pulses, and number of the plant's arcs among them."""
    pulses, now, last = [], None, None
    for clock, name, value in changes:
        if name == "gap_on" and value:
            now = last = _Pulse(clock)
            pulses.append(now)
        elif name == "gap_on" and now:
            now.length = clock - now.begin
            now = None
        elif name == "gap_state" and last:
            if value == BURNING:
                last.ignition = clock
            elif last.ignition is not None and last.end is None:
                last.end = clock
            last.foul |= value in (ARCING, SHORTED)
        elif name == "gap_status_shorted" and value and now:
            now.guarded = True
        elif name in ("gap_dame_count", "gap_short_count") and last:
            last.guarded = True
    whole = [pulse for pulse in pulses if pulse.length and pulse.end]
    sparks = [Spark(pulse.end - pulse.ignition,
                    "guard" if pulse.guarded else "wait" if pulse.unseen(wait) else "time")
              for pulse in whole if not pulse.foul]
    return sparks, len(pulses), sum(pulse.foul for pulse in pulses)


def row_of(place: str, words: str, **more) -> str:
    """One line of the table."""
    done = cut(place, words, **more)
    parts = []
    for what, ends in (("all", ("time", "guard", "wait")), ("uncut", ("time",)),
                       ("wait", ("wait",)), ("guard", ("guard",))):
        times = done.times_us(*ends)
        if times:
            mean, share = done.spread(*ends)
            parts.append(f"{what} {len(times)}: {mean:.2f} us +-{100 * share:.1f} %")
    return (f"{place} {words}: {'; '.join(parts)}; pulses {done.pulses}, open/ok/dame/short "
            f"{done.classes}, foul {done.arcs}, {done.removed_mm3:.4f} mm3, {done.way_mm:.4f} mm, "
            f"Ss {done.retractions}, {done.seconds:.2f} s")


if __name__ == "__main__":
    for place in PLACES:
        for words in sys.argv[2:] or WORDS[place]:
            print(row_of(place, words, seconds=float(sys.argv[1]) if sys.argv[1:] else 3.0),
                  flush=True)
