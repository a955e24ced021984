# SPDX-License-Identifier: Apache-2.0
"""Parities of a netlist, made cheap to compute.

A word that the processor writes or reads gets its parity in several steps of gates, four bits at a
time, so that it is ready in time. In C++ a parity of 64 bits takes as long as one of four.
"""

from collections import Counter

from testbench.native.netlist import Node, Run

__all__ = ["join"]

NIBBLE = 4
LEAST, MOST = 4, 8      # parities of consecutive nibbles that are computed together
XOR = "$reduce_xor"


def join(nodes: list[Node]) -> None:
    """Change nodes so that parities are computed together; new nodes come to the list's end.

    A parity of parities becomes one of all their bits. The parities of consecutive nibbles that are
    read as one word become one node, of kind ``$parities``.
    """
    uses = Counter(run.node for node in nodes for word in _words(node) for run in word)
    for node in nodes:
        if node.kind == XOR:
            node.ports["A"] = [run for one in node.ports["A"] for run in _bits(one, nodes, uses)]
    for node in nodes[:]:
        for name, word in node.ports.items():
            node.ports[name] = _joined(word, nodes, uses)


def _words(node):
    return [*node.ports.values(), *node.enables, *node.choices]


def _bits(run, nodes, uses):
    """Runs with the same parity as a run: those of its parity, if nothing else reads that."""
    source = nodes[run.node] if run.node >= 0 else None
    if not source or source.kind != XOR or source.width > 1 or uses[run.node] > 1:
        return [run]
    return [found for one in source.ports["A"] for found in _bits(one, nodes, uses)]


def _joined(word, nodes, uses):
    """The word, with parities of consecutive nibbles as runs of new nodes."""
    found, group = [], []
    for run in [*word, None]:
        place = run and _nibble(run, nodes, uses)
        if group and len(group) < MOST and place == (group[-1][0], group[-1][1] + NIBBLE):
            group.append((*place, run))
            continue
        found += _together(group, nodes)
        group = [(*place, run)] if place else []
        if run and not place:
            found.append(run)
    return found


def _nibble(run, nodes, uses):
    """Node and lowest bit of the nibble whose parity a run is, or None."""
    source = nodes[run.node] if run.node >= 0 else None
    if not source or source.kind != XOR or source.width > 1 or uses[run.node] > 1:
        return None
    first = source.ports["A"][0]
    if len(source.ports["A"]) > 1 or first.width != NIBBLE or first.node < 0:
        return None
    return first.node, first.low


def _together(group, nodes):
    """The runs of a group, or one of a new node in their place."""
    if len(group) < LEAST:
        return [run for _, _, run in group]
    node, low, first = group[0]
    count = len(group)
    nodes.append(Node(len(nodes), "$parities", count, {"A": [Run(NIBBLE * count, node, low)]},
                      nodes[first.node].name))
    return [Run(count, len(nodes) - 1)]
