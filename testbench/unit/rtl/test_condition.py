# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.power.condition``: all words come into force in one clock, or none."""

from rtl.power.condition import SHORT_LEVEL, WORDS, Condition
from softcore.csr import interfaces
from softcore.regmap import BLOCKS
from testbench.models.condition_switch import ConditionSwitch
from testbench.simulators.benches import settle

LATCH, SETTLE = 5, 17     # clocks
SUPPLY, LEVELS = "power_supply", "gap_reference"     # words that something outside follows
STAYS = (), (SUPPLY,), (LEVELS,), (SUPPLY, LEVELS)   # what a staged condition does not change
ORDERS = ("commit", "disarm", "restart")


def test_all_words_come_into_force_at_once(simulate, rng):
    """Words are staged, ordered and switched at depths at random; the model says when.

    A switch waits until the outside follows the one before it.
    """
    dut = Condition(registers=interfaces(BLOCKS), latch=LATCH, settle=SETTLE)
    model = ConditionSwitch()
    taken = set()     # why words were taken
    waits = []        # clocks of each wait for the outside, and what it was for

    async def bench(ctx):
        position = depth = before = 0   # the last: switches by depth when words were last taken
        left = max(LATCH, SETTLE)       # clocks until the outside follows; nothing is known of it
        force = {name: SHORT_LEVEL if name == "gap_reference_short" else 0 for name in WORDS}
        for _ in range(3000):
            staged = {name: rng.getrandbits(len(getattr(dut.staged, name))) for name in WORDS}
            orders = {name: rng.random() < 0.03 for name in ORDERS}
            strobe = rng.random() < 0.8     # orders without it are none
            given = {name: order and strobe for name, order in orders.items()}
            arm = not any(given.values()) and rng.random() < 0.05
            if arm:
                depth = position + rng.randrange(-2, 12)
            position += rng.choice((-1, 0, 1, 1))
            between = rng.random() < 0.3
            whole = left == 0
            stays = rng.choice(STAYS)   # else both would change at every switch
            staged |= {name: word for name, word in force.items() if name.startswith(stays)}
            for name, word in staged.items():
                ctx.set(getattr(dut.staged, name), word)
            for name, order in orders.items():
                ctx.set(getattr(dut.registers, f"order_{name}"), order)
            for signal, value in ((dut.registers.order_strobe, strobe), (dut.position, position),
                                  (dut.registers.depth, depth), (dut.between, between),
                                  (dut.registers.depth_strobe, arm)):
                ctx.set(signal, value)
            await settle(ctx)
            assert {name: ctx.get(getattr(dut.words, name)) for name in WORDS} == force
            free = between and whole
            take, armed, pending, switched, at, count = model.outputs(between=free)
            registers = dut.registers
            assert [ctx.get(signal) for signal in (
                registers.status_armed, registers.status_pending, registers.status_count,
                dut.switched, dut.at, dut.count)] == [armed, pending, count, switched, at, count]
            assert ctx.get(dut.latched) & ctx.get(dut.settled) == whole
            left = max(0, left - 1)
            if take:
                changed = {name for name in WORDS if staged[name] != force[name]}
                left = max(LATCH * any(name.startswith(SUPPLY) for name in changed),
                           SETTLE * any(name.startswith(LEVELS) for name in changed))
                waits.append(left)
                force = staged
                taken.add("depth" if count > before else "commit")
                before = count
            model.edge(position=position, depth=depth, arm=arm, between=free, **given)
            await ctx.tick()

    simulate(dut, bench)
    assert taken == {"depth", "commit"}
    assert set(waits) == {0, LATCH, SETTLE}
