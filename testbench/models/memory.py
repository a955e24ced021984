# SPDX-License-Identifier: Apache-2.0
"""Reference model of the processor's memory: words of 32 bits, and the parity of each."""


class Memory:
    """``flips`` are, by address in words, bits turned over since the word was last written whole.

    Bit 32 is the word's parity.
    """

    def __init__(self, words):
        self.words = list(words)
        self.flips = {}

    def flip(self, address, bit):
        """Turn a bit over."""
        if bit < 32:
            self.words[address] ^= 1 << bit
        self.flips[address] = self.flips.get(address, 0) + 1

    def sound(self, address):
        """Whether the word agrees with its parity: not if an odd number of bits has changed."""
        return self.flips.get(address, 0) % 2 == 0

    def write(self, address, mask, value):
        """Write the bytes of ``mask``; return whether the word that stood there was not to be."""
        damaged = mask != 15 and not self.sound(address)
        lanes = sum(0xFF << 8 * lane for lane in range(4) if mask >> lane & 1)
        self.words[address] = self.words[address] & ~lanes | value & lanes
        if mask == 15:
            self.flips.pop(address, None)
        return damaged
