# SPDX-License-Identifier: Apache-2.0
"""The C++ function of one part of a netlist."""

from collections import defaultdict
from dataclasses import dataclass

from testbench.native.expressions import kept_as, literal, made_as, width
from testbench.native.netlist import Node, Run
from testbench.native.order import Item, ordered

__all__ = ["PartWriter"]

# Number of nodes in both branches of a choice up to which computing them is faster than a jump.
FEW = {"processor": 12, "busy": 6, "": 3}
MOST_TESTS = 3  # conditions in one guard
LEAST = 2       # values for which a table is worth while


class Block:
    """Statements under one condition: nodes, choices between blocks, and updates (``leaves``).

    ``path`` has the choices that lead to the block, each as its number and the branch.
    """

    def __init__(self, path=()):
        self.path = path
        self.nodes: list[Node] = []
        self.choices: list[tuple] = []
        self.leaves: list[tuple] = []
        self.tables: list[Table] = []


@dataclass(frozen=True)
class Table:
    """Kept values that follow from one narrow register: they are looked up together.

    ``name`` is that of the member which keeps what was looked up last.
    """

    name: str
    register: int
    nodes: list[Node]

    @property
    def kind(self) -> str:
        """C++ type of the values together."""
        return kept_as(sum(node.width for node in self.nodes))


@dataclass(frozen=True)
class Step:
    """The next value of a narrow register as a table of its present one."""

    name: str


