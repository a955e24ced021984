# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``softcore.link_decoder``, against the exact model, alone and behind the line."""

import pytest

from host.link.framing import frame, frames, numbered
from softcore import linkmap
from softcore.link_decoder import LinkDecoder
from softcore.uart import Uart
from testbench import firmware
from testbench.models import link_decoder as model
from testbench.models import uart as line_model
from testbench.simulators.benches import settle

REALTIME = [model.RESET, *model.NOTES.values()]
GRBL = {0x84, 0x85, *range(0x90, 0xA2)}     # its real-time bytes beyond ASCII
DIVISOR = 4


def test_the_model_knows_the_same_bytes():
    """The model's own numbers agree with those that gateware, firmware and host share."""
    assert {one.name: one.byte for one in linkmap.REALTIME} == {
        "reset": model.RESET} | model.NOTES
    assert [name for name, _ in linkmap.MARKS] == ["framing", "overrun", "reset"]
    assert {one.byte for one in linkmap.OVERRIDE_BYTES} == model.OVERRIDES
    assert set(linkmap.PASSED_OVER) == model.NOTHING
    assert ({one.byte for one in linkmap.REALTIME if one.byte > 0x7F} | {linkmap.DOOR}
            | model.OVERRIDES | model.NOTHING) == GRBL | {0xB0}


def outputs(ctx, dut):
    """Outputs of the decoder, in the model's form."""
    return (bool(ctx.get(dut.hold)), bool(ctx.get(dut.reset)),
            {name for name in model.NOTES if ctx.get(getattr(dut, f"notes_{name}"))},
            (ctx.get(dut.override_feed), ctx.get(dut.override_rapid)))


def told(shadow):
    """The same of the model."""
    return shadow.hold, shadow.reset, shadow.notes, (shadow.feed, shadow.rapid)


def test_follows_the_model(simulate, rng):
    """Bytes, broken bytes, releases and reads at random, each clock compared."""
    dut, shadow = LinkDecoder(), model.LinkDecoder()
    seen, feeds = set(), set()

    async def bench(ctx):
        quiet = False
        for _ in range(4000):
            byte = framing = None
            if quiet and rng.random() < 0.6:
                framing = rng.random() < 0.1
                byte = rng.choice((*REALTIME, *REALTIME, *rng.choices(
                    sorted(model.OVERRIDES), k=len(REALTIME)), 0x0A, rng.randrange(256)))
            quiet = byte is None
            inputs = dict(
                byte=None if framing else byte, framing=bool(framing), room=rng.random() < 0.8,
                head=rng.choice((model.RESET_MARK, model.RESET, model.FRAMING, 0x41)),
                taken=rng.random() < 0.3,
                release=rng.choice(((), (), ("hold",), ("reset",), ("hold", "reset")))
                + ("override",) * (rng.random() < 0.02),
                read_notes=rng.random() < 0.2)
            ctx.set(dut.data, byte if byte is not None else rng.randrange(256))
            ctx.set(dut.done, byte is not None and not framing)
            for name in ("framing", "room", "head", "taken"):
                ctx.set(getattr(dut, name), inputs[name])
            ctx.set(dut.notes_strobe, inputs["read_notes"])
            # The strobe alone, and a value without its strobe, release nothing.
            strobe = bool(inputs["release"]) or rng.random() < 0.1
            ctx.set(dut.release_strobe, strobe)
            for name in ("hold", "reset", "override"):
                ctx.set(getattr(dut, f"release_{name}"), name in inputs["release"]
                        or (not strobe and rng.random() < 0.5))
            await settle(ctx)
            assert outputs(ctx, dut) == told(shadow)
            feeds.add(shadow.feed)
            entry, flush = shadow.clock(**inputs)
            assert ctx.get(dut.push) == (entry is not None)
            assert ctx.get(dut.flush) == flush
            if entry is not None:
                assert ctx.get(dut.entry) == entry
            seen.update(outputs(ctx, dut)[:2], [entry if entry is None or entry > 255 else "byte"])
            await ctx.tick()

    simulate(dut, bench)
    assert {True, False, None, "byte", model.FRAMING, model.OVERRUN, model.RESET_MARK} <= seen
    assert {100, 101, 99, 110, 90} <= feeds


