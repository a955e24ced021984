# SPDX-License-Identifier: Apache-2.0
"""A netlist of words, read from the JSON that Yosys writes of a flat module.

Every node has one value of at most 128 bits, made by one cell or by a part of one. Registers and
choices wider than 64 bits are cut, since their bits do not depend on each other.
"""

from dataclasses import dataclass, field

__all__ = ["WORD", "Memory", "Netlist", "NetlistError", "Node", "Run"]

WORD = 64       # bits of a word of C++
BITWISE = {"$and", "$or", "$xor", "$not", "$mux"}
REGISTERS = {"$dff", "$dffe"}
KNOWN = BITWISE | {"$add", "$sub", "$mul", "$neg", "$eq", "$ne", "$lt", "$le", "$gt", "$ge",
                   "$logic_not", "$logic_and", "$logic_or", "$reduce_and", "$reduce_or",
                   "$reduce_bool", "$reduce_xor", "$pmux", "$shl", "$sshl", "$shift", "$sshr"}


class NetlistError(ValueError):
    """The module has something that this simulation cannot handle."""


@dataclass(frozen=True)
class Run:
    """Bits of a word that come from one place: ``node``'s from ``low`` on, or a constant's."""

    width: int
    node: int = -1
    low: int = 0
    constant: int = 0


@dataclass(eq=False)
class Node:
    """One word: a register, the result of a cell, a port of a memory, or an input.

    ``kind`` is the cell's, or ``input``, ``register``, ``read`` or ``write``; ``ports`` are the
    incoming words, as lists of runs, the lowest first. A register has ``D`` and, if it does not
    change in every clock, ``EN``, a list of the words that must all be true.
    """

    index: int
    kind: str
    width: int
    ports: dict[str, list[Run]] = field(default_factory=dict)
    name: str = ""
    initial: int = 0
    signed: tuple[bool, bool] = (False, False)
    enables: list[list[Run]] = field(default_factory=list)
    choices: list[list[Run]] = field(default_factory=list)
    memory: "Memory | None" = None
    piece: tuple[int, int] = (0, 0)


@dataclass(eq=False)
class Memory:
    """An array; one wider than 64 bits is as many arrays as there are ``pieces`` (low, width)."""

    index: int
    name: str
    width: int
    size: int
    initial: str
    pieces: list[tuple[int, int]] = field(default_factory=list)
    reads: list[Node] = field(default_factory=list)
    writes: list[Node] = field(default_factory=list)