class PartWriter:
    """Writes one part: a node that only one branch of a choice needs is computed in that branch."""

    def __init__(self, emission, part):
        self.e = emission
        self.part = part
        self.inside = {node.index for node in part.nodes}
        users = emission.parts.users
        self.kept = {node.index for node in part.kept}
        here = self.inside | {sink.index for sink in part.sinks}
        # Kept values that this part does not read are updated, as registers are.
        self.ends = [node for node in part.nodes
                     if node.index in self.kept and not users[node.index] & here]
        self.ending = {node.index for node in self.ends}
        self.paths: dict[int, tuple] = {}
        self.read_at: dict[int, set[tuple]] = defaultdict(set)     # blocks that read a value
        self.counter = 0
        self.root = Block()
        self.blocks = {(): self.root}
        self.reread = self._reread()
        self.tables = part.name == "busy"   # what is computed in every clock is worth them
        self.constants: dict[str, str] = {}     # tables, by name
        self.items: dict[tuple, list[Item]] = {}    # by block
        self._plan()

    def _reread(self):
        """Registers that change in place although this part reads them for other values too."""
        found = set()
        for sink in self.part.sinks:
            if sink.kind != "register" or sink.index in self.e.deferred:
                continue
            readers = self.e.parts.users[sink.index]
            here = self.inside | {other.index for other in self.part.sinks}
            if readers & here - {sink.index}:
                found.add(sink.index)
        return found

    # -- blocks

    def _use(self, word, path):
        """Some block at ``path`` needs a word."""
        for run in word:
            if run.node < 0:
                continue
            for source in self.e.parts.through([run.node]):
                self.read_at[source].add(path)
                if source in self.inside and source not in self.ending:
                    old = self.paths.get(source)
                    self.paths[source] = path if old is None else self._common(old, path)

    @staticmethod
    def _common(one, other):
        at = 0
        while at < len(one) and at < len(other) and one[at] == other[at]:
            at += 1
        return one[:at]

    def _block(self, path):
        if path not in self.blocks:
            self.blocks[path] = Block(path)
        return self.blocks[path]

    def _takes(self, items, path):
        """Plan updates, (sink, word, conditions before it); those of one choice share an ``if``."""
        groups = defaultdict(list)
        for sink, word, gates in items:
            if gates:
                groups["if", tuple(gates[0])].append((sink, word, gates[1:]))
                continue
            if sink.kind == "register" and word == [Run(sink.width, sink.index)]:
                continue
            if self._follows_itself(sink, word):
                step = Step(f"step{sink.index}_{len(self.constants)}")
                self.constants[step.name] = self.e.table(sink.index, [word])
                self._block(path).leaves.append((sink, step))
                self._use([Run(sink.width, sink.index)], path)
                continue
            node = self._choice(word, sink)
            if node is None:
                self._block(path).leaves.append((sink, word))
                if sink.kind == "write":
                    for other in sink.ports.values():
                        self._use(other, path)
                else:
                    self._use(word, path)
            elif node.kind == "$mux":
                groups["mux", tuple(node.ports["S"])].append((sink, node))
            else:
                groups["pmux", tuple(node.ports["S"])].append((sink, node))
        for (kind, select), members in groups.items():
            self.counter += 1
            number = self.counter
            self._use(select, path)
            if kind == "if":
                branches = [(members, 1)]
            elif kind == "mux":
                branches = [([(sink, node.ports["B"], []) for sink, node in members], 1),
                            ([(sink, node.ports["A"], []) for sink, node in members], 0)]
            else:
                count = width(select)
                branches = [([(sink, node.choices[at], []) for sink, node in members], at)
                            for at in range(count)]
                branches.append(([(sink, node.ports["A"], []) for sink, node in members], "else"))
            self._block(path).choices.append((kind, list(select), number,
                                              [label for _, label in branches]))
            for inner, label in branches:
                self._takes(inner, (*path, (number, label)))

    def _follows_itself(self, sink, word):
        """Whether a register's next value is a function of its present one that is worth a table."""
        if not self.tables or sink.kind != "register":
            return False
        nodes = self._sources(word)
        return any(node != sink.index for node in nodes) and all(
            self.e.narrow.get(node, node) == sink.index for node in nodes)

    def _choice(self, word, sink):
        """The choice that makes a sink's value, if nothing else uses it."""
        if sink.kind == "write" or len(word) != 1 or word[0].node < 0 or word[0].low:
            return None
        node = self.e.nodes[word[0].node]
        if word[0].width != node.width or node.index not in self.inside:
            return None
        if node.kind not in {"$mux", "$pmux"}:
            return None
        if node.index in self.kept and node.index != sink.index:
            return None
        if node.index != sink.index:
            users = self.e.parts.users[node.index]
            if len(users) != 1 or not users <= self.taken | {sink.index}:
                return None
            reader = self.e.nodes[next(iter(users))]
            if sum(run.node == node.index for word in self.e.parts.words(reader)
                   for run in word) != 1:
                return None
            if any(run.node == node.index for run in reader.ports.get("S", ())):
                return None
        self.taken.add(node.index)
        return node

    def _plan(self):
        self.taken: set[int] = set()
        items = []
        for sink in self.part.sinks:
            items.append((sink, sink.ports.get("D", []), sink.enables))
        tables = defaultdict(list)
        for node in self.ends if self.tables else ():
            if node.index in self.e.narrow:
                tables[self.e.narrow[node.index]].append(node)
        looked_up = set()
        for register, nodes in tables.items():
            if len(nodes) >= LEAST:
                looked_up.update(node.index for node in nodes)
                table = Table(f"t{self.part.index}_{register}", register, nodes)
                self.constants[table.name] = self.e.table(
                    register, [[Run(node.width, node.index)] for node in nodes])
                self.root.tables.append(table)
                self._use([Run(self.e.nodes[register].width, register)], ())
        for node in self.ends:
            if node.index in looked_up:
                continue
            if node.kind in {"$mux", "$pmux"}:
                items.append((node, [Run(node.width, node.index)], []))
            else:
                self.root.leaves.append((node, None))
                for word in self.e.parts.words(node):
                    self._use(word, ())
        for node in self.part.nodes:
            if node.index in self.kept and node.index not in self.ending:
                self.paths[node.index] = ()
        self._takes(items, ())
        self._place()

    def _place(self):
        """Put every node into the innermost block that has all its users."""
        cost = self._costs()
        # In this direction users come before the nodes that they use, so that all uses are known.
        for node in reversed(self.part.nodes):
            if node.index in self.taken or node.index in self.ending \
                    or node.index not in self.paths:    # it is in a table alone
                continue
            path = self.paths[node.index]
            self._block(path).nodes.append(node)
            ports = node.ports
            if node.kind == "$mux" and self._cost(ports["A"], cost) + self._cost(
                    ports["B"], cost) <= FEW.get(self.part.name, FEW[""]):
                for word in ports.values():
                    self._use(word, path)
            elif node.kind == "$mux":
                self._use(ports["S"], path)
                self._use(ports["A"], (*path, (-node.index, 0)))
                self._use(ports["B"], (*path, (-node.index, 1)))
            elif node.kind == "$pmux":
                self._use(ports["S"], path)
                self._use(ports["A"], (*path, (-node.index, "else")))
                for at, word in enumerate(node.choices):
                    self._use(word, (*path, (-node.index, at)))
            else:
                for word in self.e.parts.words(node):
                    self._use(word, path)
        for block in self.blocks.values():
            block.nodes.reverse()

    def _costs(self):
        """Cost of each node, with the nodes that are computed for it alone."""
        found = {}
        for node in self.part.nodes:
            own = {"$pmux": len(node.choices), "read": 5, "$mul": 3}.get(node.kind, 1)
            found[node.index] = own + sum(self._cost(word, found)
                                          for word in self.e.parts.words(node))
        return found

    def _cost(self, word, cost):
        users = self.e.parts.users
        return sum(cost.get(source, 0) for run in word if run.node >= 0
                   for source in self.e.parts.through([run.node]) if len(users[source]) == 1)

    # -- lines

    def guards(self) -> dict[int, str]:
        """C++ of a condition for every value that this part uses only under that condition."""
        found = {}
        for source, paths in self.read_at.items():
            tests = {self._condition(path) for path in paths}
            if "" not in tests and len(tests) <= MOST_TESTS:
                found[source] = " | ".join(sorted(tests))
        return found

    def _condition(self, path):
        """C++ of the outermost condition of a block that other parts can read, or ""."""
        for at, (number, label) in enumerate(path):
            kind, select = self._select(path[:at], number)
            if label == "else" or (label == 0 and kind != "pmux"):
                continue
            word = self._bit(select, label) if kind == "pmux" else select
            sources = self.e.parts.through([run.node for run in word if run.node >= 0])
            if sources <= self.e.stored - self.inside:
                return self.e.true(list(word))
        return ""

    def _select(self, path, number):
        """Kind and select word of a choice in the block at a path."""
        if number < 0:
            node = self.e.nodes[-number]
            return node.kind.removeprefix("$"), node.ports["S"]
        return next((kind, select) for kind, select, one, _ in self.blocks[path].choices
                    if one == number)

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
        out += body
        out.append("}")
        self.e.local, self.e.changed, self.e.copied = set(), set(), set()
        return out

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

    def _sources(self, *words):
        return self.e.parts.through(run.node for word in words for run in word if run.node >= 0)

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
        if any(item.reads & awaited for item in self._items(block)
               if isinstance(item.what, Node)
               or isinstance(item.what, tuple) and isinstance(item.what[0], Node)):
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

    @staticmethod
    def _bit(word, at):
        """Bit ``at`` of a word, as a word."""
        for run in word:
            if at < run.width:
                if run.node < 0:
                    return [Run(1, constant=run.constant >> at & 1)]
                return [Run(1, run.node, run.low + at)]
            at -= run.width
        raise IndexError

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
        return f"if (RARE({value} != {name})) {{ {store} {marks} }}" if marks else store

    def _pending(self):
        """C++ after which this part's late changes are made at the end of the clock."""
        at, bit = self.e.waiting[self.part.index]
        return f"s.pending[{at}] |= {literal(1 << bit)};"

    def _memory(self, sink):
        ports = sink.ports
        enable, at, data = (self.e.word(ports[name]) for name in ("EN", "ADDR", "DATA"))
        if sink.index in self.e.late:
            name = f"s.w{sink.index}"
            return [f"{{ const u64 en = {enable}; if (en) {{ {name}_en = en; "
                    f"{name}_at = (u32){at}; {name}_data = {data}; {self._pending()} }} }}"]
        return [f"{{ const u64 en = {enable}; if (en) {{ const u64 at = {at}; const u64 data = "
                f"{data}; {self.e.written(sink)} }} }}"]
