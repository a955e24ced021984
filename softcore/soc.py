# SPDX-License-Identifier: Apache-2.0
"""The system on a chip: processor, memory, registers, serial link, and the controller."""

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from rtl.controller import Controller
from rtl.members import pins
from softcore.cpu import BusSignature, VexRiscv
from softcore.csr import RegisterFile, interfaces
from softcore.regmap import BLOCKS, OWNED
from softcore.sleep import ClockGate, Sleep
from softcore.uart import Uart

__all__ = ["BlockRam", "Soc"]


class BlockRam(wiring.Component):
    """Memory of the processor: instructions on one port, data on the other.

    An access takes 2 clocks, or 1 as the next of a burst of up to ``BURST`` words, which the
    caches read from an address that is a multiple of it.

    Parameters
    ----------
    size : int
        Bytes; a multiple of 4.
    image : bytes
        What is in it at the start: the firmware, little-endian.

    Members
    -------
    ibus, dbus : In(BusSignature)
        Word accesses; only ``dbus`` writes, by bytes, and never in a burst.
    """

    BURST = 8

    def __init__(self, *, size: int, image: bytes = b""):
        if len(image) > size:
            raise ValueError(f"the firmware image has {len(image)} bytes, the memory {size}")
        self.size = size
        self.image = image
        super().__init__({"ibus": In(BusSignature()), "dbus": In(BusSignature())})

    def elaborate(self, platform):
        m = Module()

        image = self.image + bytes(-len(self.image) % 4)
        words = [int.from_bytes(image[at:at + 4], "little") for at in range(0, len(image), 4)]
        m.submodules.ram = ram = memory.Memory(shape=32, depth=self.size // 4, init=words)
        write = ram.write_port(granularity=8)
        # Transparent, and at the address of the write: or ECP5 needs a copy per read port.
        for bus in (self.ibus, self.dbus):
            read = ram.read_port(transparent_for=(write,))
            low = Signal(exact_log2(self.BURST))
            m.d.comb += [
                low.eq(bus.adr[:len(low)] + (bus.ack & bus.more)),
                read.addr.eq(Cat(low, bus.adr[len(low):])),
                read.en.eq(bus.stb),
                bus.dat_r.eq(read.data),
            ]
            m.d.sync += bus.ack.eq(bus.stb & (~bus.ack | bus.more))
        m.d.comb += [
            write.addr.eq(read.addr),
            write.data.eq(self.dbus.dat_w),
            write.en.eq(Mux(self.dbus.stb & self.dbus.we & ~self.dbus.ack, self.dbus.sel, 0)),
        ]

        return m


class Soc(wiring.Component):
    """Everything but the pads.

    Memory is at address 0, the registers at ``regmap.BASE``. The members beside ``rx`` and ``tx``
    are the controller's pins, see ``rtl.members.pins``.

    Parameters
    ----------
    clock_hz : int
        Frequency of ``sync``.
    link_divisor : int
        Clocks per bit of the serial link.
    memory_size : int
        Bytes of memory.
    image : bytes
        Firmware.
    build : int
        Digest of the sources, for the register ``build``.
    options : dict
        Parameters of ``rtl.controller.Controller``.

    Members
    -------
    hold : In(1)
        The processor is in reset.
    rx : In(1)
        Serial input, idle high.
    tx : Out(1)
        Serial output, idle high.
    """

    def __init__(self, *, clock_hz: int, link_divisor: int, memory_size: int = 286720,
                 image: bytes = b"", build: int = 0, **options):
        self.clock_hz = clock_hz
        self.build = build
        self.cpu = VexRiscv()
        self.memory = BlockRam(size=memory_size, image=image)
        self.registers = RegisterFile(BLOCKS)
        self.uart = Uart(divisor=link_divisor)
        self.controller = Controller(registers=interfaces(OWNED), clock_hz=clock_hz, **options)
        super().__init__({"hold": In(1), "rx": In(1, init=1), "tx": Out(1, init=1)} | pins())

    def elaborate(self, platform):
        m = Module()
        # The processor and its memory have a clock that stops while firmware sleeps.
        m.domains.processor = ClockDomain(local=True)
        asleep = DomainRenamer("processor")
        m.submodules.gate = gate = ClockGate()
        m.submodules.sleep = sleep = Sleep()
        m.submodules.cpu = asleep(self.cpu)
        m.submodules.memory = asleep(self.memory)
        cpu, ram = self.cpu, self.memory
        m.submodules.registers = registers = self.registers
        system = registers.fields.system
        m.submodules.controller = controller = self.controller
        news = controller.registers.event.head_valid
        m.submodules.uart = uart = self.uart

        wiring.connect(m, cpu.ibus, ram.ibus)
        peripheral = cpu.dbus.adr[29]  # regmap.BASE is the upper half of the address space
        m.d.comb += [
            ram.dbus.adr.eq(cpu.dbus.adr), ram.dbus.dat_w.eq(cpu.dbus.dat_w),
            ram.dbus.sel.eq(cpu.dbus.sel), ram.dbus.we.eq(cpu.dbus.we),
            ram.dbus.stb.eq(cpu.dbus.stb & ~peripheral), ram.dbus.more.eq(cpu.dbus.more),
            registers.adr.eq(cpu.dbus.adr), registers.dat_w.eq(cpu.dbus.dat_w),
            registers.we.eq(cpu.dbus.we),
            registers.stb.eq(cpu.dbus.stb & peripheral & sleep.running),
            cpu.dbus.ack.eq(ram.dbus.ack | registers.ack),
            cpu.dbus.dat_r.eq(Mux(peripheral, registers.dat_r, ram.dbus.dat_r)),
            cpu.interrupt.eq(news),
        ]

        reset = Signal()
        m.d.comb += [
            reset.eq(ResetSignal(allow_reset_less=True) | self.hold),
            gate.clock.eq(ClockSignal()), gate.enable.eq(sleep.running),
            ClockSignal("processor").eq(gate.gated), ResetSignal("processor").eq(reset),
            sleep.strobe.eq(system.sleep_strobe),
            sleep.clocks.eq(system.sleep),
            sleep.wake.eq(news | uart.receive_valid | uart.noted | reset),
            sleep.ack.eq(registers.ack),
        ]

        cycle = Signal(64)
        m.d.sync += cycle.eq(cycle + 1)
        with m.If(system.cycle_low_strobe):
            m.d.sync += system.cycle_high.eq(cycle[32:])
        m.d.comb += [
            controller.cycle.eq(cycle),
            system.ident.eq(int.from_bytes(b"GAPK", "little")),
            system.build.eq(self.build),
            system.clock_hz.eq(self.clock_hz),
            system.pulses_per_mm.eq(controller.pulses_per_mm),
            system.shape_axes.eq(controller.axes),
            system.shape_slots.eq(controller.slots),
            system.shape_jump_axis.eq(controller.jump_axis),
            system.cycle_low.eq(cycle[:32]),
        ]

        for block in OWNED:
            wiring.connect(m, getattr(registers.fields, block.name),
                           getattr(controller.registers, block.name))
        link = registers.fields.link
        for name, port in link.signature.members.items():
            outer, inner = getattr(link, name), getattr(uart, name.removeprefix("status_"))
            m.d.comb += inner.eq(outer) if port.flow is Out else outer.eq(inner)

        m.d.comb += [uart.rx.eq(self.rx), self.tx.eq(uart.tx),
                     controller.hold.eq(uart.hold), controller.abort.eq(uart.reset)]
        for name, port in pins().items():
            outer, inner = getattr(self, name), getattr(controller, name)
            m.d.comb += inner.eq(outer) if port.flow is In else outer.eq(inner)

        return m