class Netlist:
    """The nodes and memories of a module, and the places of its ports and names.

    Parameters
    ----------
    module : dict
        The module in the JSON: ``ports``, ``cells``, ``netnames``.
    clock : str
        Port of the clock; all registers use its rising edge, or that of the gated clock.
    gate : str
        Type of the cell that gates a clock: ``enable``, ``gated``.

    Raises
    ------
    NetlistError
        If a cell, a clock or a width cannot be simulated here.
    """

    def __init__(self, module: dict, clock: str, gate: str):
        self.module = module
        self.nodes: list[Node] = []
        self.memories: list[Memory] = []
        self._driver: dict[int, tuple[int, int]] = {}
        self._pending = []
        self._initial = self._initial_values()
        self._names = self._names_of_bits()
        self._clocks = {module["ports"][clock]["bits"][0]: None}
        self._gates(gate)
        for name, port in module["ports"].items():
            if port["direction"] == "input" and name != clock:
                self._node("input", port["bits"], name)
        for name, cell in module["cells"].items():
            self._cell(name, cell, gate)
        for node, connect in self._pending:
            connect(node)
        del self._pending

    # ---- for the other modules

    def word(self, bits: list) -> list[Run]:
        """Runs of a list of bits."""
        found: list[Run] = []
        for bit in bits:
            one = (Run(1, constant=int(bit == "1")) if isinstance(bit, str)
                   else Run(1, *self._driver[bit]))
            last = found[-1] if found else None
            if last and last.node == one.node == -1 and last.width < WORD:
                found[-1] = Run(last.width + 1, constant=last.constant | one.constant << last.width)
            elif last and one.node != -1 and last.node == one.node \
                    and last.low + last.width == one.low:
                found[-1] = Run(last.width + 1, last.node, last.low)
            else:
                found.append(one)
        return found

    def signal(self, name: str) -> list[Run]:
        """Runs of a port or of a named signal."""
        return self.word(self.module["netnames"][name]["bits"])

    # ---- reading

    def _initial_values(self):
        found = {}
        for net in self.module["netnames"].values():
            initial = net.get("attributes", {}).get("init")
            if initial is not None:
                for bit, value in zip(net["bits"], reversed(initial), strict=False):
                    found[bit] = int(value == "1")
        return found

    def _names_of_bits(self):
        found = {}
        nets = self.module["netnames"]
        for name in sorted(nets, key=lambda name: (nets[name].get("hide_name", 0), name.count("."),
                                                   name)):
            for at, bit in enumerate(nets[name]["bits"]):
                found.setdefault(bit, (name, at))
        return found

    def _gates(self, kind):
        for cell in self.module["cells"].values():
            if cell["type"] == kind:
                links = cell["connections"]
                self._clocks[links["gated"][0]] = links["enable"]

    def _node(self, kind, bits, name, **more):
        """A node that drives ``bits``."""
        node = Node(len(self.nodes), kind, len(bits), name=name, **more)
        self.nodes.append(node)
        for at, bit in enumerate(bits):
            if isinstance(bit, int):
                self._driver[bit] = node.index, at
        return node

    def _cell(self, name, cell, gate):
        kind, links = cell["type"], cell["connections"]
        if kind in {gate, "$scopeinfo"}:
            return
        if kind == "$mem_v2":
            self._memory(name, cell)
        elif kind in REGISTERS:
            self._register(name, cell)
        elif kind in KNOWN:
            self._combination(name, kind, cell["parameters"], links)
        else:
            raise NetlistError(f"cell {name} is a {kind}, which this simulation does not know")

    def _pieces(self, bits):
        """Cut a list of bits: its first and last, with at most 64 between."""
        return [(low, min(low + WORD, len(bits))) for low in range(0, len(bits), WORD)]

    def _register(self, name, cell):
        links, parameters = cell["connections"], cell["parameters"]
        clock = links["CLK"][0]
        if clock not in self._clocks or int(parameters["CLK_POLARITY"], 2) != 1:
            raise NetlistError(f"register {name} has a clock of its own")
        gate = self._clocks[clock]
        for low, high in self._pieces(links["Q"]):
            bits = links["Q"][low:high]
            initial = sum(self._initial.get(bit, 0) << at for at, bit in enumerate(bits))
            node = self._node("register", bits, self._label(bits, name), initial=initial)

            def connect(node, low=low, high=high):
                node.ports["D"] = self.word(links["D"][low:high])
                node.enables = [self.word(gate)] if gate is not None else []
                if "EN" in links:
                    node.enables.append(self._level(links["EN"], parameters["EN_POLARITY"], name))
            self._pending.append((node, connect))

    def _level(self, bits, polarity, name):
        if int(polarity, 2) != 1:
            raise NetlistError(f"register {name} has an enable that is active low")
        return self.word(bits)

    def _label(self, bits, name):
        for bit in bits:
            if bit in self._names:
                label, low = self._names[bit]
                return label if low == 0 else f"{label}[{low}]"
        return name

    def _combination(self, name, kind, parameters, links):
        out = links["Y"]
        signed = (bool(int(parameters.get("A_SIGNED", "0"), 2)),
                  bool(int(parameters.get("B_SIGNED", "0"), 2)))
        cuts = self._pieces(out) if kind in BITWISE | {"$pmux"} else [(0, len(out))]
        for low, high in cuts:
            if high - low > 2 * WORD:
                raise NetlistError(f"cell {name} makes {high - low} bits")
            node = self._node(kind, out[low:high], self._label(out[low:high], name), signed=signed)

            def connect(node, low=low, high=high):
                whole = len(out)
                for port, bits in links.items():
                    if port == "Y":
                        continue
                    if kind == "$pmux" and port == "B":
                        node.choices = [self.word(bits[at + low:at + high])
                                        for at in range(0, len(bits), whole)]
                    elif kind in BITWISE | {"$pmux"} and port != "S" and whole > WORD:
                        if len(bits) != whole:
                            raise NetlistError(f"cell {name} extends {len(bits)} bits")
                        node.ports[port] = self.word(bits[low:high])
                    else:
                        node.ports[port] = self.word(bits)
            self._pending.append((node, connect))

    def _memory(self, name, cell):
        links = cell["connections"]
        value = {key: int(text, 2) for key, text in cell["parameters"].items()
                 if set(text) <= {"0", "1"}}
        width, size, address = value["WIDTH"], value["SIZE"], value["ABITS"]
        if value["OFFSET"] or value["RD_CLK_ENABLE"] or value["WR_PORTS"] > 1:
            raise NetlistError(f"memory {name} has an offset, a clocked read or several writes")
        pieces = [(low, min(WORD, width - low)) for low in range(0, width, WORD)]
        memory = Memory(len(self.memories), name, width, size, cell["parameters"]["INIT"], pieces)
        self.memories.append(memory)
        for port in range(value["RD_PORTS"]):
            place = links["RD_ADDR"][port * address:(port + 1) * address]
            for low, wide in pieces:
                at = port * width + low
                bits = links["RD_DATA"][at:at + wide]
                node = self._node("read", bits, self._label(bits, name), memory=memory,
                                  piece=(low, wide))
                self._pending.append((node, lambda node, place=place: node.ports.update(
                    {"ADDR": self.word(place)})))
                memory.reads.append(node)
        if value["WR_PORTS"]:
            self._write(memory, links, value, name)

    def _write(self, memory, links, value, name):
        if value["WR_CLK_ENABLE"] != 1 or value["WR_CLK_POLARITY"] != 1:
            raise NetlistError(f"memory {name} is written without the clock's rising edge")
        gate = self._clocks[links["WR_CLK"][0]]
        for low, wide in memory.pieces:
            node = self._node("write", [], memory.name, memory=memory, piece=(low, wide))

            def connect(node, low=low, wide=wide):
                node.ports = {"ADDR": self.word(links["WR_ADDR"]),
                              "DATA": self.word(links["WR_DATA"][low:low + wide]),
                              "EN": self.word(links["WR_EN"][low:low + wide])}
                node.enables = [self.word(gate)] if gate is not None else []
            self._pending.append((node, connect))
            memory.writes.append(node)
