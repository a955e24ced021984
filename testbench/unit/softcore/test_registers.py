# SPDX-License-Identifier: Apache-2.0
"""The register table is well formed, and gateware, header and reference all follow it."""

import re
from dataclasses import replace

import pytest
from amaranth.hdl import Fragment, Module, ResetInserter, Shape
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from rtl.controller import Controller
from rtl.motion.axes import Axes
from rtl.power import condition
from softcore.csr import RegisterFile, interfaces, member
from softcore.generate import OUTPUTS, c_header, reference
from softcore.registers import AXES
from softcore.regmap import BLOCKS, LINK, OWNED, SHORT_LEVEL
from softcore.tables.causes import CAUSES
from softcore.uart import Uart
from testbench.models.csr import RegisterFile as Model
from testbench.simulators.benches import settle

FIELDS = [(block, register, field) for block in BLOCKS for register in block.registers
          for field in register.fields]


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
def test_table_is_well_formed(block):
    offsets = [register.offset for register in block.registers]
    assert offsets == sorted(set(offsets)), "offsets must rise"
    for register in block.registers:
        assert register.offset % 4 == 0
        assert sum(field.bits for field in register.fields) <= 32
        for field in register.fields:
            assert not field.signed or field.bits == 32, "a narrower one reads back unsigned"
        for described in (register, *register.fields):
            assert described.doc.endswith("."), f"{described.name} is not described"


def test_blocks_do_not_overlap():
    ends = [block.base + 4 * len(block.registers) for block in BLOCKS]
    bases = [block.base for block in BLOCKS[1:]]
    assert all(end <= base for end, base in zip(ends, bases, strict=False))
    assert ends[-1] <= 4 << 10, "beyond the bus's address"


def test_short_level_after_reset_is_the_one_in_force():
    assert condition.SHORT_LEVEL == SHORT_LEVEL


@pytest.mark.parametrize("path", OUTPUTS, ids=lambda path: path.name)
def test_generated_file_is_current(path):
    assert path.read_text() == OUTPUTS[path](), "run `python -m softcore.generate`"


def test_the_link_has_what_is_behind_its_registers():
    uart, members = Uart(divisor=8), interfaces((LINK,))["link"].members
    Fragment.get(uart, None)
    for name, port in members.items():
        there = getattr(uart, name.removeprefix("status_"))
        assert there.shape() == Shape.cast(port.shape), name


@pytest.mark.parametrize("letter", AXES)
def test_every_guarded_setting_of_an_axis_is_looked_at(letter):
    block, = (block for block in OWNED if block.name == f"axis_{letter}")
    guarded = {member(register, field) for register in block.registers
               for field in register.fields if field.guarded}
    assert set(Axes.GUARDED) == guarded


def test_causes_fit_their_registers():
    owner = Controller(registers=interfaces(OWNED), clock_hz=2_000_000)
    Fragment.get(owner, None)
    assert len(owner.registers.safety.live) == len(owner.interlock.live) == len(CAUSES)


def test_a_width_is_written_once():
    """A register that the table makes wider is wider in the gateware, with no other change."""
    def wider(register):
        field = replace(register.fields[0], bits=register.fields[0].bits + 3)
        return replace(register, fields=(field,)) if register.name == "step" else register

    table = tuple(replace(block, registers=tuple(map(wider, block.registers))) for block in OWNED)
    owner = Controller(registers=interfaces(table), clock_hz=2_000_000)
    Fragment.get(owner, None)
    before = Controller(registers=interfaces(OWNED), clock_hz=2_000_000)
    Fragment.get(before, None)
    for made, bits in (before, 16), (owner, 19):
        assert len(made.registers.servo.step) == len(made.condition.words.servo_step) == bits


def test_a_register_is_changed_in_one_place():
    """C header and page follow; the gateware's width does above."""
    def renamed(register):
        field = replace(register.fields[0], bits=9, doc="Quite another.", unit="furlongs")
        return replace(register, name="pace", fields=(field,)) if register.name == "step" \
            else register

    table = [replace(block, registers=tuple(map(renamed, block.registers))) for block in BLOCKS]
    header, page = c_header(table), reference(table)
    assert "uint32_t pace;" in header
    assert re.search(r"#define SERVO_PACE_\w+_MASK 0x000001ffu", header)
    assert "SERVO_STEP" not in header
    assert "### `pace` +0x" in page
    assert "| furlongs | Quite another. |" in page


class Restarted(wiring.Component):
    """The registers, with a reset as by a supply that fails for a moment.

    Every test of the bus simulates them, so that their Verilog is compiled once.
    """

    restart: In(1)

    def __init__(self):
        super().__init__()
        self.file = RegisterFile(BLOCKS)

    def elaborate(self, platform):
        m = Module()
        m.submodules.file = ResetInserter(self.restart)(self.file)
        return m


def behind(dut, block, register, field):
    """Signal behind a field."""
    return getattr(getattr(dut.fields, block.name), member(register, field))


