# SPDX-License-Identifier: Apache-2.0
"""The remaining workpiece of a wire machine, seen from above.

A plan is a dictionary: ``x`` and ``y`` are the middles of its cells in mm, in the workpiece's
coordinates, rising; ``left`` is the share of each cell that is still there, by ``[y, x]``.
"""

from typing import Any

from numpy.typing import NDArray

__all__ = ["Columns", "coarser", "wall_surface"]

Columns = dict[str, NDArray[Any]]     # a plan, a trace: arrays by name


def wall_surface(plan: Columns) -> NDArray[Any]:
    """Y of a wall's surface in mm, for every X of the plan.

    The wall is the machine file's ``wall``: it lies along X, and the workpiece is at greater Y. The
    surface is placed as if the material of its column had no pores, so that differences of Y are
    volumes.
    """
    cell = plan["y"][1] - plan["y"][0]
    surface: NDArray[Any] = plan["y"][-1] + cell / 2 - plan["left"].sum(axis=0) * cell
    return surface


def coarser(plan: Columns, cells: int) -> Columns:
    """Plan with at most ``cells`` cells on a side, each the mean of a square of finer ones."""
    step = -(-max(plan["left"].shape) // cells)
    rows, columns = (size // step * step for size in plan["left"].shape)
    left = plan["left"][:rows, :columns].reshape(rows // step, step, columns // step, step)
    return {"x": plan["x"][:columns].reshape(-1, step).mean(axis=1),
            "y": plan["y"][:rows].reshape(-1, step).mean(axis=1), "left": left.mean(axis=(1, 3))}
