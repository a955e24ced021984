# SPDX-License-Identifier: Apache-2.0
"""The processor's memory: block RAM with a parity bit for every word."""

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from softcore.cpu import BusSignature

__all__ = ["BlockRam", "parities", "words_of"]


def words_of(image: bytes) -> list[int]:
    """Words of a little-endian image; the last one is padded with zeros."""
    image += bytes(-len(image) % 4)
    return [int.from_bytes(image[at:at + 4], "little") for at in range(0, len(image), 4)]


def parities(image: bytes) -> list[int]:
    """Even parity of each word.

    A memory without an image, all zeros, has the right parity.
    """
    return [word.bit_count() & 1 for word in words_of(image)]


class BlockRam(wiring.Component):
    """Memory of the processor: instructions on one port, data on the other.

    An access takes 2 clocks; further words of a burst take 1 clock each. A burst has up to
    ``BURST`` words and starts at a multiple of this; the caches read in bursts.

    The parity of a word is checked in the clock of its ``ack``, when it is read or when some of its
    bytes are written. A damaged word is reported at each access until all of it is written.

    The parities are in a memory of their own. The data are in block RAMs with rows of one bit,
    which have no ninth bit for a parity. These rows keep the multiplexers between block RAMs small:
    rows of 9 bits took 1450 more look-up tables on an LFE5U-45F. The separate memory takes 3 more
    of its 108 block RAMs.

    Parameters
    ----------
    size : int
        Bytes; a multiple of 4.
    image : bytes
        Initial contents: the firmware, little-endian. The remainder is zero.

    Members
    -------
    ibus, dbus : In(BusSignature)
        Word accesses; only ``dbus`` writes, by bytes, and never in a burst.
    damaged : Out(1)
        A word has the wrong parity: high in the clock of its ``ack``.
    place : Out(32)
        Address of that word, in bytes; of two words, the instruction's. Valid with ``damaged``.

    Raises
    ------
    ValueError
        If the image does not fit.
    """

    BURST = 8

    def __init__(self, *, size: int, image: bytes = b""):
        if len(image) > size:
            raise ValueError(f"the firmware image has {len(image)} bytes, the memory {size}")
        self.data = memory.MemoryData(shape=32, depth=size // 4, init=words_of(image))
        self.parity = memory.MemoryData(shape=1, depth=size // 4, init=parities(image))
        super().__init__({"ibus": In(BusSignature()), "dbus": In(BusSignature()),
                          "damaged": Out(1), "place": Out(32)})

    def elaborate(self, platform):
        m = Module()

        m.submodules.ram = ram = memory.Memory(self.data)
        m.submodules.parity = parity = memory.Memory(self.parity)
        write, write_parity = ram.write_port(granularity=8), parity.write_port()
        found = []
        # A transparent port at the write's address. Otherwise ECP5 needs a copy for each read port.
        for bus in (self.ibus, self.dbus):
            read = ram.read_port(transparent_for=(write,))
            read_parity = parity.read_port(transparent_for=(write_parity,))
            low = Signal(exact_log2(self.BURST))
            m.d.comb += [
                low.eq(bus.adr[:len(low)] + (bus.ack & bus.more)),
                read.addr.eq(Cat(low, bus.adr[len(low):])), read_parity.addr.eq(read.addr),
                read.en.eq(bus.stb), read_parity.en.eq(bus.stb),
                bus.dat_r.eq(read.data),
            ]
            m.d.sync += bus.ack.eq(bus.stb & (~bus.ack | bus.more))
            found.append((read.data.xor() ^ read_parity.data) & bus.stb & bus.ack)

        # Written in the clock of the ack, when the old word is known. A write of some bytes changes
        # the parity only by the change of these bytes, so a wrong parity stays wrong.
        bus = self.dbus
        writes, whole = Signal(), bus.sel.all()
        chosen = Cat(bit.replicate(8) for bit in bus.sel)
        m.d.comb += [
            writes.eq(bus.stb & bus.ack & bus.we),
            write.addr.eq(read.addr), write_parity.addr.eq(read.addr),
            write.data.eq(bus.dat_w),
            write_parity.data.eq((bus.dat_w & chosen).xor() ^ Mux(
                whole, 0, (read.data & chosen).xor() ^ read_parity.data)),
            write.en.eq(Mux(writes, bus.sel, 0)), write_parity.en.eq(writes),
            self.damaged.eq(found[0] | found[1] & ~(writes & whole)),
            self.place.eq(Cat(C(0, 2), Mux(found[0], self.ibus.adr, bus.adr))),
        ]

        return m
