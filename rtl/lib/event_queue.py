# SPDX-License-Identifier: Apache-2.0
"""Small queue in distributed memory."""

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

__all__ = ["EventQueue"]


class EventQueue(wiring.Component):
    """First in, first out, with the oldest entry always at the head.

    ``push`` stores ``data``; in an empty queue it is at the head in the next clock. ``valid`` says
    that there is an entry, and ``head`` is then the oldest. ``pop`` drops it, and the next one is
    at the head in the next clock. Both may be high in every clock and together. ``pop`` of an empty
    queue does nothing. ``push`` onto a full queue is refused unless ``pop`` is high too: the queue
    keeps its entries, the new one is lost, and ``lost`` is high in that clock.

    Parameters
    ----------
    width : int
        Bits of an entry, at least 1.
    depth : int
        Entries, a power of two, at least 2.

    Members
    -------
    push : In(1), data : In(width)
        Store an entry.
    pop : In(1)
        Drop the oldest.
    head : Out(width)
        The oldest entry, while ``valid``.
    valid : Out(1)
        There is one.
    full : Out(1)
        There is no room.
    level : Out(bits for 0 to depth)
        Entries.
    lost : Out(1)
        An entry was refused.

    Raises
    ------
    ValueError
        If ``width`` or ``depth`` is not possible.
    """

    def __init__(self, *, width, depth=16):
        if width < 1:
            raise ValueError(f"queue width must be at least 1 bit, not {width!r}")
        if depth < 2 or depth & (depth - 1):
            raise ValueError(f"queue depth must be a power of two from 2 on, not {depth!r}")
        self.width = width
        self.depth = depth
        super().__init__({
            "push": In(1), "data": In(width), "pop": In(1),
            "head": Out(width), "valid": Out(1), "full": Out(1), "lost": Out(1),
            "level": Out(range(depth + 1)),
        })

    def elaborate(self, platform):
        m = Module()

        bits = exact_log2(self.depth)
        m.submodules.storage = storage = memory.Memory(shape=self.width, depth=self.depth, init=[])
        write = storage.write_port()
        read = storage.read_port(domain="comb")
        newest = Signal(bits + 1)  # pointers with a lap bit: equal if empty, a lap apart if full
        oldest = Signal(bits + 1)

        take = Signal()
        drop = Signal()
        m.d.comb += [
            self.valid.eq(newest != oldest),
            self.full.eq((newest ^ oldest) == self.depth),
            self.level.eq(newest - oldest),
            drop.eq(self.pop & self.valid),
            take.eq(self.push & (~self.full | self.pop)),
            self.lost.eq(self.push & ~take),
            write.addr.eq(newest),
            write.data.eq(self.data),
            write.en.eq(take),
            read.addr.eq(oldest),
            self.head.eq(read.data),
        ]
        m.d.sync += [newest.eq(newest + take), oldest.eq(oldest + drop)]

        return m
