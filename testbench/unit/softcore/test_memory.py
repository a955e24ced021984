# SPDX-License-Identifier: Apache-2.0
"""The processor's memory against its exact model, on both of its buses at once."""

import pytest

from softcore.memory import BlockRam, bank_sizes, parities, words_of
from testbench.models.memory import Memory
from testbench.refusal import refuses
from testbench.simulators.benches import settle

WORDS = 64
ROUNDS = 400


BANKED = 88     # words in banks of 64, 16 and 8
BOARD = 184 * 256   # of the boards with an LFE5U-45F, in banks


@pytest.fixture(params=[WORDS, BANKED, pytest.param(BOARD, marks=pytest.mark.soak)],
                ids=["one", "banks", "board"])
def filled(request, rng):
    """A memory of random words, in one piece or in banks, and its model."""
    words = [rng.getrandbits(32) for _ in range(request.param)]
    dut = BlockRam(size=4 * len(words), banks=request.param != WORDS,
                   image=b"".join(word.to_bytes(4, "little") for word in words))
    return dut, Memory(words)


async def turn_over(ctx, dut, model, address, bit):
    """Invert a bit of the memory, or its parity, and the same in the model."""
    model.flip(address, bit)
    await settle(ctx)
    start, data = (0, dut.parity) if bit == 32 else max(
        (bank for bank in dut.banks if bank[0] <= address), key=lambda bank: bank[0])
    word = data[address - start]
    ctx.set(word, ctx.get(word) ^ (1 if bit == 32 else 1 << bit))


async def access(ctx, dut, bus, address, *, more=False, mask=0, data=0):
    """One access; return the word read, the clocks until ``ack``, and the reported damage."""
    for name, value in (("adr", address), ("stb", 1), ("more", more), ("we", mask != 0),
                        ("sel", mask or 15), ("dat_w", data)):
        ctx.set(getattr(bus, name), value)
    clocks = 1
    while True:
        *_, ack, word = await ctx.tick().sample(bus.ack, bus.dat_r)
        damage = ctx.get(dut.place) if ctx.get(dut.damaged) else None   # the clock after
        if ack:
            ctx.set(bus.stb, 0)
            return word, clocks, damage
        assert damage is None
        clocks += 1
        assert clocks <= 3


def test_agrees_with_its_model(simulate, rng, filled):
    dut, model = filled
    half = 8 * (len(model.words) // 16)
    counts = {"reads": 0, "bursts": 0, "writes": 0}

    async def instructions(ctx):
        # Only words that data leaves alone: who comes first in a clock is not this test's matter.
        for _ in range(ROUNDS):
            await burst(ctx, dut.ibus, 8 * rng.randrange(len(model.words) // 16))
            await ctx.tick().repeat(rng.randint(1, 3))

    async def burst(ctx, bus, start):
        for place in range(8):
            word, clocks, damage = await access(ctx, dut, bus, start + place, more=place != 7)
            assert word == model.words[start + place]
            assert clocks == (1 if place else 2)
            assert damage is None
        counts["bursts"] += 1

    async def data(ctx):
        for _ in range(3 * ROUNDS):
            address = half + rng.randrange(len(model.words) - half)
            if rng.random() < 0.2:
                await burst(ctx, dut.dbus, address & -8)
            elif rng.random() < 0.5:
                got = await access(ctx, dut, dut.dbus, address)
                assert got == (model.words[address], 2, None)
                counts["reads"] += 1
            else:
                mask, value = rng.randrange(1, 16), rng.getrandbits(32)
                _, clocks, damage = await access(ctx, dut, dut.dbus, address, mask=mask, data=value)
                assert (clocks, damage) == (2 if mask == 15 else 3, None)
                model.write(address, mask, value)
                counts["writes"] += 1
            if rng.random() < 0.7:
                await ctx.tick().repeat(rng.randint(1, 3))

    simulate(dut, instructions, data, deadline=1e-3)
    assert counts["bursts"] > ROUNDS + 100
    assert min(counts["reads"], counts["writes"]) > 300


@pytest.mark.parametrize("port", ["ibus", "dbus"])
def test_every_bit_that_turns_over_is_found_when_it_is_read(simulate, rng, filled, port):
    dut, model = filled

    async def bench(ctx):
        bus = getattr(dut, port)
        for bit in range(33):
            address = rng.randrange(len(model.words))
            await turn_over(ctx, dut, model, address, bit)
            start = address & -8
            for place in range(start, start + 8):
                word, _, damage = await access(ctx, dut, bus, place, more=place % 8 != 7)
                assert word == model.words[place]
                assert damage == (4 * place if place == address else None)
            await turn_over(ctx, dut, model, address, bit)
            assert (await access(ctx, dut, bus, address))[2] is None

    simulate(dut, bench)


def test_bits_that_turn_over_between_reads_and_writes(simulate, rng, filled):
    """A write of some bytes finds the damage and leaves it; a write of all bytes repairs it."""
    dut, model = filled
    seen = set()

    async def bench(ctx):
        for _ in range(4 * ROUNDS):
            address = rng.choice([rng.randrange(8), len(model.words) - 1])
            if rng.random() < 0.3:
                await turn_over(ctx, dut, model, address, rng.randrange(33))
            elif rng.random() < 0.5:
                damaged = not model.sound(address)
                word, _, damage = await access(ctx, dut, dut.dbus, address)
                assert (word, damage) == (model.words[address], 4 * address if damaged else None)
                seen.add(("read", damaged))
            else:
                mask, value = rng.choice([15, rng.randrange(1, 16)]), rng.getrandbits(32)
                before = model.sound(address)
                damaged = model.write(address, mask, value)
                damage = (await access(ctx, dut, dut.dbus, address, mask=mask, data=value))[2]
                assert damage == (4 * address if damaged else None)
                seen.add(("whole" if mask == 15 else "part", before))

    simulate(dut, bench, deadline=1e-3)
    assert seen == {(what, how) for what in ("read", "whole", "part") for how in (False, True)}


def test_of_two_at_once_the_instruction_is_told(simulate, rng, filled):
    dut, model = filled

    async def bench(ctx):
        for address in (3, 9):
            await turn_over(ctx, dut, model, address, address)
        for bus, address in ((dut.ibus, 3), (dut.dbus, 9)):
            ctx.set(bus.adr, address)
            ctx.set(bus.stb, 1)
        await ctx.tick().repeat(2)
        assert ctx.get(dut.damaged)
        assert ctx.get(dut.place) == 12

    simulate(dut, bench)


def test_parity_makes_the_number_of_ones_even():
    image = bytes(range(0, 255, 3)) + b"\x80\x00"
    words = words_of(image)
    assert b"".join(word.to_bytes(4, "little") for word in words) == image + b"\x00"
    assert all((word.bit_count() + parity) % 2 == 0
               for word, parity in zip(words, parities(image), strict=True))
    assert set(parities(image)) == {0, 1}
    assert parities(bytes(8)) == [0, 0], "a memory without an image is right"


@pytest.mark.parametrize(("kib", "sizes"), [
    (304, [65_536, 8192, 4096]), (176, [32_768, 8192, 4096]), (128, [32_768])])
def test_banks_are_the_powers_of_two_in_the_size(kib, sizes):
    banks = bank_sizes(kib * 256)
    assert [size for _, size in banks] == sizes
    assert all(start == sum(sizes[:at]) and start % size == 0
               for at, (start, size) in enumerate(banks))


def test_refuses_an_image_that_does_not_fit():
    refuses(BlockRam, r"^the firmware image has 9 bytes, the memory 8$", size=8, image=bytes(9))
