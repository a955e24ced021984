# SPDX-License-Identifier: Apache-2.0
"""``python -m testbench.faults``: the campaign, and every stop in clocks.

Exit status: 0 if every class was run and all outcomes are expected ones; else 1, 2 for usage.
"""

import argparse
import sys
from pathlib import Path

from testbench.faults import flips, page
from testbench.faults.campaign import chosen, run, write
from testbench.faults.outcome import Outcome
from testbench.faults.stops import measure
from testbench.native.branch import BranchError

DEFAULT = Path("build") / "faults"


def _line(one):
    counts = ", ".join(f"{one.outcomes[outcome]} {outcome.value}" for outcome in Outcome
                       if one.outcomes[outcome])
    counts = counts or ("did not run" if one.results else "not injected here")
    print(f"{one.fault.number:>4} {one.fault.name:40} {counts}"
          f"{'' if one.good else '   <- NOT AS IT MUST BE'} ({one.seconds:.0f} s)", flush=True)
    for result in one.results:
        if not result.good:
            print(f"       {result.case.name}: {result.failure.strip().splitlines()[-1:] or ''}"
                  f"{'; '.join(found.why for found in result.found)}", flush=True)


def _stops(count, seed):
    """Figures of every stop; None if one could not be measured."""
    figures = []
    try:
        for figure in measure(count, seed):
            figures.append(figure)
            print(f"stop {figure.stop.name:24} worst of {count}: {figure.worst:>7} clocks"
                  f"{'' if figure.good else '   <- ABOVE ITS BOUND'}", flush=True)
    except BranchError as error:
        print(f"stop: {error}", flush=True)
        return None
    return figures


def _flips(count, seed):
    """Outcomes of changed bits; None if they could not be tried."""
    try:
        found = flips.measure(count, seed)
    except BranchError as error:
        print(f"flips: {error}", flush=True)
        return None
    for part, counts in found.parts.items():
        print(f"flips in the {part}: " + ", ".join(
            f"{counts[outcome]} {outcome.value}" for outcome in Outcome), flush=True)
    for why in found.wrong:
        print(f"       {why}", flush=True)
    return found


def main() -> int:
    """Run the campaign; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m testbench.faults", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", action="append", default=[], metavar="CLASS",
                        help="number or part of a class' name, `stops` or `flips`; may be repeated")
    parser.add_argument("--phases", type=int, default=20, help="of every stop (default 20)")
    parser.add_argument("--flips", type=int, default=100, metavar="N",
                        help="bits of registers that turn over (default 100)")
    parser.add_argument("--out", type=Path, default=DEFAULT, metavar="DIR")
    options = parser.parse_args()
    names = [name for name in options.only if name not in ("stops", "flips")]
    try:
        classes = chosen(names) if names or not options.only else []
    except ValueError as error:
        parser.error(f"{error}.")
    done = run(classes, options.seed, _line)
    figures = _stops(options.phases, options.seed) if (
        not options.only or "stops" in options.only) else []
    wanted = not options.only or "flips" in options.only
    turned = _flips(options.flips, options.seed) if wanted else flips.Flips(())
    write(done, options.seed, options.out, figures or (), turned)
    path = options.out / "report.html"
    path.write_text(page.render(done, figures, options.seed, turned), encoding="utf-8")
    good = page.is_good(done, figures, turned)
    print(f"{'every outcome is as it must be' if good else 'NOT every outcome is as it must be'}: "
          f"{path}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
