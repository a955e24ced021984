# SPDX-License-Identifier: Apache-2.0
"""How constant a feed mode can keep the removal by its signal, and what the signal is made of.

Both are reckoned from runs at constant feed (G94) on the wall with a step in its stock.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from host.experiments.common import Record
from host.run.workpiece import Columns

__all__ = ["BEST_BY_DISTANCE", "PARTS", "best_by_drop", "bounds", "parts", "reached"]

# Parts of the variance of the drop of the mean voltage.
PARTS = ("stock", "shorts", "debris", "number of discharges", "rest")

# Removal behind a step of the stock over that before it, at best, under P5. The feed changes how
# long the discharges of a distance take, not how many it needs, and a crater is in proportion to
# the time of its discharge: so the signal follows the stock alone.
BEST_BY_DISTANCE = 1.0


def best_by_drop(removal: float, drop: float) -> float:
    """Removal behind a step of the stock over that before it, at best, under a feed F Es/Ex.

    ``removal`` and ``drop`` are the same ratio at constant feed, of the removal and of Ex, the drop
    of the mean voltage over time. The feed settles when the removal x is ``removal`` Es/Ex(x), and
    between the two stocks Ex is taken as linear in x: Ex(1) = Es, Ex(``removal``) = ``drop`` Es. A
    signal without noise is assumed. 1 is constant removal, ``removal`` no better than G94.
    """
    if removal == 1:
        return 1.0
    slope = (drop - 1) / (removal - 1)
    if slope == 0:
        return removal
    # slope x^2 + (1 - slope) x = removal
    root = (1 - slope)**2 + 4 * slope * removal
    return (math.sqrt(root) - (1 - slope)) / (2 * slope)


def reached(removal: float, best: float, got: float) -> float:
    """Share of the best improvement over constant feed that was reached; beyond it, less."""
    return 1 - abs(got - best) / abs(removal - best)


def parts(trace: Columns, inside: NDArray[Any], at: NDArray[Any], unit: float,
          no_load_v: float) -> Record:
    """What the drop Ex of the mean voltage is made of, in means over a unit distance.

    ``inside`` chooses the samples of a run with a step; ``at`` is their place from the step on, and
    ``unit`` a distance, both in mm. Result: ``drop_v`` and ``shorts_v``, the mean of Ex and of what
    shorts make of it; ``drop_ratio`` and ``discharge_ratio``, behind the step over before it;
    ``shares`` of the variance of Ex, in percent, by ``PARTS``. The stock's is that of the means
    before and behind. The others are of what is left: a straight-line fit on shorts, debris and
    number of discharges, each part by its covariance with Ex, so that the sum is 100; a part below
    0 offsets another. The number of discharges includes its change by the width of the gap.
    """
    place = at[inside]
    window = np.floor(place / unit).astype(int)
    kinds = {name: trace[name][inside] for name in ("open", "ok", "dame", "short", "debris")}
    pulses = sum(kinds[name] for name in ("open", "ok", "dame", "short"))
    rows = []
    for one in np.unique(window):
        of = window == one
        rows.append((one >= 0, no_load_v - trace["gap_v"][inside][of].mean(),
                     no_load_v * kinds["short"][of].sum() / max(pulses[of].sum(), 1),
                     kinds["debris"][of].mean(),
                     (kinds["ok"] + kinds["dame"])[of].sum() / max(of.sum(), 1)))
    behind, drop, *causes = (np.array(column) for column in zip(*rows, strict=True))
    behind = behind.astype(bool)
    within = np.column_stack([drop, *causes])
    for half in (behind, ~behind):
        within[half] -= within[half].mean(axis=0)
    left, of_cause = within[:, 0], within[:, 1:]
    fit = np.linalg.lstsq(of_cause / np.maximum(of_cause.std(axis=0), 1e-12), left, rcond=None)[0]
    fit = fit / np.maximum(of_cause.std(axis=0), 1e-12)
    explained = [float(fit[n] * (of_cause[:, n] * left).mean()) for n in range(len(causes))]
    shares = [float(drop.var() - left.var()), *explained, float(left.var()) - sum(explained)]
    return {
        "drop_v": float(drop.mean()), "shorts_v": float(causes[0].mean()),
        "drop_ratio": float(drop[behind].mean() / drop[~behind].mean()),
        "discharge_ratio": float(causes[2][behind].mean() / causes[2][~behind].mean()),
        "shares": {name: 100 * share / float(drop.var())
                   for name, share in zip(PARTS, shares, strict=True)},
    }


def bounds(runs: Iterable[Record]) -> list[str]:
    """Sentences: what Ex is made of, and the best of P4 and P5 beside what they reached.

    Of the runs on the wall with a step that ended. Without one in G94 there is none.
    """
    ended = [one for one in runs if one["wall"] == "step" and one["outcome"] == "end"]
    constant = [one for one in ended if one["mode"] == "G94" and "parts" in one]
    if not constant:
        return []

    def mean(of: list[Record], *names: str) -> float:
        values = []
        for one in of:
            value: Any = one
            for name in names:
                value = value[name]
            values.append(value)
        return float(np.mean(values))

    made = ", ".join(f"{name} {mean(constant, 'parts', 'shares', name):.0f} %" for name in PARTS)
    said = [f"Ex at constant feed: {mean(constant, 'parts', 'drop_v'):.2f} V, of it shorts "
            f"{mean(constant, 'parts', 'shorts_v'):.2f} V. Its variance over the unit distance of "
            f"P4: {made}."]
    removal = mean(constant, "behind_step")
    best = {"P4": best_by_drop(removal, mean(constant, "parts", "drop_ratio")),
            "P5": BEST_BY_DISTANCE}
    for mode, bound in best.items():
        mine = [one for one in ended if one["mode"] == mode]
        if mine:
            got = mean(mine, "behind_step")
            said.append(f"{mode}: removal behind the step {got:.2f} times that before, G94 "
                        f"{removal:.2f}; the best by its signal is {bound:.2f}, so "
                        f"{100 * reached(removal, bound, got):.0f} % of it is reached.")
    return said
