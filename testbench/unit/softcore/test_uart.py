# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``softcore.uart``, against the exact model."""

import pytest

from softcore.uart import Receiver, Transmitter, Uart
from testbench.models import link_decoder
from testbench.models import uart as model
from testbench.refusal import refuses
from testbench.simulators.benches import settle

EDGES = [0x00, 0xFF, 0x55, 0xAA, 0x01, 0x80]


async def listen(ctx, dut, line):
    """Drive a receiver with a line; return its results, by the clock of the stop bit's middle."""
    found = []
    for clock, level in enumerate(line):
        ctx.set(dut.rx, level)
        await settle(ctx)
        if ctx.get(dut.done):
            found.append((clock - 1, ctx.get(dut.data)))
        if ctx.get(dut.framing):
            found.append((clock - 1, model.FRAMING))
        await ctx.tick()
    return found


@pytest.mark.parametrize("divisor", [40, 4, 5, 8, 25])     # 40: of the boards
def test_receiver_follows_the_model(simulate, rng, divisor):
    """Bytes with and without gaps, with noise, lost stop bits and breaks."""
    line = [1] * 20
    for byte in EDGES + [rng.randrange(256) for _ in range(40)]:
        bits = model.levels([byte], divisor)
        fault = rng.random()
        if fault < 0.2:
            bits[rng.randrange(len(bits))] ^= 1
        elif fault < 0.3:
            bits[-divisor:] = [0] * divisor * rng.choice((1, 5, 12))
        line += bits + [1] * rng.choice((0, 0, 1, divisor, rng.randrange(40)))
        if rng.random() < 0.2:
            line += [0] * rng.randrange(1, divisor) + [1] * divisor
    line += [1] * 12 * divisor
    expected = model.receive(line, divisor)
    assert {model.FRAMING} < {what for _, what in expected}

    async def bench(ctx):
        assert await listen(ctx, dut, line) == expected

    dut = Receiver(divisor=divisor)
    simulate(dut, bench)


@pytest.mark.parametrize(("divisor", "off"), [
    (4, 0.02), (4, -0.02), (8, 0.03), (8, -0.03), (25, 0.04), (25, -0.04)])
def test_receiver_bears_another_clock(simulate, rng, divisor, off):
    """Bytes without gaps from a sender whose bits are longer or shorter by ``off``."""
    data = EDGES + [rng.randrange(256) for _ in range(30)]
    line = model.waveform(data, divisor * (1 + off), phase=rng.random(), idle=7) + [1] * 10
    dut = Receiver(divisor=divisor)

    async def bench(ctx):
        assert [what for _, what in await listen(ctx, dut, line)] == data

    simulate(dut, bench)


@pytest.mark.parametrize("divisor", [40, 4, 7, 8])
def test_transmitter_follows_the_model(simulate, rng, divisor):
    dut = Transmitter(divisor=divisor)
    data = EDGES + [rng.randrange(256) for _ in range(10)]

    async def bench(ctx):
        assert ctx.get(dut.tx), "idle"
        ctx.set(dut.valid, 1)
        line = []
        for byte in data:
            ctx.set(dut.data, byte)
            await settle(ctx)
            assert ctx.get(dut.ready)
            await ctx.tick()
            for _ in range(10 * divisor - 1):
                assert not ctx.get(dut.ready)
                line.append(ctx.get(dut.tx))
                await ctx.tick()
            line.append(ctx.get(dut.tx))
        assert line == model.levels(data, divisor)
        ctx.set(dut.valid, 0)
        for _ in range(20):
            await ctx.tick()
            assert ctx.get(dut.tx)

    simulate(dut, bench)


def test_bytes_go_round(simulate, rng):
    """Sent bytes come back, over a line of some clocks, while both sides pause at random."""
    dut = Uart(divisor=4)
    realtime = {link_decoder.RESET, *link_decoder.NOTES.values(), link_decoder.DOOR,
                *link_decoder.NOTHING, *link_decoder.OVERRIDES}
    data = EDGES + [byte for byte in (rng.randrange(256) for _ in range(150))
                    if byte not in realtime]

    async def send(ctx):
        for byte in data:
            while not ctx.get(dut.ready) or rng.random() < 0.5:
                await ctx.tick()
            ctx.set(dut.transmit, byte)
            ctx.set(dut.transmit_strobe, 1)
            await ctx.tick()
            ctx.set(dut.transmit_strobe, 0)
            await settle(ctx)

    async def receive(ctx):
        got = []
        line = [1, 1, 1]
        while len(got) < len(data):
            taken = ctx.get(dut.receive_valid) and rng.random() < 0.1
            if taken:
                got.append(ctx.get(dut.receive_data))
            ctx.set(dut.receive_strobe, taken)
            ctx.set(dut.rx, line.pop(0))
            await settle(ctx)
            line.append(ctx.get(dut.tx))
            assert not (ctx.get(dut.receive_valid) and ctx.get(dut.receive_mark))
            await ctx.tick()
        assert got == data

    simulate(dut, send, receive)


