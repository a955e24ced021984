# SPDX-License-Identifier: Apache-2.0
"""C++ for the parts of a netlist: a part is computed only if something that it reads has changed.

A part has a bit in a word of ``dirty``. A clock goes through the set bits in order. A value that
changes sets the bits of its readers. Parts whose inputs change in almost every clock have no bit:
they are computed in every clock. A register or a memory that is still read in the same clock
changes at the end of the clock: its part sets a bit of ``pending``.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field

from testbench.native.expressions import Expressions, kept_as, literal
from testbench.native.netlist import WORD, Run
from testbench.native.parts import HELD, LIVE, Parts
from testbench.native.writer import PartWriter

__all__ = ["Emission", "Word"]


@dataclass
class Word:
    """Parts in order whose bits are in one word, or one that is ``always`` computed and has none.

    The parts of ``values`` have no registers: a clock is through with their bits when it has
    computed them. ``registers`` has nothing but registers: what they mark is for the next clock.
    ``mixed`` has both. A ``lone`` part has a word of its own: it is reached without a table.
    """

    kind: str
    parts: list[int] = field(default_factory=list)


class Emission(Expressions):
    """The C++ of a netlist's parts.

    ``stored`` are the nodes whose value the class keeps, by index; ``deferred`` those registers
    that change at the end of a clock, and ``late`` those writes of memories. A change of one of the
    words ``shown`` sets the class's member of that name.
    """

    def __init__(self, parts: Parts, shown: Iterable[list[Run]] = ()):
        super().__init__(parts)
        self._shown = {source for word in shown for run in word if run.node >= 0
                       for source in parts.through([run.node])}
        self.netlist = parts.netlist
        self.stored = {node.index for node in self.nodes if node.kind in HELD}
        self.stored |= {node.index for part in parts.parts for node in part.kept}
        self.deferred = self._deferred()
        self.late = self._late()
        self.writers = [PartWriter(self, part) for part in parts.parts]
        self.guards = [writer.guards() for writer in self.writers]
        self._looked_up = {node.index: table.register for writer in self.writers
                           for table in writer.root.tables for node in table.nodes}
        self.settling = self._settling()
        self.words = self._words()
        marked = [word for word in self.words if word.kind != "always"]
        self._lone = {at for at, word in enumerate(marked) if word.kind == "lone"}
        self.marked = [part for word in marked for part in word.parts]
        self._place = {part: (at, bit) for at, word in enumerate(marked)
                       for bit, part in enumerate(word.parts)}
        waiting = [part.index for part in parts.parts
                   if any(sink.index in self.deferred | self.late for sink in part.sinks)]
        self.waiting = {part: divmod(at, WORD) for at, part in enumerate(waiting)}
        self._now = -1

    def _deferred(self):
        """Registers that are read by a part after their own."""
        found = set()
        for part in self.parts.parts:
            for sink in part.sinks:
                if sink.kind == "register" and any(
                        reader > part.index for reader in self.parts.readers.get(sink.index, ())):
                    found.add(sink.index)
        return found

    def _late(self):
        """Writes of a memory that their own part, or one after it, reads."""
        place = self.parts.place
        return {write.index for part in self.parts.parts for write in part.sinks
                if write.kind == "write"
                and any(place[read.index] >= part.index for read in write.memory.reads)}

    def _settling(self):
        """Parts that a narrow register, changing all the time, sets off by what is looked up.

        Such a part keeps, for each value of the register, whether it is *settled*: it was computed
        with this value and nothing changed, and nothing else that it reads has changed since. Then
        it need not be computed when the register has this value again.
        """
        found = {}
        for part in self.parts.parts:
            if self.always(part.index) or self.whole(part.index) or part.early \
                    or self.parts.awaited[part.index] \
                    or any(sink.kind == "write" for sink in part.sinks):
                continue
            registers = {self._looked_up[source] for node in (*part.nodes, *part.sinks)
                         for source in self.parts.reads[node.index] if source in self._looked_up}
            # The register keeps its value until the part has been computed.
            if len(registers) == 1 and self.parts.place[min(registers)] > part.index:
                found[part.index] = registers.pop()
        return found

    def _words(self):
        """The words of ``dirty``, and the parts without a bit, in order."""
        both = [part.index for part in self.parts.parts if part.name == "processor"]
        found: list[Word] = []
        before = None
        for part in self.parts.parts:
            kind = ("always" if self.always(part.index) else
                    "lone" if part.name in LIVE else
                    "mixed" if both and both[0] <= part.index <= both[-1] else
                    "registers" if part.sinks else "values")
            if (kind, part.early) != before or kind in {"always", "lone"} \
                    or len(found[-1].parts) == WORD:
                found.append(Word(kind))
            found[-1].parts.append(part.index)
            before = kind, part.early
        return found

    def hot(self) -> set[int]:
        """Stored values that the parts of every clock read or change."""
        found = set()
        for part in self.parts.parts:
            if self.always(part.index):
                for node in (*part.nodes, *part.sinks):
                    found |= {node.index, *self.parts.reads[node.index]} & self.stored
        return found

    # ---- marks

    def marks(self, index: int) -> str:
        """Statements that make every reader of a value dirty.

        A reader that uses the value only under a condition is not marked while that is false: the
        change of the condition will mark it.
        """
        groups = defaultdict(set)
        for reader in self.parts.readers.get(index, ()):
            if self.always(reader) or (reader == self._now and self.whole(reader)) \
                    or index in self.parts.awaited[reader]:
                continue
            groups[self.guards[reader].get(index, "")].add(reader)
        register = self._looked_up.get(index, -1)
        found = []
        for test, readers in groups.items():
            set_off = {reader for reader in readers if self.settling.get(reader) == register}
            found += [f"if ({'(' + test + ') && ' if test else ''}"
                      f"!(s.settled{reader} >> s.n{register} & 1)) {{ {self._bits([reader])} }}"
                      for reader in sorted(set_off)]
            if others := readers - set_off:
                bits = self._bits(others)
                found += [self._unsettle(others), f"if ({test}) {{ {bits} }}" if test else bits]
        found += ["s.shown = true;"] * (index in self._shown)
        return " ".join(filter(None, found))

    def always(self, part: int) -> bool:
        """Whether a part is computed in every clock."""
        return self.parts.parts[part].name == "busy"

    def whole(self, part: int) -> bool:
        """Whether a part marks itself for as long as its registers can change."""
        return self.parts.parts[part].name == "processor"

    def marks_of(self, readers: Collection[int]) -> str:
        """Statements that make these parts dirty, whatever they were before."""
        return " ".join(filter(None, [self._unsettle(readers), self._bits(readers)]))

    def _unsettle(self, readers):
        return " ".join(f"s.settled{reader} = 0;" for reader in sorted(readers)
                        if reader in self.settling)

    def _bits(self, readers):
        words = defaultdict(int)
        for at, bit in (self._place[reader] for reader in readers):
            words[at] |= 1 << bit
        return " ".join(f"s.dirty[{at}] {'=' if at in self._lone else '|='} {literal(bits)};"
                        for at, bits in sorted(words.items()))

    def written(self, sink) -> str:
        """C++ that writes ``data`` into a memory ``at`` an address, of the bits of ``en``."""
        memory = sink.memory
        array = f"s.m{memory.index}_{memory.pieces.index(sink.piece)}"
        places = {self.parts.place[read.index] for read in memory.reads}
        readers = self.marks_of({place for place in places if not self.always(place)})
        return (f"if (at < {memory.size}) {{ const u64 x = ({array}[at] & ~en) | (data & en); "
                f"if (x != {array}[at]) {{ {array}[at] = ({kept_as(sink.piece[1])})x; "
                f"{readers} }} }}")

    # ---- one part

    def part(self, part) -> list[str]:
        """Lines of the C++ function of a part."""
        self._now = part.index
        lines = self.writers[part.index].lines()
        self._now = -1
        return lines
