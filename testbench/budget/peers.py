# SPDX-License-Identifier: Apache-2.0
"""Blocks of ours beside those of open projects that do nearly the same.

Their figures were measured once with yosys 0.70 and nextpnr 0.11.1 on an ECP5, and are written down
here: this project holds nothing of theirs. "Nearly": each row says what one has and the other not.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from amaranth.back import rtlil
from amaranth.hdl import Elaboratable

from rtl.motion.distributor import LineDistributor
from rtl.motion.feed import PathPulseGenerator
from rtl.motion.gear import Gear
from testbench.budget.resources import Resources, cells, layout

__all__ = ["PEERS", "measure_peers"]


@dataclass(frozen=True)
class Peer:
    """A function, our block for it, and the other project with its figures and what differs."""

    function: str
    ours: Callable[[], Elaboratable]
    theirs: str


PEERS = (
    Peer("a rate becomes pulses", PathPulseGenerator,
         "riocore `stepdir`, one motor: 115 LUT4, 111 CCU2C, 130 MHz; it counts the position, too, "
         "and sends the steps"),
    Peer("pulses become steps, n for m, with their times", Gear,
         "riocore has no gear and no times; see the row above"),
    Peer("a line of three axes", LineDistributor,
         "hexastorm, three motors: 153 LUT4, 117 CCU2C"),
)


def measure_peers(progress: Callable[[str], None] = lambda text: None,
                  ) -> Iterator[tuple[Peer, Resources]]:
    """Yield each row of ``PEERS`` and the cost of our block, laid out alone."""
    for peer in PEERS:
        progress(f"Laying out: {peer.function}.")
        text = rtlil.convert(peer.ours(), name="block", emit_src=False)
        yield peer, Resources(cells(text), layout(text))
