# SPDX-License-Identifier: Apache-2.0
"""On-times from the ignition: pulse generator and discriminator joined, behind the pads' delay."""

from itertools import pairwise

import pytest
from amaranth import Cat, ClockDomain, Module, Signal

from rtl.gap.discriminator import Discriminator
from rtl.power.pulse_generator import PulseGenerator
from testbench.models import discriminator as classes
from testbench.native.from_ignition import BACK, OUT
from testbench.simulators.benches import settle

PAUSE = 6
PULSES = 2000


class Joined:
    """The two blocks as the controller joins them, with the pads' delay on either side."""

    def __init__(self, *, by_current, blanking):
        self.top = top = Module()
        top.domains.sync = ClockDomain()
        top.submodules.pulses = self.pulses = pulses = PulseGenerator()
        top.submodules.discriminator = self.discriminator = judge = Discriminator()
        self.pin = Signal()                     # the gate at its pin
        # The comparators at theirs.
        self.high, self.current = Signal(name="high"), Signal(name="current")
        seen = [Signal(2, name=f"seen_{n}") for n in range(BACK)]
        top.d.sync += [self.pin.eq(pulses.on), seen[0].eq(Cat(self.high, self.current))]
        top.d.sync += [after.eq(before) for before, after in pairwise(seen)]
        top.d.comb += [
            pulses.enable.eq(1), pulses.off_time.eq(PAUSE), pulses.ignited.eq(judge.ignited),
            judge.on.eq(self.pin), judge.from_ignition.eq(1), judge.use_current.eq(by_current),
            judge.blanking.eq(blanking), Cat(judge.high, judge.current).eq(seen[-1]),
        ]


def expected(*, on_time, wait, delay, blanking, by_current):
    """Return the length of a pulse at its pin, and its class.

    The gap ignites ``delay`` clocks after the pin has risen. The voltage takes a clock to rise: an
    ignition in the first clock shows only in that it is low at the blanking's end.
    """
    seen = BACK + delay     # clocks of the pulse, as the discriminator gets them, before it shows
    if not by_current and delay < 1:
        seen = max(blanking, BACK)
    # The generator's clocks are one ahead of the pin's.
    generator = seen + OUT
    if generator < wait:
        return generator + on_time, classes.OK
    # The discriminator still sees the pulse's last clock when the gate has fallen.
    return wait, classes.OK if generator == wait else classes.OPEN


@pytest.mark.parametrize("by_current", [0, 1], ids=["voltage", "current"])
def test_every_pulse_burns_for_the_same_time(simulate, rng, by_current):
    """Random delays, on-times, waits and blankings; each length and class exact to the clock.

    A million of them: ``test_from_ignition_many.py``.
    """
    blanking = rng.randrange(5, 9)
    joined = Joined(by_current=by_current, blanking=blanking)
    dut, judge = joined.pulses, joined.discriminator
    kinds = {kind: 0 for kind in range(4)}

    async def bench(ctx):
        burnt = 0
        for _ in range(PULSES):
            on_time, wait = rng.randrange(1, 12), rng.randrange(blanking + 1, 24)
            delay = rng.choice((0, 1, 2, rng.randrange(22), rng.randrange(22)))
            ctx.set(dut.on_time, on_time)
            ctx.set(dut.wait_time, wait)
            await settle(ctx)
            while not ctx.get(joined.pin):
                await ctx.tick()
            length = 0
            ctx.set(joined.high, 1)
            while length == 0 or ctx.get(joined.pin):
                if length == delay:
                    ctx.set(joined.high, 0)
                    ctx.set(joined.current, 1)
                length += 1
                await ctx.tick()
            ctx.set(joined.high, 0)
            ctx.set(joined.current, 0)
            await settle(ctx)
            assert ctx.get(judge.sample)
            want = expected(on_time=on_time, wait=wait, delay=delay, blanking=blanking,
                            by_current=by_current)
            assert (length, ctx.get(judge.kind).value) == want, (on_time, wait, delay)
            kinds[want[1]] += 1
            if want[0] != wait and (delay or by_current):
                burnt += 1
                assert length - delay == on_time + OUT + BACK, "whatever the delay"
        assert burnt > PULSES // 3

    simulate(joined.top, bench, deadline=10)
    assert kinds[classes.OPEN] > PULSES // 20
    assert kinds[classes.OK] > PULSES // 3