@pytest.mark.parametrize(("press", "times", "feed"), [
    (0x91, 30, 200), (0x92, 30, 10), (0x93, 7, 107), (0x94, 7, 93), (0x93, 300, 200),
    (0x94, 300, 10),
])
def test_an_override_counts_every_press_up_to_its_bound(simulate, press, times, feed):
    dut = LinkDecoder()

    async def bench(ctx):
        ctx.set(dut.data, press)
        for _ in range(times):
            ctx.set(dut.done, 1)
            await ctx.tick()
            ctx.set(dut.done, 0)
            await ctx.tick()
        assert (ctx.get(dut.override_feed), ctx.get(dut.override_rapid)) == (feed, 100)

    simulate(dut, bench)


class Line:
    """A whole link, its line driven level by level."""

    def __init__(self):
        self.dut = Uart(divisor=DIVISOR)
        self.clock = 0

    async def levels(self, ctx, levels):
        for level in levels:
            ctx.set(self.dut.rx, level)
            await ctx.tick()
            self.clock += 1

    async def send(self, ctx, data, *, broken=()):
        """Bytes back to back; those at the places ``broken`` have no stop bit."""
        for at, byte in enumerate(data):
            levels = line_model.levels([byte], DIVISOR)
            if at in broken:
                levels[-DIVISOR:] = [0] * DIVISOR + [1] * DIVISOR
            await self.levels(ctx, levels)

    async def take(self, ctx):
        """Everything in the queue."""
        found = []
        await self.levels(ctx, [1] * 4)
        ctx.set(self.dut.receive_strobe, 1)
        await settle(ctx)
        while ctx.get(self.dut.receive_valid):
            found.append(ctx.get(self.dut.receive_mark) << 8 | ctx.get(self.dut.receive_data))
            await ctx.tick()
        ctx.set(self.dut.receive_strobe, 0)
        return found

    async def strobe(self, ctx, name):
        ctx.set(getattr(self.dut, name), 1)
        await ctx.tick()
        ctx.set(getattr(self.dut, name), 0)


def test_streams_come_out_as_the_model_says(simulate, rng):
    """Random bytes, some without a stop bit, in bursts that overrun the queue now and then."""
    line, shadow = Line(), model.Receiver()
    found = set()

    async def bench(ctx):
        for burst, resets in ((3, 0), (360, 0), (200, 2), (40, 1), (3, 2), (360, 0), (1, 1)):
            for _ in range(burst):
                byte = rng.choice((rng.randrange(0x19, 256), rng.randrange(0x18), 0x0A,
                                   rng.choice(REALTIME[1:])))
                if rng.random() < resets / burst:
                    byte = model.RESET
                framing = rng.random() < 0.05
                await line.send(ctx, [byte], broken=(0,) if framing else ())
                shadow.byte(None if framing else byte, framing=framing)
            expected = []
            while (entry := shadow.take()) is not None:
                expected.append(entry)
            assert await line.take(ctx) == expected
            await settle(ctx)
            assert outputs(ctx, line.dut) == told(shadow.decoder)
            found.update(expected)
            if rng.random() < 0.5:
                await line.strobe(ctx, "notes_strobe")
                shadow.read_notes()

    simulate(line.dut, bench, deadline=1e-2)
    assert {model.FRAMING, model.OVERRUN, model.RESET_MARK} <= found
    assert not found & {*REALTIME, model.DOOR, *model.NOTHING, *model.OVERRIDES}


def conversations():
    """Every kind of frame and line that a host sends, each as one piece."""
    _, tape = zip(*frames(b"\x02\x10\x18!?~\xa0A\n"), strict=True)
    return [*tape, frame(0xFE, 9), b"G00 X1 (A)\r\n", b"$X\n", numbered(0, "X-.5"),
            numbered(65535, "$RESUME"), b"\x80\xc3(", b"\x02", b"\x10"]


