# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.lib.shift_output``: every clock of a frame, and what arrives."""

import pytest

from rtl.lib.shift_output import ShiftOutput
from testbench.models.shift_output import ShiftRegisters, frame
from testbench.refusal import refuses
from testbench.simulators.benches import settle


@pytest.mark.parametrize(("width", "half"), [(1, 1), (2, 3), (8, 1), (19, 2)])
def test_frames_follow_the_model_and_arrive(simulate, rng, width, half):
    dut, chain = ShiftOutput(width=width, half=half), ShiftRegisters(width)
    words = [0, (1 << width) - 1, 1, 1 << width - 1]
    words += [rng.randrange(1 << width) for _ in range(20)]

    async def bench(ctx):
        for word in words:
            ctx.set(dut.data, word)
            await settle(ctx)
            assert ctx.get(dut.take)
            await ctx.tick()
            levels = frame(word, width=width, half=half)
            for clock, (serial, shift, latch) in enumerate(levels):
                assert ctx.get(dut.take) == (clock == len(levels) - 1)
                if clock == len(levels) - 1:
                    break  # the clock that takes the next word
                ctx.set(dut.data, rng.randrange(1 << width))
                await settle(ctx)
                seen = [ctx.get(wire) for wire in (dut.serial, dut.clock, dut.latch)]
                assert seen[1:] == [shift, latch]
                assert serial is None or seen[0] == serial
                chain.see(*seen)
                await ctx.tick()
            assert chain.outputs == word

    simulate(dut, bench)


@pytest.mark.parametrize("wrong", [dict(width=0, half=1), dict(width=1, half=0)])
def test_refuses_wrong_parameters(wrong):
    refuses(ShiftOutput, r"width and half must be at least 1", **wrong)
