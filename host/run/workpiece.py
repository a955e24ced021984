# SPDX-License-Identifier: Apache-2.0
"""What a wire machine has left of its workpiece, seen from above.

A plan is a dictionary: ``x`` and ``y``, the middles of its cells in mm in the workpiece's
coordinates, rising; ``left``, the share of each cell that is still there, by ``[y, x]``.
"""

from typing import Any

from numpy.typing import NDArray

__all__ = ["Columns", "coarser", "wall_surface"]

Columns = dict[str, NDArray[Any]]     # a plan; and whatever else is arrays by name


def wall_surface(plan: Columns) -> NDArray[Any]:
    """Y of a wall's surface in mm, for every X of the plan.

    The wall is the machine file's ``wall``: along X, the workpiece beyond it, at greater Y. The
    place is that which the material in a column would have without pores, so that differences of
    it are volumes.
    """
    cell = plan["y"][1] - plan["y"][0]
    surface: NDArray[Any] = plan["y"][-1] + cell / 2 - plan["left"].sum(axis=0) * cell
    return surface


def coarser(plan: Columns, cells: int) -> Columns:
    """Plan with at most so many cells on a side, each the mean of a square of them."""
    step = -(-max(plan["left"].shape) // cells)
    rows, columns = (size // step * step for size in plan["left"].shape)
    left = plan["left"][:rows, :columns].reshape(rows // step, step, columns // step, step)
    return {"x": plan["x"][:columns].reshape(-1, step).mean(axis=1),
            "y": plan["y"][:rows].reshape(-1, step).mean(axis=1), "left": left.mean(axis=(1, 3))}
