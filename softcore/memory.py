# SPDX-License-Identifier: Apache-2.0
"""The processor's memory: block RAM with a parity bit for every word."""

from functools import reduce
from operator import or_

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from softcore.cpu import BusSignature

__all__ = ["BlockRam", "bank_sizes", "parities", "words_of"]


def words_of(image: bytes) -> list[int]:
    """Words of a little-endian image; the last one is padded with zeros."""
    image += bytes(-len(image) % 4)
    return [int.from_bytes(image[at:at + 4], "little") for at in range(0, len(image), 4)]


def parities(image: bytes) -> list[int]:
    """Even parity of each word.

    A memory without an image, all zeros, has the right parity.
    """
    return [word.bit_count() & 1 for word in words_of(image)]


def bank_sizes(depth: int) -> list[tuple[int, int]]:
    """First word and number of words of each bank: the powers of two in ``depth``, largest first.

    Each bank starts at a multiple of its own size.
    """
    found, start = [], 0
    for bit in reversed(range(depth.bit_length())):
        if depth >> bit & 1:
            found.append((start, 1 << bit))
            start += 1 << bit
    return found


class BlockRam(wiring.Component):
    """Memory of the processor: instructions on one port, data on the other.

    An access takes 2 clocks; further words of a burst take 1 clock each. A burst has up to
    ``BURST`` words and starts at a multiple of this; the caches read in bursts. A write of some
    bytes of a word takes 3 clocks: its parity needs that of the others, which are read first.

    The parity of a word is checked when it is read and when some of its bytes are written; the
    report comes in the clock after its ``ack``, for on an FPGA the block RAMs are slow and far
    apart. A damaged word is reported at each access until all of it is written.

    The parities are in a memory of their own. The data are in block RAMs with rows of one bit,
    which have no ninth bit for a parity. These rows keep the multiplexers between block RAMs small:
    rows of 9 bits took 1450 more look-up tables on an LFE5U-45F. The separate memory takes 3 more
    of its 108 block RAMs.

    A memory in ``banks`` has one bank for each power of two in its size, the largest first.
    Measured with Yosys for ECP5, with the parity: 184 KiB take 95 block RAMs in place of 99;
    176 KiB take 91 both ways, and 413 look-up tables in place of 841.

    Parameters
    ----------
    size : int
        Bytes; a multiple of 4.
    banks : bool
        Save block RAMs, at the price of a multiplexer between the banks.
    image : bytes
        Initial contents: the firmware, little-endian. The remainder is zero.

    Members
    -------
    ibus, dbus : In(BusSignature)
        Word accesses; only ``dbus`` writes, by bytes, and never in a burst.
    damaged : Out(1)
        A word has the wrong parity: high in the clock after its ``ack``.
    place : Out(32)
        Address of that word, in bytes; of two words, the instruction's. Valid with ``damaged``.

    Raises
    ------
    ValueError
        If the image does not fit.
    """

    BURST = 8

    def __init__(self, *, size: int, image: bytes = b"", banks: bool = False):
        if len(image) > size:
            raise ValueError(f"the firmware image has {len(image)} bytes, the memory {size}")
        words = words_of(image)
        self.banks = [(start, memory.MemoryData(shape=32, depth=depth,
                                                init=words[start:start + depth]))
                      for start, depth in (bank_sizes(size // 4) if banks else [(0, size // 4)])]
        self.parity = memory.MemoryData(shape=1, depth=size // 4, init=parities(image))
        super().__init__({"ibus": In(BusSignature()), "dbus": In(BusSignature()),
                          "damaged": Out(1), "place": Out(32)})

    def elaborate(self, platform):
        m = Module()

        m.submodules.parity = parity = memory.Memory(self.parity)
        rams = [memory.Memory(data) for _, data in self.banks]
        names = [f"ram_{index}" for index in range(len(rams))] if len(rams) > 1 else ["ram"]
        for name, ram in zip(names, rams, strict=True):
            m.submodules[name] = ram
        writes_to = [ram.write_port(granularity=8) for ram in rams]
        write_parity = parity.write_port()
        writes, whole = Signal(), self.dbus.sel.all()
        others = Signal()   # a write of some bytes has read the word
        found, places = [], []
        # A transparent port at the write's address. Otherwise ECP5 needs a copy for each read port.
        for bus in (self.ibus, self.dbus):
            reads = [ram.read_port(transparent_for=(write,))
                     for ram, write in zip(rams, writes_to, strict=True)]
            read_parity = parity.read_port(transparent_for=(write_parity,))
            low = Signal(exact_log2(self.BURST))
            address = Signal.like(read_parity.addr)
            m.d.comb += [
                low.eq(bus.adr[:len(low)] + (bus.ack & bus.more)),
                address.eq(Cat(low, bus.adr[len(low):])), read_parity.addr.eq(address),
                read_parity.en.eq(bus.stb),
                *(read.addr.eq(address) for read in reads),
                *(read.en.eq(bus.stb) for read in reads),
                bus.dat_r.eq(self._chosen(m, reads, address, bus.stb)),
            ]
            ready, unread = ((~bus.we | whole | others, writes & whole) if bus is self.dbus
                             else (C(1), C(0)))
            m.d.sync += bus.ack.eq(bus.stb & Mux(bus.ack, bus.more, ready))
            # The parity in two clocks: that of four bits each, then that of all.
            sums, looked, place = Signal(9), Signal(), Signal.like(bus.adr)
            m.d.sync += [
                sums.eq(Cat(*(bus.dat_r[at:at + 4].xor() for at in range(0, 32, 4)),
                            read_parity.data)),
                looked.eq(bus.stb & bus.ack & ~unread), place.eq(bus.adr),
            ]
            found.append(sums.xor() & looked)
            places.append(place)

        # Written in the clock of the ack, when the sums of the old word are known. A write of some
        # bytes changes the parity only by the change of these, so a wrong parity stays wrong.
        bus = self.dbus
        m.d.sync += others.eq(bus.stb & bus.we & ~bus.ack)

        def written(halves):
            """Parity of what is written of a word; the sums of its halves of bytes are given."""
            return Cat(halves[2 * at:2 * at + 2].xor() & bit
                       for at, bit in enumerate(bus.sel)).xor()

        new = Cat(bus.dat_w[at:at + 4].xor() for at in range(0, 32, 4))
        m.d.comb += [
            writes.eq(bus.stb & bus.ack & bus.we),
            write_parity.addr.eq(address),
            *(write.addr.eq(address) for write in writes_to),
            *(write.data.eq(bus.dat_w) for write in writes_to),
            write_parity.data.eq(written(new) ^ Mux(whole, 0, written(sums[:8]) ^ sums[8])),
            *(write.en.eq(Mux(writes & self._within(bank, address), bus.sel, 0))
              for bank, write in enumerate(writes_to)),
            write_parity.en.eq(writes),
            self.damaged.eq(found[0] | found[1]),
            self.place.eq(Cat(C(0, 2), Mux(found[0], *places))),
        ]

        return m

    def _within(self, bank, address):
        """Whether an address of a word is in a bank."""
        if len(self.banks) == 1:
            return C(1)
        start, data = self.banks[bank]
        bits = exact_log2(data.depth)
        return address[bits:] == start >> bits

    def _chosen(self, m, reads, address, strobe):
        """The word that was read, from the bank in which its address was."""
        if len(reads) == 1:
            return reads[0].data
        words = []
        for bank, read in enumerate(reads):
            was = Signal(name=f"was_in_{bank}")
            with m.If(strobe):
                m.d.sync += was.eq(self._within(bank, address))
            words.append(read.data & was.replicate(32))
        return reduce(or_, words)
