# SPDX-License-Identifier: Apache-2.0
"""The processor's memory: block RAM, every word with its parity."""

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from softcore.cpu import BusSignature

__all__ = ["BlockRam", "parities", "words_of"]


def words_of(image: bytes) -> list[int]:
    """Words of a little-endian image, the last filled with zeros."""
    image += bytes(-len(image) % 4)
    return [int.from_bytes(image[at:at + 4], "little") for at in range(0, len(image), 4)]


def parities(image: bytes) -> list[int]:
    """The parity of each of these words: with it the number of ones is even.

    So a word of zeros is right as a memory is without an image.
    """
    return [word.bit_count() & 1 for word in words_of(image)]


class BlockRam(wiring.Component):
    """Memory of the processor: instructions on one port, data on the other.

    An access takes 2 clocks, or 1 as the next of a burst of up to ``BURST`` words, which the
    caches read from an address that is a multiple of it.

    Every word that is read, and every word of which some bytes are written, is held against its
    parity in the clock of its ``ack``. A word that has read wrong goes on to do so until all of it
    is written.

    The parities stand in a memory of their own. The data lie in block RAMs of one bit a row, so
    that few words stand side by side to choose from: these have no ninth bit. Rows of 9 bits
    took 1450 look-up tables more for the choice, on an LFE5U-45F; so it is 3 more of its 108 block
    RAMs.

    Parameters
    ----------
    size : int
        Bytes; a multiple of 4.
    image : bytes
        What is in it at the start: the firmware, little-endian. The rest is zero.

    Members
    -------
    ibus, dbus : In(BusSignature)
        Word accesses; only ``dbus`` writes, by bytes, and never in a burst.
    damaged : Out(1)
        A word was held against its parity, and differs: high in the clock of its ``ack``.
    place : Out(32)
        Address of that word, in bytes; of two, that of the instruction. Valid with ``damaged``.

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
        # Transparent, and at the address of the write: or ECP5 needs a copy per read port.
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

        # Written in the clock of the ack, in which the word is known as it was. Some bytes turn its
        # parity over if they do, and what was wrong with it stays.
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
