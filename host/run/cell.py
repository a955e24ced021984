# SPDX-License-Identifier: Apache-2.0
"""The conductivity cell: the fluid's resistivity from a code of the converter.

The cell has a constant of 1/cm. A resistor is parallel to it, so that a broken wire can be told
from oil. A converter of 12 bits reads it in a voltage divider.
"""

__all__ = ["code", "resistivity"]

FULL_SCALE = 4095
SERIES_OHM = 30e3       # at the converter
PARALLEL_OHM = 1e6      # at the cell
HIGHEST_OHM_CM = 1e8    # from here on the parallel resistor hides the fluid


def code(ohm_cm: float) -> int:
    """Code for a resistivity in ohm cm."""
    ohm = 1 / (1 / ohm_cm + 1 / PARALLEL_OHM)
    return round(FULL_SCALE * ohm / (ohm + SERIES_OHM))


def resistivity(level: int) -> float | None:
    """Resistivity in ohm cm, to 3 digits; None if the code says nothing about the fluid."""
    if not 0 < level < FULL_SCALE:
        return None
    conductance = (FULL_SCALE - level) / level / SERIES_OHM - 1 / PARALLEL_OHM
    return float(f"{1 / conductance:.3g}") if conductance > 1 / HIGHEST_OHM_CM else None
