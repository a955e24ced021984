# SPDX-License-Identifier: Apache-2.0
"""C++ expressions for the nodes of a netlist.

Every value is unsigned and has no bits beyond its width.
"""

from testbench.native.netlist import WORD, NetlistError, Node, Run
from testbench.native.parts import Parts

__all__ = ["Expressions", "kept_as", "literal", "made_as", "mask", "width"]

COMPARE = {"$eq": "==", "$ne": "!=", "$lt": "<", "$le": "<=", "$gt": ">", "$ge": ">="}
ARITHMETIC = {"$add": "+", "$sub": "-", "$mul": "*"}
NARROW = 6                          # bits of a register up to which there are tables of its values
NO_TABLE = {"read", "$pmux"}
LOGIC = {"$and": "&", "$or": "|", "$xor": "^"}


def width(word: list[Run]) -> int:
    """Bits of a word."""
    return sum(run.width for run in word)


def kept_as(bits: int) -> str:
    """C++ type that keeps so many bits."""
    return next((f"u{wide}" for wide in (8, 16, 32, 64) if bits <= wide), "u128")


def made_as(bits: int) -> str:
    """C++ type in which a value of so many bits is computed."""
    return "u32" if bits <= 32 else "u64" if bits <= 64 else "u128"


def literal(value: int) -> str:
    """C++ constant of up to 128 bits."""
    if value >> 64:
        return f"((u128){literal(value >> 64)} << 64 | {literal(value & (1 << 64) - 1)})"
    return f"{value:#x}ull" if value > 9 else f"{value}ull"


def mask(text: str, bits: int) -> str:
    """``text`` with its lowest bits only."""
    if bits in (64, 128):
        return f"({text})"
    if bits > 64:
        return f"(({text}) & (((u128)1 << {bits}) - 1))"
    return f"(({text}) & {literal((1 << bits) - 1)})"