def test_a_notice_takes_the_line_after_the_byte_under_way(simulate):
    """Nothing that was queued follows, nor between the notice's bytes."""
    dut = Uart(divisor=4)
    line = []

    async def bench(ctx):
        for byte in b"abc":
            ctx.set(dut.transmit, byte)
            ctx.set(dut.transmit_strobe, 1)
            await ctx.tick()
        ctx.set(dut.transmit_strobe, 0)
        ctx.set(dut.taken, 1)
        for byte in b"XY":
            await ctx.tick().repeat(60)
            ctx.set(dut.notice_data, byte)
            ctx.set(dut.notice_valid, 1)
            await settle(ctx)
            while not ctx.get(dut.notice_ready):
                await ctx.tick()
            await ctx.tick()
            ctx.set(dut.notice_valid, 0)
            await settle(ctx)
            assert not ctx.get(dut.notice_ready), "one byte is taken"
        await ctx.tick().repeat(100)
        ctx.set(dut.taken, 0)

    async def listen(ctx):
        for _ in range(400):
            line.append(ctx.get(dut.tx))
            await ctx.tick()

    simulate(dut, bench, listen)
    assert [byte for _, byte in model.receive(line + [1] * 50, 4)] == list(b"aXYbc")


def test_a_mark_in_view_is_not_yet_taken(simulate):
    """So a release before it is taken was meant for an earlier reset."""
    dut = Uart(divisor=4)

    async def bench(ctx):
        for level in (0, *(link_decoder.RESET >> bit & 1 for bit in range(8)), 1):
            ctx.set(dut.rx, level)
            await ctx.tick().repeat(4)
        await ctx.tick().repeat(10)
        for strobe in (0, 1):
            assert ctx.get(dut.receive_valid) == 1 - strobe
            ctx.set(dut.release_reset, 1)
            ctx.set(dut.release_strobe, 1)
            await ctx.tick()
            ctx.set(dut.release_strobe, 0)
            await settle(ctx)
            assert ctx.get(dut.reset) == 1 - strobe
            ctx.set(dut.receive_strobe, 1)
            await ctx.tick()
            ctx.set(dut.receive_strobe, 0)
            await ctx.tick()

    simulate(dut, bench)


def test_full_queues_refuse(simulate, rng):
    """The last place of the receive queue is for the mark of lost bytes."""
    dut = Uart(divisor=4)
    data = [rng.randrange(0x41, 0x5B) for _ in range(258)]

    async def bench(ctx):
        for level in model.levels(data, 4) + [1] * 5:
            ctx.set(dut.rx, level)
            await ctx.tick()
        ctx.set(dut.receive_strobe, 1)
        for entry in [*data[:255], link_decoder.OVERRUN]:
            await settle(ctx)
            assert ctx.get(dut.receive_valid)
            assert ctx.get(dut.receive_mark) << 8 | ctx.get(dut.receive_data) == entry
            await ctx.tick()
        assert not ctx.get(dut.receive_valid)

        accepted = 0
        ctx.set(dut.transmit_strobe, 1)
        for _ in range(100):
            await settle(ctx)
            accepted += ctx.get(dut.ready)
            await ctx.tick()
        assert accepted == 64 + 3, "the queue, and those on the line meanwhile"

    simulate(dut, bench)


def test_break_is_one_framing_error(simulate):
    dut = Uart(divisor=8)

    async def bench(ctx):
        for clock in range(600):
            ctx.set(dut.rx, not 20 <= clock < 500)
            await ctx.tick()
        assert ctx.get(dut.receive_mark) << 8 | ctx.get(dut.receive_data) == link_decoder.FRAMING
        ctx.set(dut.receive_strobe, 1)
        await ctx.tick()
        assert not ctx.get(dut.receive_valid)

    simulate(dut, bench)


@pytest.mark.parametrize("block", [Uart, Receiver, Transmitter])
def test_refuses_wrong_parameters(block):
    refuses(block, r"there must be at least 4 clocks per bit, not 3", divisor=3)
