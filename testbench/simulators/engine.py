# SPDX-License-Identifier: Apache-2.0
"""Amaranth's benches on a design that runs under cocotb.

Contexts, triggers and expressions are Amaranth's own, over an engine whose signals are cocotb's
handles. The clock is cocotb's. Benches run at its falling edges, half a clock from every race.
"""

from collections.abc import Callable, Coroutine, Sequence
from typing import Any

from amaranth.hdl import Const, ShapeCastable, Signal, Value
from amaranth.hdl._ast import SignalDict
from amaranth.sim._async import EdgeTrigger, SampleTrigger, TestbenchContext
from amaranth.sim._pyeval import eval_assign, eval_value
from cocotb.clock import Clock
from cocotb.triggers import ReadWrite, Timer

from testbench.simulators.benches import SettleError
from testbench.simulators.emitted import PERIOD_NS, Emitted

__all__ = ["Engine"]

DEPOSIT = 0   # what a write is to the simulator: seen after the next await
INTEGER = 32  # widest value that the simulator passes as an integer


class Loose:
    """A signal that is no part of the design: it keeps what a bench sets."""

    is_comb = False

    def __init__(self, init: int):
        self.curr = self.next = init

    def update(self, value: int) -> None:
        self.curr = self.next = value


class Slot:
    """A signal of the design, as Amaranth's evaluation of expressions wants it.

    cocotb's ``value`` makes an object of every value that is read or written, at 2.8 and 2.3 us.
    The handle below it takes 0.1 us, or 0.4 us for more than 32 bits.
    """

    def __init__(self, engine, handle, signal: Signal, *, is_input: bool, settable: bool):
        self.engine = engine
        self.handle = handle._handle
        self.width = len(signal)
        self.mask = (1 << self.width) - 1
        self.sign = 1 << (self.width - 1) if signal.shape().signed else 0
        self.is_input = is_input
        self.is_comb = not settable
        self.written = None

    @property
    def curr(self) -> int:
        if self.width <= INTEGER:
            value = self.handle.get_signal_val_long() & self.mask
        else:
            value = int(self.handle.get_signal_val_binstr(), 2)
        return value - 2 * self.sign if value & self.sign else value

    @property
    def next(self) -> int:
        return self.curr if self.written is None else self.written

    def update(self, value: int) -> None:
        if self.is_input and value == self.written:
            return
        self.written = value
        self.engine.written.append(self)
        value &= self.mask
        if self.width <= INTEGER:
            if value >> INTEGER - 1:
                value -= 1 << INTEGER
            self.handle.set_signal_val_int(DEPOSIT, value)
        else:
            self.handle.set_signal_val_binstr(DEPOSIT, f"{value:0{self.width}b}")


class Row:
    """A row of a memory. ``index`` counts from 0."""

    def __init__(self, engine, handle, memory):
        self.engine = engine
        self.rows = handle
        self.memory = memory
        self.slots: dict[int, Slot] = {}

    def _slot(self, index):
        if index not in self.slots:
            signal = Signal(len(Value.cast(self.memory[index])))
            self.slots[index] = Slot(self.engine, self.rows[index], signal, is_input=False,
                                     settable=True)
        return self.slots[index]

    def read(self, index: int) -> int:
        return self._slot(index).curr

    def write(self, index: int, value: int, mask: int) -> None:
        slot = self._slot(index)
        slot.update(slot.next & ~mask | value & mask)


class Settle:
    """What a bench awaits to see the consequences of the values that it has set."""

    def __await__(self):
        yield self


class Waiting:
    """A bench that waits for the clock, with what it wants to know of the values before it."""

    def __init__(self, engine, combination):
        self.engine = engine
        self.combination = combination
        self.result: tuple = ()
        for trigger in combination._triggers:
            if isinstance(trigger, SampleTrigger):
                continue
            if (isinstance(trigger, EdgeTrigger) and trigger.signal is engine.domain.clk
                    and trigger.polarity == 1):
                continue
            raise NotImplementedError(f"under cocotb a bench waits for the clock, not {trigger!r}")

    def take(self) -> None:
        """Sample values just before the edge."""
        values = []
        for trigger in self.combination._triggers:
            if isinstance(trigger, SampleTrigger):
                if isinstance(trigger.value, Const):
                    value = trigger.value.value
                elif trigger.value is self.engine.domain.rst:
                    value = self.engine.slots[self.engine.get_signal(trigger.value)].next
                else:
                    value = self.engine.get_value(trigger.value)
                shape = trigger.shape
                values.append(shape.from_bits(value) if isinstance(shape, ShapeCastable) else value)
            else:
                values.append(True)
        self.result = tuple(values)

    @property
    def samples(self) -> bool:
        """Whether it looks at anything but the clock and the reset."""
        return any(isinstance(trigger, SampleTrigger) and not isinstance(trigger.value, Const)
                   and trigger.value is not self.engine.domain.rst
                   for trigger in self.combination._triggers)

    def __await__(self):
        self.engine.waiting.append(self)
        yield self
        return self.result


class Context(TestbenchContext):
    """Amaranth's context of a testbench, with the settling that cocotb needs."""

    def settle(self) -> Settle:
        """Await this to let values that were set reach what depends on them."""
        return Settle()


