# SPDX-License-Identifier: Apache-2.0
"""Counts the axis pulses of a distributor."""

__all__ = ["Steps"]


class Steps:
    """A distributor, and the places of its axes by its pulses Pi."""

    def __init__(self, dut):
        self.dut = dut
        self.position = [0] * dut.axes

    async def clock(self, ctx):
        await ctx.tick()
        for axis in range(self.dut.axes):
            if ctx.get(self.dut.pi[axis]):
                self.position[axis] += -1 if ctx.get(self.dut.pi_reverse[axis]) else 1

    def set_segment(self, ctx, length, travel):
        """Give it the words of a segment: path pulses, and steps of each axis."""
        ctx.set(self.dut.length, length)
        for port, value in zip(self.dut.travel, travel, strict=True):
            ctx.set(port.magnitude, abs(value))
            ctx.set(port.negative, value < 0)