class Expressions:
    """The C++ of nodes and words; ``s`` is the controller."""

    def __init__(self, parts: Parts):
        self.parts = parts
        self.nodes = parts.netlist.nodes
        self.local: set[int] = set()    # nodes with a variable in the present function
        self.changed: set[int] = set()  # registers that it has changed so far
        self.copied: set[int] = set()   # those of them whose old value it still reads
        self.narrow = self._narrow()
        self.tabulated = -1             # index of the register whose values a table is made for

    def _narrow(self):
        """Nodes that follow from one narrow register alone, with this register."""
        found: dict[int, int] = {}
        narrow = {node.index for node in self.nodes
                  if node.kind == "register" and node.width <= NARROW}
        for index in self.parts.order:
            sources = {found.get(source, source) for source in self.parts.reads[index]}
            if len(sources) == 1 and sources <= narrow and self.nodes[index].kind not in NO_TABLE:
                found[index] = sources.pop()
        return found

    def table(self, register: int, words: list[list[Run]]) -> str:
        """C++ of a table: for each value of a register these words behind each other.

        All of them follow from the register alone.
        """
        bits = self.nodes[register].width
        kind = kept_as(sum(map(width, words)))
        self.tabulated = register
        texts, at = [], 0
        for word in words:
            texts.append(f"({kind})({self.word(word)}) << {at}" if at else self.word(word))
            at += width(word)
        self.tabulated = -1
        return (f"[] {{ struct {{ {kind} at[{1 << bits}]; }} t{{}}; "
                f"for (u64 r = 0; r < {1 << bits}; ++r) "
                f"t.at[r] = ({kind})({' | '.join(texts)}); return t; }}()")

    def name(self, index: int) -> str:
        """C++ of a node's value."""
        if self.tabulated >= 0:
            return "r" if index == self.tabulated else self.value(self.nodes[index])
        if index in self.parts.inlined:
            return self.value(self.nodes[index])
        if index in self.local:
            return f"v{index}"
        if index in self.changed:
            self.copied.add(index)
            return f"o{index}"
        return f"s.n{index}"

    def word(self, runs: list[Run], signed_to: int = 0) -> str:
        """C++ of a word; with ``signed_to`` its sign is extended to so many bits."""
        total = width(runs)
        wide = "u128" if max(total, signed_to) > 64 else "u64"
        parts, at = [], 0
        for run, times in self._repeated(runs):
            if times > 2:
                bit = self.word([run])
                parts.append(f"((({wide})0 - {bit} & {literal((1 << times) - 1)}) << {at})")
                at += times
                continue
            if run.node < 0:
                if run.constant:
                    parts.append(f"(({wide}){literal(run.constant)} << {at})" if at
                                 else literal(run.constant))
            else:
                whole = self.nodes[run.node].width
                text = self.name(run.node)
                if run.low:
                    text = f"({text} >> {run.low})"
                if run.low + run.width < whole:
                    text = mask(text, run.width)
                parts.append(f"(({wide}){text} << {at})" if at else f"({wide}){text}")
            at += run.width
        text = " | ".join(parts) or "0ull"
        if len(parts) > 1:
            text = f"({text})"
        if signed_to:
            full = 128 if wide == "u128" else 64
            sign = "i128" if wide == "u128" else "i64"
            if full != total:
                text = f"({wide})(({sign})(({wide}){text} << {full - total}) >> {full - total})"
        return text

    @staticmethod
    def _repeated(runs):
        """Runs, and how often each comes: only single bits of a node more than once."""
        found = []
        for run in runs:
            if found and run == found[-1][0] and run.node >= 0 and run.width == 1 \
                    and found[-1][1] > 0:
                found[-1][1] += 1
            else:
                found.append([run, 1])
        for run, times in found:
            if times == 2:
                yield run, 1
                yield run, 1
            else:
                yield run, times

    def _extended(self, runs, signed, bits):
        return self.word(runs, bits if signed and width(runs) < bits else 0)

    def value(self, node: Node) -> str:
        """C++ of a node's operation; both sides of a choice must have been computed."""
        ports, kind, bits = node.ports, node.kind, node.width
        both = all(node.signed)
        a = ports.get("A", [])
        if kind in ARITHMETIC or kind in LOGIC:
            signed = both
            first = self._extended(a, signed, bits)
            second = self._extended(ports["B"], signed, bits)
            cast = "(u128)" if bits > 64 else "(u64)"
            text = f"{cast}{first} {ARITHMETIC.get(kind) or LOGIC[kind]} {cast}{second}"
            narrow = kind in LOGIC and not signed and max(width(a), width(ports["B"])) <= bits
            return f"({text})" if narrow else mask(text, bits)
        if kind in {"$eq", "$ne"} and all(run.node < 0 for run in ports["B"]) \
                and (not both or width(a) == width(ports["B"])):
            text = self._equals(a, ports["B"])
            return text if kind == "$eq" else f"({text} ^ 1)"
        if kind in COMPARE:
            wide = max(width(a), width(ports["B"]))
            bits = (64 if wide <= 64 else 128) if both else wide
            first = self._extended(a, both, bits)
            second = self._extended(ports["B"], both, bits)
            cast = f"(i{bits})" if both else ""
            return f"({cast}({first}) {COMPARE[kind]} {cast}({second}))"
        if kind == "$not" and bits == 1 and width(a) == 1:
            return f"({self.word(a)} ^ 1)"
        if kind in {"$neg", "$not"}:
            text = f"{'-' if kind == '$neg' else '~'}{self._extended(a, node.signed[0], bits)}"
            return mask(text, bits)
        if kind == "$logic_not":
            return f"({self.word(a)} ^ 1)" if width(a) == 1 else f"({self._any(a)} == 0)"
        if kind in {"$reduce_or", "$reduce_bool"}:
            return self.true(a)
        if kind == "$reduce_and":
            return self._equals(a, [Run(run.width, constant=(1 << run.width) - 1) for run in a])
        if kind == "$reduce_xor":
            return self._parity(a)
        if kind == "$parities":
            return f"parities((u32){self.word(a)})"
        if kind in {"$logic_and", "$logic_or"}:
            sign = "&" if kind == "$logic_and" else "|"
            return f"({self.true(a)} {sign} {self.true(ports['B'])})"
        if kind in {"$shl", "$sshl", "$shift", "$sshr"}:
            return self._shift(node)
        if kind == "$mux":
            return f"({self.word(ports['S'])} ? {self.word(ports['B'])} : {self.word(a)})"
        if kind == "read":
            memory, at = node.memory, self.word(ports["ADDR"])
            piece = memory.pieces.index(node.piece)
            bits = width(ports["ADDR"])
            array = f"s.m{memory.index}_{piece}"
            if 1 << bits <= memory.size:
                return f"(u64){array}[{at}]"
            return f"({at} < {memory.size} ? (u64){array}[{at}] : 0ull)"
        raise NetlistError(f"{node.name} is a {kind}, which this simulation does not know")

    def true(self, word: list[Run]) -> str:
        """C++ of whether any bit of a word is set: 0 or 1."""
        return self.word(word) if width(word) == 1 else f"({self._any(word)} != 0)"

    def _any(self, word):
        """C++ that is not zero if any bit of a word is set."""
        bits: dict[int, int] = {}
        for run in word:
            if run.constant:
                return "1ull"
            if run.node >= 0:
                bits[run.node] = bits.get(run.node, 0) | ((1 << run.width) - 1) << run.low
        return "(" + (" | ".join(self._field(*one) for one in bits.items()) or "0ull") + ")"

    def _parity(self, word):
        """C++ of the parity of a word's bits, without any shift of nodes of up to 64 bits."""
        bits: dict[int, int] = {}
        odd, words = 0, []
        for run in word:
            if run.node < 0:
                odd ^= run.constant.bit_count() & 1
            elif self.nodes[run.node].width > WORD:
                words += [self.word([Run(min(WORD, run.width - at), run.node, run.low + at)])
                          for at in range(0, run.width, WORD)]
            else:
                bits[run.node] = bits.get(run.node, 0) ^ ((1 << run.width) - 1) << run.low
        fields = [self._field(*one) for one in bits.items() if one[1]]
        if fields:
            words.append(" ^ ".join(fields))
        found = [f"__builtin_parityll({one})" for one in words]
        return "(" + " ^ ".join([*found, "1u"] if odd else found or ["0u"]) + ")"

    def _equals(self, word, constant):
        """C++ of whether a word equals a constant, 0 or 1, without any shift."""
        value, at = 0, 0
        for run in constant:
            value |= run.constant << at
            at += run.width
        bits: dict[int, tuple[int, int]] = {}
        for run in word:
            wanted = value & ((1 << run.width) - 1)
            value >>= run.width
            if run.node < 0:
                if wanted != run.constant:
                    return "0ull"
                continue
            field = ((1 << run.width) - 1) << run.low
            known, old = bits.get(run.node, (0, 0))
            if (old ^ wanted << run.low) & known & field:
                return "0ull"
            bits[run.node] = known | field, old | wanted << run.low
        if value:
            return "0ull"
        tests = []
        for index, (field, wanted) in bits.items():
            if self.nodes[index].width == 1:
                tests.append(f"(u64){self.name(index)}" if wanted
                             else f"({self.name(index)} ^ 1)")
            else:
                tests.append(f"({self._field(index, field)} == {literal(wanted)})")
        return "(" + (" & ".join(tests) or "1ull") + ")"

    def _field(self, index, field):
        """C++ of some bits of a node, in place (not shifted)."""
        bits = self.nodes[index].width
        wide = "u128" if bits > 64 else "u64"
        if field == (1 << bits) - 1:
            return f"({wide}){self.name(index)}"
        return f"(({wide}){self.name(index)} & {literal(field)})"

    def _shift(self, node):
        a, b, bits = node.ports["A"], node.ports["B"], node.width
        wide = max(bits, width(a))
        if width(b) > 6 or wide > 64:
            raise NetlistError(f"{node.name} is shifted in {wide} bits, by {width(b)}")
        first = self._extended(a, node.signed[0], 64 if node.kind == "$sshr" else wide)
        if node.kind in {"$shl", "$sshl"}:
            return mask(f"(u64){first} << {self.word(b)}", bits)
        cast = "(i64)" if node.kind == "$sshr" and node.signed[0] else "(u64)"
        return mask(f"(u64)({cast}{first} >> {self.word(b)})", bits)