def test_bus_follows_the_model(simulate, rng, cases):
    design, model = Restarted(), Model(BLOCKS)
    dut = design.file
    strobes = {f"{block.name}_{register.name}":
               getattr(getattr(dut.fields, block.name), f"{register.name}_strobe")
               for block in BLOCKS for register in block.registers if register.pulse == "write"}
    addresses = sorted(model.registers) + [0x0FC, 0xFFC]

    async def access(ctx, address, word=None):
        ctx.set(dut.adr, address // 4)
        ctx.set(dut.we, word is not None)
        ctx.set(dut.dat_w, word or 0)
        ctx.set(dut.stb, 1)
        await settle(ctx)
        assert not ctx.get(dut.ack)
        await ctx.tick()
        assert ctx.get(dut.ack), "after 1 clock"
        read = ctx.get(dut.dat_r)
        seen = [name for name, strobe in strobes.items() if ctx.get(strobe)]
        await ctx.tick()
        ctx.set(dut.stb, 0)
        await settle(ctx)
        assert not any(ctx.get(strobe) for strobe in strobes.values()), "for 1 clock"
        return read, seen

    async def bench(ctx):
        inputs = {}
        for block, register, field in FIELDS:
            if field.access == "r":
                value = rng.getrandbits(field.bits)
                inputs[block.name, register.name, field.name] = value
                ctx.set(behind(dut, block, register, field), value)
        for address in addresses:
            assert (await access(ctx, address))[0] == model.read(address, inputs)
        for _ in range(cases(1500)):
            address = rng.choice(addresses)
            kind = rng.random()
            if kind < 0.1:
                block, register, field = rng.choice([r for r in FIELDS if r[2].access == "rw1c"])
                signal = behind(dut, block, register, field)
                ctx.set(signal, 1)
                await ctx.tick()
                ctx.set(signal, 0)
                model.set_bit(block.name, register.name, field.name)
            elif kind < 0.6:
                word = rng.choice((0, 0xFFFFFFFF, rng.getrandbits(32)))
                _, seen = await access(ctx, address, word)
                assert seen == model.write(address, word)
            else:
                assert (await access(ctx, address))[0] == model.read(address, inputs)
        for block, register, field in FIELDS:
            if field.access == "rw":
                await settle(ctx)
                value = ctx.get(behind(dut, block, register, field))
                assert value % (1 << field.bits) == model.values[
                    block.name, register.name, field.name]

    simulate(design, bench, deadline=1)


def test_after_a_reset_every_register_reads_as_its_initial_value(simulate):
    """The memory behind the registers keeps what was written; a register does not."""
    design, model = Restarted(), Model(BLOCKS)
    dut = design.file
    addresses = [block.base + register.offset for block in BLOCKS for register in block.registers
                 if {field.access for field in register.fields} == {"rw"}]
    assert len(addresses) > 90
    first = [model.read(address, {}) for address in addresses]
    assert any(first)
    one, *others = addresses

    async def access(ctx, address, word=None):
        ctx.set(dut.adr, address // 4)
        ctx.set(dut.we, word is not None)
        ctx.set(dut.dat_w, word or 0)
        ctx.set(dut.stb, 1)
        await ctx.tick()
        found = ctx.get(dut.dat_r)
        await ctx.tick()
        ctx.set(dut.stb, 0)
        return found

    async def bench(ctx):
        for word in (0xFFFFFFFF, 0x55555555):
            assert [await access(ctx, address) for address in addresses] == first
            # One that is read from the memory has no effect on those that are not.
            await access(ctx, one, word)
            model.write(one, word)
            assert await access(ctx, one) == model.read(one, {})
            assert [await access(ctx, address) for address in others] == first[1:]
            for address in addresses:
                await access(ctx, address, word)
                model.write(address, word)
            for address in addresses:
                assert await access(ctx, address) == model.read(address, {})
            ctx.set(design.restart, 1)
            await ctx.tick()
            ctx.set(design.restart, 0)

    simulate(design, bench, deadline=1)


def test_every_bit_of_a_guarded_register_that_turns_over_is_found(simulate, rng):
    design = Restarted()
    dut = design.file
    guarded = [each for each in FIELDS if each[2].guarded]
    assert {field.access for _, _, field in guarded} == {"rw"}
    damaged = [getattr(getattr(dut.fields, block.name), f"{member(register, field)}_damaged")
               for block, register, field in guarded]

    async def bench(ctx):
        for number, (block, register, field) in enumerate(guarded):
            signal = behind(dut, block, register, field)
            for bit in range(field.bits):
                for _ in range(2):
                    assert not any(ctx.get(each) for each in damaged)
                    ctx.set(signal, ctx.get(signal) ^ (
                        -1 << bit if field.signed and bit == field.bits - 1 else 1 << bit))
                    await settle(ctx)
                    assert [ctx.get(each) for each in damaged] == [
                        at == number for at in range(len(damaged))]
                    # Written anew, with another word, it is whole.
                    ctx.set(dut.adr, (block.base + register.offset) // 4)
                    ctx.set(dut.dat_w, rng.getrandbits(32))
                    ctx.set(dut.we, 1)
                    ctx.set(dut.stb, 1)
                    await ctx.tick().repeat(2)
                    ctx.set(dut.stb, 0)
                    await settle(ctx)

    simulate(design, bench, deadline=1)


def test_a_read_that_takes_is_told_once(simulate):
    design = Restarted()
    dut = design.file
    strobe = dut.fields.link.receive_strobe

    async def bench(ctx):
        ctx.set(dut.adr, LINK.base // 4)
        ctx.set(dut.stb, 1)
        await settle(ctx)
        assert ctx.get(strobe), "in the clock in which the value is taken"
        await ctx.tick()
        assert not ctx.get(strobe)
        ctx.set(dut.we, 1)
        await ctx.tick()
        assert not ctx.get(strobe), "a write takes nothing"

    simulate(design, bench)
