# SPDX-License-Identifier: Apache-2.0
"""Which values and updates of a part are computed under which conditions."""

from collections import defaultdict
from dataclasses import dataclass

from testbench.native.expressions import kept_as, width
from testbench.native.netlist import WORD, Node, Run
from testbench.native.parts import LIVE

__all__ = ["Block", "Plan", "Step", "Table"]

# Number of nodes in both branches of a choice up to which computing them is faster than a jump.
FEW = {"processor": 8, "busy": 6, **dict.fromkeys(LIVE, 6), "": 3}
MOST_TESTS = 3  # conditions in one guard
SHORT = {"$and", "$logic_and", "$or", "$logic_or"}   # of single bits: one may decide alone
COSTLY = 6      # nodes behind an operand up to which it is computed even if the other one decides
COPIES = 2      # of a choice between updates
MOST_PLACES = 8     # where a value matters that are told apart
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


class Plan:
    """One part in blocks: a node that only one branch of a choice needs is computed in it.

    ``kept`` are the nodes whose value the class keeps, ``ends`` those of them that the part itself
    does not read. ``constants`` are the tables that it looks up, as C++, by name. ``shortened``
    are nodes of the netlist that the plan has made choices.
    """

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
        self.tabulates = part.name == "busy"   # what is computed in every clock is worth them
        self.constants: dict[str, str] = {}     # tables, by name
        self.shortened = self._shorten()
        self._plan()

    def _shorten(self):
        """Make choices of single bits that one operand alone often decides; return the nodes."""
        found = []
        cost = self._costs() if self.part.name == "processor" else {}
        for node in self.part.nodes if cost else ():
            if node.kind not in SHORT or node.width > 1 or width(node.ports["A"]) > 1 \
                    or width(node.ports["B"]) > 1:
                continue
            first, other = sorted((node.ports["A"], node.ports["B"]),
                                  key=lambda word: self._cost(word, cost))
            if self._cost(other, cost) <= COSTLY:
                continue
            found.append(node)
            decided = [Run(1, constant=int("or" in node.kind))]
            zero, one = (other, decided) if "or" in node.kind else (decided, other)
            node.kind, node.ports = "$mux", {"S": first, "A": zero, "B": one}
        return found

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

    def _use(self, word, path, inside=None):
        """Some block at ``path`` needs a word, which matters in it or in the blocks ``inside``."""
        for run in word:
            if run.node < 0:
                continue
            for source in self.e.parts.through([run.node]):
                self.read_at[source].update([path] if inside is None else inside)
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
            # It makes a difference only where there is an update.
            updates = self._updates(path, number, [label for _, label in branches])
            tests = {self._condition(one) for one in updates}
            known = "" not in tests and len(tests) <= MOST_TESTS
            self._use(select, path, updates if known else None)

    def _updates(self, path, number, labels):
        """Blocks with an update in the branches of a choice in the block at a path."""
        found = []
        for label in labels:
            block = self.blocks.get((*path, (number, label)))
            if block and block.leaves:
                found.append(block.path)
            for _, _, inner, below in block.choices if block else ():
                found += self._updates(block.path, inner, below)
        return found

    def _follows_itself(self, sink, word):
        """Whether a register's next value is a function of its present one, for a table."""
        if not self.tabulates or sink.kind != "register":
            return False
        nodes = self._sources(word)
        return any(node != sink.index for node in nodes) and all(
            self.e.narrow.get(node, node) == sink.index for node in nodes)

    def _choice(self, word, sink):
        """The choice that makes a sink's value, if it is made for sinks alone."""
        if sink.kind == "write" or len(word) != 1 or word[0].node not in self.trees:
            return None
        node = self.e.nodes[word[0].node]
        if word[0].low or word[0].width != node.width \
                or (node.index in self.kept and node.index != sink.index):
            return None
        self.taken.add(node.index)
        return node

    def _trees(self):
        """Choices between the values that sinks may take.

        All that reads one is a sink or another such choice, between whole words. It is written once
        for each of them, so these must be few.
        """
        copies: dict[int, int] = {}
        for sink in self.part.sinks:
            copies[sink.index] = 1
        ends = {node.index for node in self.ends}
        for node in reversed(self.part.nodes):
            if node.kind not in {"$mux", "$pmux"}:
                continue
            if node.index in ends:
                copies[node.index] = 1
                continue
            if node.index in self.kept:
                continue
            whole = [Run(node.width, node.index)]
            count = 0
            for user in self.e.parts.users[node.index]:
                reader = self.e.nodes[user]
                words = self.e.parts.words(reader)
                uses = sum(run.node == node.index for word in words for run in word)
                between = [reader.ports.get("D")] if reader.kind == "register" else \
                    [reader.ports["A"], reader.ports.get("B"), *reader.choices] \
                    if reader.kind in {"$mux", "$pmux"} else []
                if user not in copies or reader.kind == "write" or uses != between.count(whole):
                    count = COPIES + 1
                    break
                count += uses * copies[user]
            if count <= COPIES:
                copies[node.index] = count
        return {index for index in copies if self.e.nodes[index].kind in {"$mux", "$pmux"}}

    def _plan(self):
        self.taken: set[int] = set()
        self.trees = self._trees()
        items = []
        for sink in self.part.sinks:
            items.append((sink, sink.ports.get("D", []), sink.enables))
        tables = defaultdict(list)
        for node in self.ends if self.tabulates else ():
            register = self.e.narrow.get(node.index, -1)
            if register >= 0 and sum(one.width for one in tables[register]) + node.width <= WORD:
                tables[register].append(node)
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
            # Where its value matters: in fewer blocks, perhaps, than those behind its own.
            matters = self.read_at[node.index]
            if node.index in self.kept or len(matters) > MOST_PLACES:
                matters = {path}
            ports = node.ports
            if node.kind == "$mux":
                here = self._cost(ports["A"], cost) + self._cost(ports["B"], cost) <= FEW.get(
                    self.part.name, FEW[""])
                self._use(ports["S"], path, matters)
                self._use_under(ports["A"], path, matters, (-node.index, 0), here)
                self._use_under(ports["B"], path, matters, (-node.index, 1), here)
            elif node.kind == "$pmux":
                self._use(ports["S"], path, matters)
                self._use_under(ports["A"], path, matters, (-node.index, "else"))
                for at, word in enumerate(node.choices):
                    self._use_under(word, path, matters, (-node.index, at))
            elif self._has_two_bits(node):
                self._use_under(ports["A"], path, matters, (tuple(ports["B"]), 1), here=True)
                self._use_under(ports["B"], path, matters, (tuple(ports["A"]), 1), here=True)
            else:
                for word in self.e.parts.words(node):
                    self._use(word, path, matters)
        for block in self.blocks.values():
            block.nodes.reverse()

    def _has_two_bits(self, node):
        """Whether each operand of a node matters while the other one is set.

        Both must not change at the same time: then neither would say that the other one matters.
        """
        if node.kind not in {"$and", "$logic_and"} or node.width > 1:
            return False
        one, other = node.ports["A"], node.ports["B"]
        return width(one) == width(other) == 1 and not self._sources(one) & self._sources(other)

    def _use_under(self, word, path, matters, choice, here=False):
        """Use a word in a branch of a choice; ``here``: it is computed before the choice."""
        self._use(word, path if here else (*path, choice), {(*one, choice) for one in matters})

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
        """Kind and select word of a choice in the block at a path, or of a bit that decides."""
        if isinstance(number, tuple):
            return "mux", list(number)
        if number < 0:
            node = self.e.nodes[-number]
            return node.kind.removeprefix("$"), node.ports["S"]
        return next((kind, select) for kind, select, one, _ in self.blocks[path].choices
                    if one == number)

    def _sources(self, *words):
        return self.e.parts.through(run.node for word in words for run in word if run.node >= 0)

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