class Process:
    """A bench that runs."""

    def __init__(self, engine, bench):
        self.context = Context(engine.design, engine, self)
        self.coroutine: Coroutine = bench(self.context)
        self.critical = True
        self.runnable = True
        self.result: Any = None

    def run(self):
        """Run to the next wait, and return what it waits for; None at the end."""
        try:
            return self.coroutine.send(None)
        except StopIteration as end:
            self.critical = False
            self.result = end.value
            return None


class Engine:
    """Benches on the design below a handle of cocotb's, in their order.

    ``stopped()`` tells how many assertions of the design have failed.
    """

    def __init__(self, emitted: Emitted, top, stopped: Callable[[], int]):
        self.stopped = stopped
        self.emitted = emitted
        self.design = emitted.design
        self.domain = emitted.domain
        self.top = top
        self.state = self
        self.slots: dict[int, Any] = {}
        self._numbers = SignalDict()
        self._memories: dict[Any, int] = {}
        self.written: list[Slot] = []
        self.pending = False
        self.waiting: list[Waiting] = []

    # ---- values, as Amaranth's evaluation of expressions asks for them

    def _handle(self, path: Sequence[str]):
        handle = self.top
        for name in path:
            try:
                handle = handle[name]
            except KeyError:
                handle = handle[f"\\{name} "]   # an escaped identifier
        return handle

    def get_signal(self, signal: Signal) -> int:
        """Number of a signal's slot."""
        if signal not in self._numbers:
            number = self._numbers[signal] = len(self.slots)
            self.slots[number] = self._slot(signal)
        return self._numbers[signal]

    def _slot(self, signal):
        place = self.emitted.places.get(signal)
        if place is not None:
            return Slot(self, self._handle(place.path), signal, is_input=place.input,
                        settable=place.settable)
        if signal in self.design.signal_lca and len(signal):
            raise LookupError(f"{signal!r} cannot be found in the Verilog: give it a name")
        return Loose(signal.init)

    def get_memory(self, memory) -> int:
        """Number of a memory's slot."""
        if memory not in self._memories:
            number = self._memories[memory] = len(self.slots)
            self.slots[number] = Row(self, self._handle(self.emitted.memories[memory]), memory)
        return self._memories[memory]

    def get_value(self, expr) -> int:
        """Value of an expression.

        Raises
        ------
        SettleError
            If something was set since the last await.
        """
        if self.pending:
            raise SettleError
        return eval_value(self, Value.cast(expr))

    def set_value(self, expr, value: int) -> None:
        """Set an input or a register; others see it after the next await."""
        self.pending = True
        eval_assign(self, Value.cast(expr), value)

    def step_design(self) -> None:
        """Nothing: the simulator runs between awaits."""

    def add_trigger_combination(self, combination, *, oneshot: bool) -> Waiting:
        """What a bench awaits."""
        return Waiting(self, combination)

    # ---- time

    async def _settle(self) -> None:
        written = bool(self.written)
        self._applied()
        if written:   # else no such phase would come in this time step
            await ReadWrite()

    def _applied(self):
        """A register keeps what was set until the edge only, an input until it is set again."""
        for slot in self.written:
            if not slot.is_input:
                slot.written = None
        self.written.clear()
        self.pending = False

    def _begin(self):
        """Give every input its initial value: Verilog's ports have none."""
        for signal, place in self.emitted.places.items():
            if place.input and signal.init:
                self.slots[self.get_signal(signal)].update(signal.init)
                self.pending = True

    async def _run_benches(self, processes: Sequence[Process]) -> None:
        for process in processes:
            if process.runnable:
                process.runnable = False
                await self._settle()
                while isinstance(process.run(), Settle):
                    await self._settle()

    def _check(self):
        if self.stopped():
            raise AssertionError("an assertion of the design has failed; log.txt has its line")

    async def run(self, benches: Sequence[Callable], *, deadline: float) -> list:
        """Run benches until each has returned; return what they returned.

        Raises
        ------
        AssertionError
            If an assertion of the design fails.
        TimeoutError
            If a bench still waits after ``deadline`` seconds of simulated time.
        """
        if self.domain.clk in self.emitted.places:   # else the design is combinational
            Clock(self._handle(self.emitted.places[self.domain.clk].path), PERIOD_NS, unit="ns",
                  impl="gpi").start(start_high=False)
        self._begin()
        await ReadWrite()
        self._applied()
        processes = [Process(self, bench) for bench in benches]
        by_context = {id(process): process for process in processes}
        clock = Timer(PERIOD_NS, unit="ns")
        clocks = 0
        while True:
            await self._run_benches(processes)
            self._check()
            if not any(process.critical for process in processes):
                return [process.result for process in processes]
            if clocks * PERIOD_NS >= deadline * 1e9:
                raise TimeoutError(f"testbench still waiting after {deadline} s")
            if any(waiting.samples for waiting in self.waiting):
                await self._settle()
            for waiting in self.waiting:
                waiting.take()
            self._applied()
            await clock
            clocks += 1
            self._check()
            ready, self.waiting = self.waiting, []
            for waiting in ready:
                by_context[id(waiting.combination._process)].runnable = True
