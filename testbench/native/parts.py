# SPDX-License-Identifier: Apache-2.0
"""A netlist cut into parts. A part is computed only when something that it reads has changed."""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from heapq import heappop, heappush

from testbench.native.netlist import Netlist, NetlistError, Node, Run

__all__ = ["SINKER", "WIRE", "Part", "Parts"]

LIVE = ("axis_x", "axis_y", "axis_z")   # groups of registers that change in every clock for a while
WHOLE = (*LIVE, "busy", "processor")    # classes whose nodes are not spread over several parts
HELD = {"input", "register"}        # keep their value; all other nodes are computed
SINKS = {"register", "write"}
DECODER = 8                         # comparisons of one word with so many constants
LARGEST = 48                        # nodes in a part
PROCESSOR = ("soc.cpu", "soc.memory")
# Registers that change in about a sixth of the clocks of a cut or more, as measured. Their readers
# form one part, which is computed in every clock. A wrong entry only costs time.
BUSY = r"""
    soc\.(cycle | uart\.receiver\.timer | sleep\.left
    | controller\.(watchdog(\$\d+)?\.(age|unanswered)
        | motion\.(ramp\.clocks | feed(\$\d+)?\.phase
            | feed_forward\.(count|bits|total|product))
        | power\.pulses\.remaining
        | drives\.(count | axis_[xyz]\.(drive_lag|supervision)\.step)
        | gap\.(references\.remainder_\d | feed_mode(\$\d+)?\.step | mean_level\.time
            | conduction\.age | discriminator\.age)))
    | gap_reference(\$\d+)? | dac(\$\d+)?(\[\d\])?"""
# Registers of the processor that change in less than a hundredth of the clocks in which it is
# awake, as measured. What follows from them alone has parts of its own.
SELDOM = re.compile(r"""soc\.cpu\.core\.(
    CsrPlugin_(?!mcycle|minstret|selfException)\w+ | execute_CsrPlugin_\w+ | \w+_ENV_CTRL
    | _zz_CsrPlugin_csrMapping_readDataInit | decode_to_execute_CSR_READ_OPCODE
    | externalInterruptArray_regNext | \w+_to_\w+_(IS_CSR|IS_DIV|MEMORY_MANAGMENT)
    | \w*memory_DivPlugin_(div_\w+|accumulator)(\[\d+\])?
    | IBusCachedPlugin_(fetchPc_booted | s1_tightlyCoupledHit
        | cache\.(lineLoader_flush\w+ | _zz_when_\w+ | _zz_ways_0_tags_port\[1\]))
    | dataCache_1\.(stageA_wayInvalidate | stageB_(wayInvalidate | flusher_\w+ | dataColisions
            | tagsReadRsp_0_error | mmuRsp_(is|allow|exception|refilling)\w*)
        | loader_(error|killReg|valid_regNext) | _zz_loader_waysAllocator)
    | dataCache_1_io_cpu_(execute_refilling | writeBack_exclusiveOk))""", re.X)
# Registers, and values made of them, that change in every clock for a long time, and then not at
# all for as long: an axis moves or rests. The first group is the name of the axis.
LIVELY = re.compile(r"""
    (?:\$flatten\\)? soc\.\\?controller\.\\?drives\.\\?(axis_[xyz])\.
    (rest | \\?dac(\$\d+)?\.(modulator\.\w+ | \$\d+))""", re.X)
# A sinker's discharges burn for long, and it jumps.
SINKER = re.compile(BUSY + r"""
    | soc\.controller\.(motion\.retraction\.elapsed | gap\.discriminator\.burnt)""", re.X)
# The converter of a wire machine is read all the time.
WIRE = re.compile(BUSY + r"""
    | soc\.controller\.gap\.sampler\.(phase|rises|lasts|before)
    | adc_(select|clock|command)(\$\d+)?""", re.X)


