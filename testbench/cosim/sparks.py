# SPDX-License-Identifier: Apache-2.0
"""Burning time of every spark, by the simulated gap's own state; run it for a table of figures.

``python -m testbench.cosim.sparks`` compares on-times from the gate and from the ignition.
"""

import argparse
from dataclasses import dataclass
from itertools import product
from statistics import fmean, pstdev

from rich import box
from rich.console import Console
from rich.table import Table

from host.experiments.common import in_parallel, markdown, summed_up, value_with_spread
from host.machines import machine as machines
from host.run.run import Run
from host.run.simulation import Simulation as Piped
from host.run.workpiece import Columns
from host.tape.tape import encode
from testbench.native.simulation import Simulation
from testbench.punch import TAPES

__all__ = ["PLACES", "UNSEEN", "Cut", "Spark", "cut", "figures_of", "with_words"]

OPEN, BURNING, ARCING, SHORTED = range(1, 5)   # ``plant::Gap::State``
UNSEEN = 5      # clocks from an ignition to the generator: pads, and the simulated machine's own
COUNTS = "gap_open_count", "gap_ok_count", "gap_dame_count", "gap_short_count"
WATCHED = ("gap_on", "gap_state", "gap_status_shorted", *COUNTS)
# Machine, tape, and the row that takes the place of its condition, but for the word A.
PLACES = {
    "wire": ("wire", "wire_slot", "C500", "G10 C900 I8 P5 Q40 R40 K-1"),
    "punch": ("wire", "wire_punch", "C500", "G10 C900 I8 P5 Q40 R40 K-1"),
    "sinker": ("small", "sink_servo", "C100", "G10 C900 I1 P15 Q25 R25"),
}

WORDS = {"wire": ("A0", "A1", "A1 B20"), "punch": ("A0", "A1", "A1 B20"),
         "sinker": ("A0", "A1", "A1 B30")}
# Of the table: titles and digits.
FIGURES = {
    "sparks": ("sparks", 0), "burnt_us": ("burning time, µs", 2), "spread": ("its deviation, %", 1),
    "whole": ("sparks in full", 0), "whole_us": ("their burning time, µs", 2),
    "whole_spread": ("its deviation, %", 2), "waits": ("cut by the end of the wait", 0),
    "removed_mm3": ("removed, mm³", 3), "shorts": ("Ss", 1), "arcs": ("arcs and shorted pulses", 0),
}


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
    """Result of a run: sparks, classes (open, ok, dame, short), and what was removed.

    ``shorts`` is how often Ss rose. ``trace`` and ``workpiece`` are as the simulation gives them,
    and ``counted`` and ``spark_uj`` are the plant's own number and energy of sparks.
    """

    outcome: str
    sparks: list[Spark]
    pulses: int
    classes: tuple[int, ...]
    clock_hz: int
    removed_mm3: float
    shorts: int
    trace: Columns
    workpiece: Columns
    counted: int
    spark_uj: float

    def times_us(self, *ends):
        """Burning times of the sparks that ended so."""
        return [spark.clocks * 1e6 / self.clock_hz for spark in self.sparks if spark.ended in ends]

    def spread(self, *ends):
        """Mean burning time in us, and its deviation as a share of it."""
        times = self.times_us(*ends)
        return fmean(times), pstdev(times) / fmean(times)


def cut(place: str, words: str, *, seconds: float | None, seed: int = 1) -> Cut:
    """Run a tape with a condition that has other words, such as ``A1``; None: to its end."""
    name, tape, condition, row = PLACES[place]
    row = with_words(row, words)
    machine = machines.load(name)
    text = (TAPES / f"{tape}.nc").read_text(encoding="utf-8")
    assert f" {condition}\n" in text
    text = text.replace(f" {condition}\n", f" {row}\nC900\n")
    with Simulation(machine=machine.tables, clock_hz=machine.clock_hz, seed=seed) as session:
        session.watch(WATCHED)
        done = Run(machine, encode(text), Piped(session), until_s=seconds)
        done.execute()
        changes, trace, clock_hz = session.changes(), session.trace(), session.clock_hz
        workpiece = session.workpiece()
        own = int(session.get("read.sparks")), session.get("read.spark_uj")
    found, pulses = _sparks(changes, _wait(row, clock_hz))
    counts = dict.fromkeys(COUNTS, 0)
    counts.update({name: value for _, name, value in changes if name in counts})
    shorts = sum(name == "gap_status_shorted" and value for _, name, value in changes)
    return Cut(done.outcome, found, pulses, tuple(counts.values()), clock_hz,
               float(trace["removed_mm3"][-1]), shorts, trace, workpiece, *own)


def with_words(row: str, words: str) -> str:
    """Row of a condition with other words, each in the place of that of its letter."""
    order, *own = row.split()
    return " ".join([order, *{word[0]: word for word in [*own, *words.split()]}.values()])


def _wait(row, clock_hz):
    """Clocks of the longest wait, or 0."""
    letters = {word[0]: word[1:] for word in row.split()[1:]}
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
    """Sparks, and number of main pulses."""
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
    return sparks, len(pulses)


def figures_of(trial: tuple[str, str, int, float]) -> dict:
    """Figures of a run, by the names of ``FIGURES``; of place, words, seed and seconds."""
    place, words, seed, seconds = trial
    done = cut(place, words, seconds=seconds, seed=seed)
    assert done.outcome == "stopped", done.outcome
    all_us, whole_us = done.times_us("time", "guard", "wait"), done.times_us("time")
    return {
        "place": place, "words": words, "seed": seed, "outcome": "whole",
        "sparks": len(all_us), "burnt_us": fmean(all_us),
        "spread": 100 * pstdev(all_us) / fmean(all_us),
        "whole": len(whole_us), "whole_us": fmean(whole_us),
        "whole_spread": 100 * pstdev(whole_us) / fmean(whole_us),
        "waits": len(done.times_us("wait")), "removed_mm3": done.removed_mm3,
        "shorts": done.shorts, "arcs": done.classes[2] + done.classes[3]}


def main():
    """Print the table, as Markdown."""
    parser = argparse.ArgumentParser(prog="python -m testbench.cosim.sparks",
                                     description=main.__doc__)
    parser.add_argument("seconds", type=float, nargs="?", default=3.0,
                        help="of the machine, from the start of the tape")
    parser.add_argument("--seeds", type=int, default=1, help="runs of each kind: seeds 1 to N")
    chosen = parser.parse_args()
    trials = [(place, words, seed, chosen.seconds) for place in PLACES
              for words, seed in product(WORDS[place], range(1, chosen.seeds + 1))]
    runs = in_parallel(figures_of, trials, lambda _: None)
    made = Table(box=box.MARKDOWN)
    made.add_column("mean ± deviation of the seeds")
    columns = []
    for place in PLACES:
        for words in WORDS[place]:
            made.add_column(f"{PLACES[place][1]}, {words}", justify="right")
            columns.append(summed_up([one for one in runs if (one["place"], one["words"]) == (
                place, words)], FIGURES))
    for name, (title, digits) in FIGURES.items():
        made.add_row(title, *(value_with_spread(one[name], digits) if one[name] else ""
                              for one in columns))
    Console().print("\n".join(markdown(made)), soft_wrap=True)


if __name__ == "__main__":
    main()
