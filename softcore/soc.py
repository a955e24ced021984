# SPDX-License-Identifier: Apache-2.0
"""The system on a chip: processor, memory, registers, serial link, and the controller."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from constraints.board import Journal
from rtl.controller import Controller
from rtl.members import pins
from softcore.cpu import VexRiscv
from softcore.csr import RegisterFile, interfaces
from softcore.flash import SECTOR, FlashPort
from softcore.memory import BlockRam
from softcore.notice import FaultNotice
from softcore.regmap import BLOCKS, OWNED
from softcore.sleep import ClockGate, Sleep
from softcore.uart import Uart

__all__ = ["MEMORY_SIZE", "Soc"]

MEMORY_SIZE = 311_296  # bytes, unless a board or a simulation sets another size


class Soc(wiring.Component):
    """Everything except the pads.

    Memory is at address 0, the registers at ``regmap.BASE``. The members other than ``rx`` and
    ``tx`` are the controller's pins, see ``rtl.members.pins``.

    If a word of the memory reads wrong, the outputs are safe in the next clock. From then until
    reset no access of the processor is taken or answered, so that the wrong word has no effect.
    ``FaultNotice`` then uses the serial line. The same happens if the watchdog has made the outputs
    safe and gets no call for one more period.

    Parameters
    ----------
    clock_hz : int
        Frequency of ``sync``.
    link_divisor : int
        Clocks per bit of the serial link.
    memory_size : int
        Bytes of memory.
    memory_banks : bool
        The memory is in banks, which saves block RAMs.
    image : bytes
        Firmware.
    journal : Journal or None
        Region of the flash memory for the journal and the firmware slots.
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
    flash_select, flash_clock, flash_command : Out(1), flash_data : In(1)
        The flash memory, see ``softcore.flash``.

    Raises
    ------
    ValueError
        If the journal does not consist of whole sectors, 2 to 255, or a firmware slot of at most
        255.
    """

    def __init__(self, *, clock_hz: int, link_divisor: int, memory_size: int = MEMORY_SIZE,
                 memory_banks: bool = False, image: bytes = b"", build: int = 0,
                 journal: Journal | None = None, **options):
        if journal and (journal.base % SECTOR or journal.size % SECTOR
                        or not 2 <= journal.size // SECTOR <= 255):
            raise ValueError(f"a journal has 2 to 255 whole sectors of {SECTOR} bytes, not "
                             f"{journal.size} bytes from {journal.base:#x} on")
        if journal and (journal.slot % SECTOR or journal.slot // SECTOR > 255):
            raise ValueError(f"a firmware slot has at most 255 whole sectors of {SECTOR} bytes, "
                             f"not {journal.slot} bytes")
        self.clock_hz = clock_hz
        self.build = build
        self.cpu = VexRiscv()
        self.memory = BlockRam(size=memory_size, image=image, banks=memory_banks)
        self.registers = RegisterFile(BLOCKS)
        self.uart = Uart(divisor=link_divisor)
        self.flash = FlashPort(clock_hz=clock_hz)
        self.journal = journal
        self.controller = Controller(registers=interfaces(OWNED), clock_hz=clock_hz, **options)
        super().__init__({"hold": In(1), "rx": In(1, init=1), "tx": Out(1, init=1),
                          "flash_select": Out(1), "flash_clock": Out(1), "flash_command": Out(1),
                          "flash_data": In(1)} | pins())

    def elaborate(self, platform):
        m = Module()
        # The clock of the processor and its memory stops while the firmware sleeps.
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

        m.submodules.notice = notice = FaultNotice(period=self.clock_hz)
        m.d.comb += [notice.damaged.eq(ram.damaged), notice.place.eq(ram.place),
                     notice.silent.eq(controller.silent),
                     controller.memory_damaged.eq(notice.by_damage)]
        free = ~notice.held
        peripheral = cpu.dbus.adr[29]  # regmap.BASE is the upper half of the address space
        m.d.comb += [
            ram.ibus.adr.eq(cpu.ibus.adr), ram.ibus.stb.eq(cpu.ibus.stb & free),
            ram.ibus.more.eq(cpu.ibus.more), cpu.ibus.dat_r.eq(ram.ibus.dat_r),
            cpu.ibus.ack.eq(ram.ibus.ack & free),
            ram.dbus.adr.eq(cpu.dbus.adr), ram.dbus.dat_w.eq(cpu.dbus.dat_w),
            ram.dbus.sel.eq(cpu.dbus.sel), ram.dbus.we.eq(cpu.dbus.we),
            ram.dbus.stb.eq(cpu.dbus.stb & ~peripheral & free), ram.dbus.more.eq(cpu.dbus.more),
            registers.adr.eq(cpu.dbus.adr), registers.dat_w.eq(cpu.dbus.dat_w),
            registers.we.eq(cpu.dbus.we),
            registers.stb.eq(cpu.dbus.stb & peripheral & sleep.running & free),
            cpu.dbus.ack.eq((ram.dbus.ack | registers.ack) & free),
            cpu.dbus.dat_r.eq(Mux(peripheral, registers.dat_r, ram.dbus.dat_r)),
            cpu.interrupt.eq(Cat(news, controller.registers.safety.watch_asked)),
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

        m.submodules.flash = flash = self.flash
        memory, region = registers.fields.flash, self.journal
        m.d.comb += [
            flash.start.eq(memory.send_strobe), flash.send.eq(memory.send),
            memory.status_busy.eq(flash.busy), memory.status_received.eq(flash.received),
            self.flash_select.eq(memory.select), self.flash_clock.eq(flash.clock),
            self.flash_command.eq(flash.command), flash.data.eq(self.flash_data),
            memory.region_first.eq(region.base // SECTOR if region else 0),
            memory.region_sectors.eq(region.size // SECTOR if region else 0),
            memory.region_slot.eq(region.slot // SECTOR if region else 0),
        ]

        m.d.comb += [uart.rx.eq(self.rx), self.tx.eq(uart.tx),
                     uart.taken.eq(notice.held), uart.notice_data.eq(notice.data),
                     uart.notice_valid.eq(notice.valid), notice.ready.eq(uart.notice_ready),
                     controller.hold.eq(uart.hold), controller.abort.eq(uart.reset)]
        for name, port in pins().items():
            outer, inner = getattr(self, name), getattr(controller, name)
            m.d.comb += inner.eq(outer) if port.flow is In else outer.eq(inner)

        return m