@dataclass(eq=False)
class Part:
    """Nodes that are computed together, in order, and the registers and writes at their end.

    ``nodes`` are combinational; ``kept`` are those of them that are read elsewhere; ``sinks`` are
    the registers and the writes whose next values this part computes. ``early`` says that no input
    of the controller reaches it in the same clock.
    """

    index: int
    early: bool = False
    name: str = ""
    nodes: list[Node] = field(default_factory=list)
    kept: list[Node] = field(default_factory=list)
    sinks: list[Node] = field(default_factory=list)


class Parts:
    """The parts of a netlist, ordered so that each follows the parts that it reads.

    The first ``early`` of them are enough for the signals in ``seen``. ``order`` has all
    combinational nodes, each after those that it reads. ``awaited`` has, for each part, the values
    of other parts, changing in most clocks, that it reads under conditions only: while one holds,
    the part is computed in every clock, and otherwise it need not know. ``lively`` has the name of
    its group for each value that changes in every clock for a while.

    Parameters
    ----------
    netlist : Netlist
        The netlist to cut.
    seen : list of list of Run
        Words that are read from outside between two clocks.
    busy : re.Pattern
        Names of the registers, and of values made of them, whose readers are computed in every
        clock.
    """

    def __init__(self, netlist: Netlist, seen: list[list[Run]], busy: re.Pattern = SINKER):
        self.netlist = netlist
        self._busy = busy
        nodes = netlist.nodes
        self.inlined = self._find_inlined()
        self.reads = {node.index: self._reads(node) for node in nodes}
        self.order = self._sorted()
        self._early = self._find_early(seen)
        self.users: dict[int, set[int]] = defaultdict(set)
        for index, sources in self.reads.items():
            if index not in self.inlined:
                for source in sources:
                    self.users[source].add(index)
        forced = {source for word in seen for run in word if run.node >= 0
                  for source in self.through([run.node])}
        self._awaits: dict[int, set[int]] = {}
        self._classes = self._classify(forced)
        self.parts = self._parts(self._units(forced), forced)
        self.awaited = {part.index: set().union(*(self._awaits.get(node.index, ())
                                                  for node in (*part.nodes, *part.sinks)))
                        for part in self.parts}
        self.early = sum(part.early for part in self.parts)
        self.place: dict[int, int] = {}
        for part in self.parts:
            for node in (*part.nodes, *part.sinks):
                self.place[node.index] = part.index
        self.readers = {index: {self.place[user] for user in users if user in self.place}
                        for index, users in self.users.items()}

    # ---- what reads what

    @staticmethod
    def words(node: Node) -> list[list[Run]]:
        """All words that come into a node."""
        return [*node.ports.values(), *node.enables, *node.choices]

    def _direct(self, node):
        return {run.node for word in self.words(node) for run in word if run.node >= 0}

    def through(self, sources: Iterable[int]) -> set[int]:
        """Sources, with inlined nodes replaced by the nodes that they read."""
        found = set()
        for source in sources:
            if source in self.inlined:
                found |= self.through(self._direct(self.netlist.nodes[source]))
            else:
                found.add(source)
        return found

    def _reads(self, node):
        return self.through(self._direct(node))

    def _find_inlined(self):
        """Nodes that every reader computes for itself.

        These are a decoder's comparisons, since all change with the address but few are read, and
        single inverted bits.
        """
        compared = Counter()
        decoders = {}
        for node in self.netlist.nodes:
            if node.kind == "$eq" and all(run.node < 0 for run in node.ports["B"]):
                key = decoders[node.index] = tuple(node.ports["A"])
                compared[key] += 1
            elif node.kind == "$logic_not" and node.ports:
                decoders[node.index] = tuple(node.ports["A"])
        found = {index for index, key in decoders.items() if compared[key] >= DECODER}
        for node in self.netlist.nodes:
            if node.kind in {"$not", "$logic_not"} and node.width == 1:
                width = sum(run.width for run in node.ports["A"])
                if width == 1:
                    found.add(node.index)
        return found

    # ---- order

    def _sorted(self):
        """Combinational nodes, each after the nodes that it reads."""
        nodes = self.netlist.nodes
        done: dict[int, bool] = {}
        order = []
        for start in nodes:
            if start.kind in HELD or start.kind == "write" or start.index in self.inlined:
                continue
            stack = [(start.index, None)]
            while stack:
                index, rest = stack.pop()
                if rest is None:
                    if index in done:
                        if not done[index]:
                            raise NetlistError(f"{nodes[index].name} depends on itself")
                        continue
                    done[index] = False
                    rest = [source for source in self.reads[index]
                            if nodes[source].kind not in HELD]
                while rest:
                    source = rest.pop()
                    if source not in done:
                        stack.append((index, rest))
                        stack.append((source, None))
                        break
                    if not done[source]:
                        raise NetlistError(f"{nodes[source].name} depends on itself")
                else:
                    done[index] = True
                    order.append(index)
        return order

    def _find_early(self, seen):
        """Nodes on which signals seen from outside depend; no input may reach them."""
        nodes = self.netlist.nodes
        stack = [source for word in seen for run in word if run.node >= 0
                 for source in self.through([run.node])]
        found = set()
        while stack:
            index = stack.pop()
            if index in found or nodes[index].kind in HELD:
                if nodes[index].kind == "input":
                    raise NetlistError(f"{nodes[index].name} reaches an output in its own clock")
                continue
            found.add(index)
            stack.extend(self.reads[index])
        return found

    # ---- parts

    def _classify(self, forced):
        """Class of every node: only nodes of one class are computed together."""
        nodes = self.netlist.nodes
        busy = {node.index for node in nodes
                if node.kind == "register" and self._busy.fullmatch(node.name)}
        seldom = {node.index for node in nodes
                  if node.kind == "register" and SELDOM.fullmatch(node.name)}
        lively = self.lively = {node.index: match[1] for node in nodes if node.kind == "register"
                                and (match := LIVELY.fullmatch(node.name))}
        found = {}
        for index in self.order:
            if self.reads[index] <= seldom and index not in self._early:
                seldom.add(index)
                found[index] = 1, self.module(nodes[index])
                continue
            hot = bool(self.reads[index] & busy)
            if hot and (nodes[index].width > 1 or self._busy.fullmatch(nodes[index].name)):
                busy.add(index)
            found[index] = self._class(nodes[index], hot, self._group(index, lively))
            if found[index][1] in LIVE and (nodes[index].width > 1
                                            or LIVELY.fullmatch(nodes[index].name)):
                lively[index] = found[index][1]
        for node in nodes:
            if node.kind in SINKS:
                hot = node.index in busy or bool(self.reads[node.index] & busy)
                found[node.index] = self._class(node, hot, self._group(node.index, lively))
        private = {index for index, (stage, where) in found.items()
                   if stage and where == "busy"} - forced
        for node in self.netlist.nodes:
            if node.kind == "register" and found.get(node.index) == (3, "busy") \
                    and node.index not in busy:
                self._release(node, busy, private, found)
        return found

    def _release(self, sink, busy, private, found):
        """Class a register for itself if it reads values that change all the time only at times."""
        cone = {sink.index}

        def seldom(word, reader, under):
            """Whether a word has no busy value, but under a condition."""
            for source in self.through(run.node for run in word if run.node >= 0):
                node = self.netlist.nodes[source]
                if source in private and node.kind not in HELD and self.users[source] == {reader}:
                    cone.add(source)
                    chosen = node.kind in {"$mux", "$pmux"}
                    words = [(port, under or (chosen and name != "S"))
                             for name, port in node.ports.items()]
                    words += [(choice, True) for choice in node.choices]
                    if not all(seldom(one, source, below) for one, below in words):
                        return False
                elif source in busy and not under:
                    return False
            return True

        enables = sink.enables
        if all(seldom(word, sink.index, False) for word in enables) \
                and seldom(sink.ports["D"], sink.index, bool(enables)):
            for index in cone:
                found[index] = self._class(self.netlist.nodes[index], False)
                self._awaits[index] = self.reads[index] & busy - cone

    def _kind(self, index):
        """Kind of a node's class: a node is computed only for another one of its kind."""
        stage, where = self._classes[index]
        return stage == 0, where if where in WHOLE else ""

    def _group(self, index, lively):
        """The one lively group that a node has its name from or reads of; "" for none or more."""
        groups = {lively.get(source, "") for source in (index, *self.reads[index])} - {""}
        return groups.pop() if len(groups) == 1 else ""

    def _class(self, node, hot, group=""):
        if node.index in self._early:
            return (0, "busy" if hot else self.module(node))
        sink = node.kind in SINKS
        if self.module(node).startswith(PROCESSOR) and (not sink or node.enables):
            return (1, "processor")
        if hot:
            return (3 if sink else 1, "busy")
        return (2 if sink else 1, group or self.module(node))

    @staticmethod
    def module(node):
        """Module of the controller that a node is in, by its name; one for those of all axes."""
        name = node.name
        if name.startswith("$flatten"):
            name = name.removeprefix("$flatten").rpartition(".")[0].replace("\\", "") + "."
        return re.sub("axis_[xyz]", "axis", name.rpartition(".")[0])

    def _units(self, forced):
        """For every node the only other node that it is computed for, or itself."""
        owner = {node.index: node.index for node in self.netlist.nodes}
        for index in reversed(self.order):
            users = self.users[index]
            owners = {owner[user] for user in users}
            if index not in forced and len(owners) == 1:
                one = owners.pop()
                if self._kind(index) == self._kind(one):
                    owner[index] = one
        members = defaultdict(list)
        for index in self.order:
            members[owner[index]].append(index)
        for node in self.netlist.nodes:
            if node.kind in SINKS:
                members[node.index].append(node.index)
        return members

    def _parts(self, units, forced):
        nodes = self.netlist.nodes
        owner = {index: root for root, inside in units.items() for index in inside
                 if nodes[index].kind not in SINKS}
        needs, follows = defaultdict(set), defaultdict(set)
        for root, inside in units.items():
            for index in inside:
                for source in self.reads[index]:
                    if nodes[source].kind not in HELD and owner[source] != root:
                        needs[root].add(owner[source])
                        follows[owner[source]].add(root)
        parts: list[Part] = []
        waiting = {root: len(needs[root]) for root in units}
        heaps = defaultdict(list)  # by class
        for root, count in waiting.items():
            if not count:
                heappush(heaps[self._classes[root]], root)
        for now in range(4):
            where, part = None, None
            while ready := [key for key in heaps if key[0] == now]:
                if where not in heaps:
                    last = where
                    where, part = min(ready, key=lambda key: (
                        not (last and last[1] in LIVE and key[1] in LIVE),
                        WHOLE.index(key[1]) if key[1] in WHOLE else -1, -len(heaps[key]))), None
                root = heappop(heaps[where])
                if not heaps[where]:
                    del heaps[where]
                whole = where[1] in WHOLE
                if part is None or (not whole
                                    and len(part.nodes) + len(part.sinks) >= LARGEST):
                    part = Part(len(parts), early=now == 0, name=where[1])
                    parts.append(part)
                for index in units[root]:
                    (part.sinks if nodes[index].kind in SINKS else part.nodes).append(nodes[index])
                for other in follows[root]:
                    waiting[other] -= 1
                    if not waiting[other]:
                        heappush(heaps[self._classes[other]], other)
        rank = {index: at for at, index in enumerate(self.order)}
        for part in parts:
            part.nodes.sort(key=lambda node: rank[node.index])
            inside = {node.index for node in (*part.nodes, *part.sinks)}
            part.kept = [node for node in part.nodes
                         if node.index in forced or not self.users[node.index] <= inside]
        return parts
