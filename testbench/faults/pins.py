# SPDX-License-Identifier: Apache-2.0
"""The dangerous pins, and whether they are safe, as seen from outside of the controller."""

from testbench.cosim.record import Record

__all__ = ["PINS", "safe_from"]

# Pin: its level when the outputs are safe. A sigma-delta stream of zero has no pulses.
PINS = {"gap_on": 0, "gap_sense": 0, "dac": 0, "drive_enable": 0, "contactor": 0, "safe": 1}


def safe_from(record: Record, begun: int, end: int) -> int | None:
    """The first clock from ``begun`` on from which every pin stays safe; None if one is not.

    ``record`` must have the pins from before ``begun`` on.
    """
    last = begun
    for pin, level in PINS.items():
        if record.at(pin, end) != level:
            return None
        changes = record.changes(pin, begun)
        if changes:
            last = max(last, changes[-1][0])
    return last
