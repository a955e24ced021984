# SPDX-License-Identifier: Apache-2.0
"""What benches need so that they run in every simulator."""

__all__ = ["SettleError", "Strict", "settle"]


class SettleError(RuntimeError):
    """A bench reads although a value that it has set has not settled."""

    def __init__(self, text="a value was set and has not settled: await settle(ctx) first"):
        super().__init__(text)


async def settle(ctx) -> None:
    """Let values that were set reach what depends on them, before they are read.

    Amaranth's simulator does it by itself. Under cocotb a value acts after the next await. A bench
    that reads before it has awaited gets an error in both.
    """
    await ctx.settle()


class Strict:
    """A context of Amaranth's simulator that asks for the same awaits as cocotb does."""

    def __init__(self, context):
        self.context = context
        self.pending = False

    def set(self, expr, value) -> None:
        """As Amaranth's."""
        self.context.set(expr, value)
        self.pending = True

    def get(self, expr):
        """As Amaranth's; after a ``set`` without an await, ``SettleError``."""
        if self.pending:
            raise SettleError
        return self.context.get(expr)

    def tick(self):
        """As Amaranth's, for the clock of the design."""
        self.pending = False
        return self.context.tick()

    async def settle(self) -> None:
        """What was set may be read."""
        self.pending = False
