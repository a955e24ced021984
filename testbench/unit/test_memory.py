# SPDX-License-Identifier: Apache-2.0
"""The processor's memory against a list of words, on both of its buses at once."""

from softcore.soc import BlockRam
from testbench.refusal import refuses

WORDS = 64
ROUNDS = 400


async def access(ctx, bus, address, *, more=False, mask=0, data=0):
    """One access; return the word read, and the clocks until it was acknowledged."""
    for name, value in (("adr", address), ("stb", 1), ("more", more), ("we", mask != 0),
                        ("sel", mask or 15), ("dat_w", data)):
        ctx.set(getattr(bus, name), value)
    clocks = 1
    while True:
        *_, ack, word = await ctx.tick().sample(bus.ack, bus.dat_r)
        if ack:
            ctx.set(bus.stb, 0)
            return word, clocks
        clocks += 1
        assert clocks <= 2


def test_agrees_with_a_list_of_words(simulate, rng):
    words = [rng.getrandbits(32) for _ in range(WORDS)]
    dut = BlockRam(size=4 * WORDS, image=b"".join(word.to_bytes(4, "little") for word in words))
    counts = {"reads": 0, "bursts": 0, "writes": 0}

    async def instructions(ctx):
        # Only words that data leaves alone: who comes first in a clock is not this test's matter.
        for _ in range(ROUNDS):
            await burst(ctx, dut.ibus, 8 * rng.randrange(WORDS // 16))
            await ctx.tick().repeat(rng.randint(1, 3))

    async def burst(ctx, bus, start):
        for place in range(8):
            word, clocks = await access(ctx, bus, start + place, more=place != 7)
            assert word == words[start + place]
            assert clocks == (1 if place else 2)
        counts["bursts"] += 1

    async def data(ctx):
        for _ in range(3 * ROUNDS):
            address = WORDS // 2 + rng.randrange(WORDS // 2)
            if rng.random() < 0.2:
                await burst(ctx, dut.dbus, address & -8)
            elif rng.random() < 0.5:
                word, clocks = await access(ctx, dut.dbus, address)
                assert (word, clocks) == (words[address], 2)
                counts["reads"] += 1
            else:
                mask, value = rng.randrange(1, 16), rng.getrandbits(32)
                _, clocks = await access(ctx, dut.dbus, address, mask=mask, data=value)
                assert clocks == 2
                lanes = sum(0xFF << 8 * lane for lane in range(4) if mask >> lane & 1)
                words[address] = words[address] & ~lanes | value & lanes
                counts["writes"] += 1
            if rng.random() < 0.7:
                await ctx.tick().repeat(rng.randint(1, 3))

    simulate(dut, instructions, data, deadline=1e-3)
    assert counts["bursts"] > ROUNDS + 100
    assert min(counts["reads"], counts["writes"]) > 300


def test_refuses_an_image_that_does_not_fit():
    refuses(BlockRam, r"^the firmware image has 9 bytes, the memory 8$", size=8, image=bytes(9))
