# SPDX-License-Identifier: Apache-2.0
"""The order of statements in which few values wait for their readers.

A value that is read much later than it is made is kept on the stack in between. In C++ of a
netlist that was a third of the bytes of its code, and code that does not fit into the processor's
first cache is what its clocks cost.
"""

from collections.abc import Hashable, Iterable, Sequence, Set
from dataclasses import dataclass
from functools import reduce
from operator import or_

__all__ = ["Item", "ordered"]


@dataclass(eq=False)
class Item:
    """A statement: it reads some values, and gives one or changes some in place.

    All that read what it changes should come before it: one that comes after it needs a copy of
    what was there before.
    """

    what: object
    reads: Set[Hashable]
    gives: Hashable | None = None
    changes: Set[Hashable] = frozenset()


def ordered(items: Sequence[Item]) -> list[Item]:
    """The items in an order that keeps few values waiting.

    An item comes after those that give what it reads. One that changes a value comes after those
    that read it, if that is possible. Of the items that give nothing, the next one is always that
    which needs fewest others to come before it; what it needs comes right before it.

    Parameters
    ----------
    items : sequence of Item
        Each after those that give what it reads. One gives a value or changes some, not both.
    """
    return _Order(items).found


class _Order:
    """Sets of items are integers with a bit for each."""

    def __init__(self, items):
        self.items = items
        self.found: list[Item] = []
        self.done = 0
        givers = {item.gives: at for at, item in enumerate(items) if item.gives is not None}
        # The latest first: they are put onto a stack.
        self.needs = [sorted((givers[key] for key in item.reads if key in givers), reverse=True)
                      for item in items]
        self.deep: list[int] = []       # an item and all that must come before it
        for at, needed in enumerate(self.needs):
            self.deep.append(1 << at | _all(self.deep[other] for other in needed))
        ends = [at for at, item in enumerate(items) if item.gives is None]
        self.ends = _all(1 << at for at in ends)
        readers: dict[Hashable, int] = {}
        for at, item in enumerate(items):
            for key in item.reads:
                readers[key] = readers.get(key, 0) | 1 << at
        self.before = {at: _all(readers.get(key, 0) for key in items[at].changes) & ~(1 << at)
                       for at in ends}
        self.first = {at: [*_bits(self.before[at] & ~self.ends), at] for at in ends}
        self.cone = {at: _all(self.deep[other] for other in self.first[at]) for at in ends}
        waiting = set(ends)
        while waiting:
            now = self._next(sorted(waiting))
            waiting.remove(now)
            self._take(self.first[now])
        self._take(range(len(items)))

    def _next(self, waiting):
        """The item to come next, of those that give nothing."""
        def readers(at):
            return (self.before[at] & self.ends & ~self.done).bit_count()

        def cost(at):
            return (self.cone[at] & ~self.done).bit_count()

        free = [at for at in waiting if not readers(at)]
        if free:
            return min(free, key=cost)
        return min(waiting, key=lambda at: (readers(at), cost(at)))

    def _take(self, wanted):
        """Put items into the order, and before each all that give what it needs."""
        stack = [*reversed(wanted)]
        while stack:
            at = stack[-1]
            if self.done >> at & 1:
                stack.pop()
                continue
            missing = [other for other in self.needs[at] if not self.done >> other & 1]
            if missing:
                stack += missing
                continue
            stack.pop()
            self.done |= 1 << at
            self.found.append(self.items[at])


def _all(sets: Iterable[int]) -> int:
    return reduce(or_, sets, 0)


def _bits(items: int) -> Iterable[int]:
    while items:
        low = items & -items
        yield low.bit_length() - 1
        items ^= low
