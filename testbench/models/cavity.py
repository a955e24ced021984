# SPDX-License-Identifier: Apache-2.0
"""Model of a die-sunk cavity's side walls, written from the contract in ``plant/cavity.hpp``.

It keeps the walls as a list of slices: each has the depths between which it lies, and its volume.
"""

from dataclasses import dataclass, field
from math import exp, pi, sqrt

__all__ = ["Cavity", "Slice"]


@dataclass
class Slice:
    """A layer of the cavity, from ``top_um`` down to ``bottom_um``, of ``volume_mm3``."""

    top_um: float
    bottom_um: float
    volume_mm3: float


@dataclass
class Cavity:
    """A cavity of an electrode of ``area_mm2``; ``numbers`` is a machine file's ``[cavity]``."""

    area_mm2: float
    numbers: dict[str, float]
    slices: list[Slice] = field(default_factory=list)

    def section_mm2(self, opening_um: float) -> float:
        """Area of the electrode's section, opened on all sides (Steiner's formula)."""
        wide = opening_um / 1000
        return self.area_mm2 + self.numbers["perimeter_mm"] * wide + pi * wide**2

    def opening_um(self, one: Slice) -> float:
        """Opening on each side that gives a slice its volume."""
        section = one.volume_mm3 / ((one.bottom_um - one.top_um) / 1000)
        half = self.numbers["perimeter_mm"] / 2 / pi
        return 1000 * (sqrt(half**2 + max(0.0, section - self.area_mm2) / pi) - half)

    def overcut_um(self, amps: float, microseconds: float) -> float:
        """Overcut of a discharge at the front."""
        of = self.numbers
        return (of["overcut_um"] * (amps / of["reference_a"])**of["current_power"]
                * (microseconds / of["reference_us"])**of["time_power"])

    def take(self, mm3: float, amps: float, microseconds: float, debris: float,
             below_um: float) -> float:
        """Take a volume away by one discharge; return by how much the front went deeper, um."""
        of, overcut = self.numbers, self.overcut_um(amps, microseconds)
        front = self.section_mm2(overcut)
        weights = []
        for one in self.slices:
            beside = max(0.0, min(one.bottom_um, below_um) - one.top_um) / 1000
            nearness = exp(min(8.0, (overcut - self.opening_um(one)) / of["slope_um"]))
            weights.append(of["perimeter_mm"] * beside * of["wall_debris"] * debris * nearness)
        whole = front + sum(weights)
        for one, weight in zip(self.slices, weights, strict=True):
            one.volume_mm3 += mm3 * weight / whole
        return self._deepen(mm3 / whole * 1000, front)

    def _deepen(self, um: float, section_mm2: float) -> float:
        left, layer = um, self.numbers["layer_um"]
        while left > 0:
            if not self.slices or self.slices[-1].bottom_um >= len(self.slices) * layer - 1e-9:
                top = len(self.slices) * layer
                self.slices.append(Slice(top, top, 0.0))
            last = self.slices[-1]
            here = min(left, len(self.slices) * layer - last.bottom_um)
            last.bottom_um += here
            last.volume_mm3 += section_mm2 * here / 1000
            left -= here
        return um