def test_the_model_for_firmware_on_a_computer_is_the_same(rng):
    """What ``hal_host_link.c`` gives the firmware, entry by entry."""
    library, shadow = firmware.library(), model.Receiver()
    library.gk_boot(2_000_000, 10_000, 2)
    library.gk_queue(shadow.depth)
    names = {1: "status", 2: "hold", 4: "resume", 8: "retract", 16: "stop", 32: "cancel"}
    held = found = 0
    for _ in range(20_000):
        kind = rng.random()
        if kind < 0.5:
            for byte in rng.choices((*REALTIME[1:], *range(256)), k=rng.choice((1, 1, 1, 40))):
                library.gk_send(bytes([byte]), 1)
                shadow.byte(byte)
        elif kind < 0.55:
            library.gk_send_broken()
            shadow.byte(framing=True)
        elif kind < 0.95:
            entry = shadow.take()
            assert library.hal_receive() == (-1 if entry is None else entry)
            found += entry is not None
        elif kind < 0.97:
            notes = library.hal_notes()
            assert {name for bit, name in names.items() if notes & bit} == shadow.read_notes()
        else:
            what = rng.choice(("hold", "reset", "override"))
            getattr(library, f"hal_release_{what}")()
            shadow.decoder.clock(release=(what,))
        assert library.gk_override() == shadow.decoder.feed << 8 | shadow.decoder.rapid
        stopped = shadow.decoder.hold or shadow.decoder.reset
        assert bool(library.gk_flags() >> 5 & 1) == stopped
        held += stopped
    assert 1000 < held < 19_900
    assert found > 1000


@pytest.mark.parametrize("name", ["hold", "reset"])
def test_stops_after_every_prefix(simulate, name):
    """`!` and Ctrl-X act 2 clocks after the stop bit's middle, after any part of any line or frame.

    The middle is ``9 * divisor + divisor // 2`` clocks after the first clock of the start bit.
    """
    byte = {"hold": model.HOLD, "reset": model.RESET}[name]
    line, tried = Line(), 0
    middle = 9 * DIVISOR + DIVISOR // 2

    async def bench(ctx):
        nonlocal tried
        for piece in conversations():
            for length in range(len(piece) + 1):
                await line.send(ctx, piece[:length])
                await line.levels(ctx, line_model.levels([byte], DIVISOR)[:middle])
                await line.levels(ctx, [1])  # the middle
                assert not ctx.get(getattr(line.dut, name))
                await line.levels(ctx, [1])
                assert ctx.get(getattr(line.dut, name)), (piece, length)
                # Firmware does its part.
                found = await line.take(ctx)
                assert found == ([model.RESET_MARK] if name == "reset" else list(piece[:length]))
                await line.strobe(ctx, "notes_strobe")
                ctx.set(getattr(line.dut, f"release_{name}"), 1)
                await line.strobe(ctx, "release_strobe")
                await settle(ctx)
                assert not ctx.get(getattr(line.dut, name))
                tried += 1

    simulate(line.dut, bench, deadline=1e-2)
    assert tried == sum(len(piece) + 1 for piece in conversations())


@pytest.mark.parametrize("name", ["hold", "reset"])
def test_a_release_is_not_meant_for_what_came_since(simulate, name):
    """A second `!` or Ctrl-X between firmware's look and its release stays in force."""
    byte = {"hold": model.HOLD, "reset": model.RESET}[name]
    line = Line()

    async def bench(ctx):
        ctx.set(getattr(line.dut, f"release_{name}"), 1)
        for again in (False, True, False):
            await line.send(ctx, [byte])
            await line.take(ctx)
            await line.strobe(ctx, "notes_strobe")
            if again:
                await line.send(ctx, [byte])
            await line.strobe(ctx, "release_strobe")
            await settle(ctx)
            assert ctx.get(getattr(line.dut, name)) == again

    simulate(line.dut, bench)
