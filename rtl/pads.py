# SPDX-License-Identifier: Apache-2.0
"""Pads: the only place where the controller meets its ports."""

from amaranth import *
from amaranth.lib import io, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from constraints.pads import CHAIN, CHAINED, FLASH_CLOCK, PADS
from rtl.lib.shift_output import ShiftOutput

__all__ = ["CHAIN_CLOCKS", "DIRECT_CLOCKS", "INPUTS", "OUTPUTS", "Pads", "levels"]


def levels(pads):
    """Width and level of each input, and of each output, of a table as ``constraints.pads`` has."""
    return tuple({pad.name: (pad.width, pad.level) for pad in pads if pad.direction == direction}
                 for direction in "io")


INPUTS, OUTPUTS = levels((*PADS, FLASH_CLOCK))
OPTIONAL = frozenset(pad.name for pad in PADS if pad.optional)
CHAIN_HALF_BIT = 8   # clocks: slow enough for relay drivers at any clock that a board reaches
CHAIN_FRAME = (2 * sum(OUTPUTS[name][0] for name in CHAINED) + 2) * CHAIN_HALF_BIT  # clocks
# From a change of a member of ``CHAINED`` until it is at its pin, or at its shift register.
DIRECT_CLOCKS, CHAIN_CLOCKS = 1, 2 * CHAIN_FRAME


class Pads(wiring.Component):
    """Buffers and synchronisers of every pin, true = active on this side of them.

    An input is seen 3 clocks after the clock edge that caught it (a register in the pad, two of a
    synchroniser). An output follows its member by 1 clock; in reset, and from configuration on, it
    is at its safe level, inverted pins included. Without a bitstream the board's pull resistors
    must do the same. Inversion is a property of the port (``PinsN``, ``~port``).

    A board with too few pins has a port ``chain`` in place of those of ``CHAINED``: its pins are
    the data, the shift clock and the latch clock of ``rtl.lib.shift_output.ShiftOutput``, the
    auxiliary code in the outputs 0 to 15, its strobes in the next three, and the order to the power
    supply in the last five. A frame is 400 clocks. The code arrives within two frames. A strobe is
    sent once it has been up for two frames in a row, so that it rises a whole frame after its code,
    within three frames; it falls within two.

    Parameters
    ----------
    ports : object
        A port for every name of ``INPUTS`` and ``OUTPUTS``, as an attribute: one of a platform
        (requested with ``dir="-"``) or an ``io.SimulationPort``. An optional input
        (``constraints.pads.Pad``) without one keeps its level. For ``chain`` see above.
        ``flash_clock`` may be a plain ``Signal`` instead: the clock of the memory from which an
        ECP5 loads its bitstream leaves the device through a primitive, not through a port.

    Members
    -------
    The names of ``INPUTS`` are outputs of this component (from the pin to the controller), those
    of ``OUTPUTS`` are inputs (from the controller to the pin). Vectors are by axis, X lowest.

    Raises
    ------
    ValueError
        If a port is missing or has another width.
    """

    def __init__(self, ports):
        self.chained = hasattr(ports, "chain")
        wanted = {name: width for name, (width, _) in (INPUTS | OUTPUTS).items()
                  if not (self.chained and name in CHAINED)
                  and (name not in OPTIONAL or hasattr(ports, name))}
        if self.chained:
            wanted["chain"] = CHAIN.width
        for name, width in wanted.items():
            port = getattr(ports, name, None)
            if port is None:
                raise ValueError(f"there is no port {name!r}")
            if len(port) != width:
                raise ValueError(f"port {name!r} must have {width} pins, not {len(port)}")
        self.ports = ports
        super().__init__({name: Out(width, init=init) for name, (width, init) in INPUTS.items()}
                         | {name: In(width, init=init) for name, (width, init) in OUTPUTS.items()})

    def elaborate(self, platform):
        m = Module()

        for name, (_, init) in INPUTS.items():
            if not hasattr(self.ports, name):
                continue
            buffer = io.FFBuffer("i", getattr(self.ports, name))
            m.submodules[f"{name}_pad"] = buffer
            m.submodules[f"{name}_sync"] = FFSynchronizer(buffer.i, getattr(self, name), init=init)

        for name, (_, init) in OUTPUTS.items():
            if not (self.chained and name in CHAINED):
                self._output(m, name, getattr(self, name), init)
        if self.chained:
            m.submodules.shift = shift = ShiftOutput(
                width=sum(OUTPUTS[name][0] for name in CHAINED), half=CHAIN_HALF_BIT)
            before = Signal.like(self.auxiliary_strobe)  # strobes when the frame before was taken
            with m.If(shift.take):
                m.d.sync += before.eq(self.auxiliary_strobe)
            m.d.comb += shift.data.eq(Cat(self.auxiliary_code, self.auxiliary_strobe & before,
                                           self.gap_supply))
            self._output(m, "chain", Cat(shift.serial, shift.clock, shift.latch), 0)

        return m

    def _output(self, m, name, level, init):
        # Not an FFBuffer: its register starts with the pin low, which is not the safe level of
        # every pin, and it has no reset.
        port = getattr(self.ports, name)
        value = Signal(len(port), init=init, name=f"{name}_out")
        m.d.sync += value.eq(level)
        if isinstance(port, Signal):
            m.d.comb += port.eq(value)
            return
        m.submodules[f"{name}_pad"] = buffer = io.Buffer("o", port)
        m.d.comb += buffer.o.eq(value)
