# SPDX-License-Identifier: Apache-2.0
"""The C++ function of one part of a netlist."""

from testbench.native.expressions import kept_as, literal, made_as
from testbench.native.netlist import Node, Run
from testbench.native.order import Item, ordered
from testbench.native.plan import Plan, Step, Table

__all__ = ["PartWriter"]


class PartWriter(Plan):
    """Writes one part, block by block."""

    def __init__(self, emission, part):
        super().__init__(emission, part)
        self.items: dict[tuple, list[Item]] = {}    # by block

    def lines(self):
        self.e.local = self.inside - self.ending
        out = [f"static constexpr auto {name} = {text};" for name, text in self.constants.items()]
        out.append(f"void part{self.part.index}(Controller& s) {{")
        if self.e.whole(self.part.index) and self.part.sinks:
            tests = {self._gate(sink) for sink in self.part.sinks}
            mark = self.e.marks_of([self.part.index])
            out.append(f"    {mark}" if "" in tests
                       else f"    if ({' | '.join(sorted(tests))}) {{ {mark} }}")
        body = self._write(self.root, 1)
        out += [f"    const u64 o{index} = s.n{index};" for index in sorted(self.e.copied)]
        if self.settles:
            register = f"s.n{self.e.settling[self.part.index]}"
            settled = f"s.settled{self.part.index}"
            body = ["    bool changed = false;", *body,
                    f"    {settled} = changed ? 0 : {settled} | 1ull << {register};"]
        out += body
        out.append("}")
        self.e.local, self.e.changed, self.e.copied = set(), set(), set()
        return out

    @property
    def settles(self) -> bool:
        """Whether it notes with which values of a register nothing changes."""
        return self.part.index in self.e.settling

    def _gate(self, sink):
        """C++ of the clock's gate before a sink; "" if there is none, or it is computed here."""
        gate = sink.enables[0] if sink.enables else []
        return "" if self._sources(gate) & self.inside else self.e.word(gate) if gate else ""

    def _inner(self, path):
        block = self.blocks.get(path)
        return block if block and (block.nodes or block.choices or block.leaves) else None

    def _items(self, block):
        """The statements of a block: its nodes, its choices and its updates."""
        if block.path not in self.items:
            items = []
            for node in block.nodes:
                reads = self._sources(*self.e.parts.words(node))
                inner = self._inside(block, -node.index, (0, 1, "else", *range(len(node.choices))))
                items.append(Item(node, self._all(inner, "reads") | reads, node.index))
            for choice in block.choices:
                _, select, number, labels = choice
                inner = self._inside(block, number, labels)
                items.append(Item(choice, self._all(inner, "reads") | self._sources(select),
                                  changes=self._all(inner, "changes")))
            for sink, word in block.leaves:
                items.append(self._update(sink, word))
            for table in block.tables:
                items.append(Item(table, {table.register}))
            self.items[block.path] = items
        return self.items[block.path]

    def _update(self, sink, word):
        """Statement of the update of a register, of a kept value, or of a memory."""
        what = sink, word
        if sink.kind == "write":
            return Item(what, self._sources(*sink.ports.values()))
        if isinstance(word, Step):
            word = [Run(sink.width, sink.index)]
        words = self.e.parts.words(sink) if word is None else [word]
        return Item(what, self._sources(*words), changes={sink.index} & self.reread)

    def _inside(self, block, number, labels):
        """Statements of the branches of a choice in a block."""
        blocks = (self._inner((*block.path, (number, label))) for label in set(labels))
        return [item for inner in blocks if inner for item in self._items(inner)]

    @staticmethod
    def _all(items, what):
        return set().union(*(getattr(item, what) for item in items))

    def _write(self, block, depth):
        out = []
        awaited = self.e.parts.awaited[self.part.index]
        own = [item.reads for item in self._items(block) if isinstance(item.what, Node)
               or (isinstance(item.what, tuple) and isinstance(item.what[0], Node))]
        own += [self._sources(select) for _, select, _, _ in block.choices]
        if any(reads & awaited for reads in own):
            out.append("    " * depth + self.e.marks_of([self.part.index]))
        for item in ordered(self._items(block)):
            if isinstance(item.what, Node):
                out += self._node(item.what, block, depth)
            elif isinstance(item.what, Table):
                out += ["    " * depth + line for line in self._look_up(item.what)]
            elif isinstance(item.what[0], Node):
                out += ["    " * depth + line for line in self._leaf(*item.what)]
            else:
                out += self._branches(*item.what, block, depth)
        return out

    def _node(self, node, block, depth):
        pad = "    " * depth
        if node.kind == "$mux":
            out = self._mux(node, block, depth)
        elif node.kind == "$pmux":
            out = self._pmux(node, block, depth)
        else:
            out = [f"{pad}const {made_as(node.width)} v{node.index} = {self.e.value(node)};"]
        if node.index in self.kept:
            out.append(pad + self._keep(node, f"v{node.index}"))
        return out

    def _branches(self, kind, select, number, labels, block, depth):
        """A choice between updates."""
        pad = "    " * depth
        out, first = [], True
        before, changed = self.e.changed, set(self.e.changed)
        for at, label in enumerate(labels):
            self.e.changed = set(before)
            inner = self._inner((*block.path, (number, label)))
            if kind == "pmux" and label != "else":
                test = self.e.word(self._bit(select, at))
                out.append(f"{pad}{'if' if first else 'else if'} ({test}) {{")
                first = False
            elif not inner:
                continue
            elif label == "else":
                out.append(f"{pad}else {{")
            else:
                test = self.e.word(select)
                if first:
                    out.append(f"{pad}if ({'' if label else '!'}{test}) {{")
                else:
                    out.append(f"{pad}else {{")
                first = False
            out += self._write(inner, depth + 1) if inner else []
            out.append(f"{pad}}}")
            changed |= self.e.changed
        self.e.changed = changed
        return out

    def _mux(self, node, block, depth):
        pad = "    " * depth
        zero = self._inner((*block.path, (-node.index, 0)))
        one = self._inner((*block.path, (-node.index, 1)))
        if not zero and not one:
            return [f"{pad}const {made_as(node.width)} v{node.index} = {self.e.value(node)};"]
        out = [f"{pad}{made_as(node.width)} v{node.index};",
               f"{pad}if ({self.e.word(node.ports['S'])}) {{"]
        out += self._write(one, depth + 1) if one else []
        out += [f"{pad}    v{node.index} = {self.e.word(node.ports['B'])};", f"{pad}}} else {{"]
        out += self._write(zero, depth + 1) if zero else []
        return [*out, f"{pad}    v{node.index} = {self.e.word(node.ports['A'])};", f"{pad}}}"]

    def _pmux(self, node, block, depth):
        pad = "    " * depth
        out = [f"{pad}{made_as(node.width)} v{node.index};"]
        for at, word in enumerate(node.choices):
            test = self.e.word(self._bit(node.ports["S"], at))
            out.append(f"{pad}{'else ' if at else ''}if ({test}) {{")
            inner = self._inner((*block.path, (-node.index, at)))
            out += self._write(inner, depth + 1) if inner else []
            out += [f"{pad}    v{node.index} = {self.e.word(word)};", f"{pad}}}"]
        out.append(f"{pad}else {{")
        inner = self._inner((*block.path, (-node.index, "else")))
        out += self._write(inner, depth + 1) if inner else []
        return [*out, f"{pad}    v{node.index} = {self.e.word(node.ports['A'])};", f"{pad}}}"]

    def _leaf(self, sink, word):
        if sink.kind == "write":
            return self._memory(sink)
        index, kind = sink.index, kept_as(sink.width)
        if isinstance(word, Step):
            text = f"{word.name}.at[{self.e.name(index)}]"
        else:
            text = self.e.word(word) if word is not None else self.e.value(sink)
        if index in self.reread:
            self.e.changed.add(index)
        wide = "u128" if sink.width > 64 else "u64"
        if index in self.e.deferred:
            return [f"{{ const {wide} x = {text}; s.x{index} = ({kind})x; "
                    f"if (RARE(x != s.n{index})) {self._pending()} }}"]
        return [f"{{ const {wide} x = {text}; {self._keep(sink, 'x')} }}"]

    def _look_up(self, table):
        """C++ that updates the values of a table."""
        name = table.name
        lines = [f"if (const u64 x = {name}.at[{self.e.name(table.register)}]; "
                 f"RARE(x != s.{name})) {{",
                 f"    const u64 y = x ^ s.{name};",
                 f"    s.{name} = ({table.kind})x;"]
        at = 0
        for node in table.nodes:
            field = literal((1 << node.width) - 1)
            lines.append(f"    if (y >> {at} & {field}) {{ s.n{node.index} = "
                         f"({kept_as(node.width)})(x >> {at} & {field}); "
                         f"{self.e.marks(node.index)} }}")
            at += node.width
        return [*lines, "}"]

    def _keep(self, node, value):
        """C++ that stores a node's value, and tells its readers if it is another."""
        name, kind = f"s.n{node.index}", kept_as(node.width)
        store, marks = f"{name} = ({kind}){value};", self.e.marks(node.index)
        test = f"{value} != {name}"
        if node.index not in self.e.parts.lively:
            test = f"RARE({test})"
        if self.settles:
            store = ("changed = true; " if marks else f"changed |= {value} != {name}; ") + store
        return f"if ({test}) {{ {store} {marks} }}" if marks else store

    def _pending(self):
        """C++ after which this part's late changes are made at the end of the clock."""
        at, bit = self.e.waiting[self.part.index]
        text = f"s.pending[{at}] |= {literal(1 << bit)};"
        return f"{{ changed = true; {text} }}" if self.settles else text

    def _memory(self, sink):
        ports = sink.ports
        enable, at, data = (self.e.word(ports[name]) for name in ("EN", "ADDR", "DATA"))
        if sink.index in self.e.late:
            name = f"s.w{sink.index}"
            return [f"{{ const u64 en = {enable}; if (en) {{ {name}_en = en; "
                    f"{name}_at = (u32){at}; {name}_data = {data}; {self._pending()} }} }}"]
        return [f"{{ const u64 en = {enable}; if (en) {{ const u64 at = {at}; const u64 data = "
                f"{data}; {self.e.written(sink)} }} }}"]
