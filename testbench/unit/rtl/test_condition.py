# SPDX-License-Identifier: Apache-2.0
"""Unit tests of ``rtl.power.condition``: all words come into force in one clock, or none."""

from rtl.power.condition import SHORT_LEVEL, WORDS, Condition
from softcore.csr import interfaces
from softcore.regmap import BLOCKS
from testbench.models.condition_switch import ConditionSwitch
from testbench.simulators.benches import settle

ORDERS = ("commit", "disarm", "restart")


def test_all_words_come_into_force_at_once(simulate, rng):
    """Words are staged, ordered and switched at depths at random; the model says when."""
    dut, model = Condition(registers=interfaces(BLOCKS)), ConditionSwitch()
    taken = set()     # why words were taken

    async def bench(ctx):
        position = depth = before = 0   # the last: switches by depth when words were last taken
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
            take, armed, pending, switched, at, count = model.outputs(between=between)
            registers = dut.registers
            assert [ctx.get(signal) for signal in (
                registers.status_armed, registers.status_pending, registers.status_count,
                dut.switched, dut.at, dut.count)] == [armed, pending, count, switched, at, count]
            if take:
                force = staged
                taken.add("depth" if count > before else "commit")
                before = count
            model.edge(position=position, depth=depth, arm=arm, between=between, **given)
            await ctx.tick()

    simulate(dut, bench)
    assert taken == {"depth", "commit"}
