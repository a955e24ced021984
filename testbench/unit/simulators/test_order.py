# SPDX-License-Identifier: Apache-2.0
"""The order of a part's statements: what must come before what, and how many values wait."""

import random

import pytest

from testbench.native.order import Item, ordered

REGISTERS = [f"r{number}" for number in range(12)]
SEEDS = range(60)


def statements(seed, cyclic):
    """Random values, and updates of registers.

    Each register reads itself or later ones; with ``cyclic`` any of them.
    """
    rng = random.Random(seed)
    items = []
    for value in range(rng.randrange(60)):
        known = [item.gives for item in items] + REGISTERS
        items.append(Item(value, set(rng.sample(known, rng.randint(0, 3))), value))
    values = [item.gives for item in items]
    updates = []
    for at, register in enumerate(REGISTERS):
        others = REGISTERS if cyclic else REGISTERS[at:]
        updates.append(Item(register, set(rng.sample(values, min(len(values), 2)))
                            | {rng.choice(others)}, changes={register}))
    rng.shuffle(updates)
    return items + updates


def places(found):
    return {item.what: at for at, item in enumerate(found)}


def late_readers(found):
    """Pairs of a value that was changed in place, and a statement that reads it after that."""
    changed, late = set(), []
    for item in found:
        late += [(key, item.what) for key in item.reads & changed]
        changed |= item.changes
    return late


@pytest.mark.parametrize("cyclic", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_every_statement_once_and_after_what_it_reads(seed, cyclic):
    items = statements(seed, cyclic)
    found = ordered(items)
    assert len(found) == len(items)
    assert set(map(id, found)) == set(map(id, items))
    at = places(found)
    assert all(at[key] < at[item.what] for item in items for key in item.reads if key in at
               and key not in REGISTERS)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_register_changes_after_every_statement_that_reads_it_if_it_can(seed):
    assert late_readers(ordered(statements(seed, cyclic=False))) == []


def test_of_two_registers_that_change_places_one_is_read_late():
    first = Item("first", {"b"}, changes={"a"})
    second = Item("second", {"a"}, changes={"b"})
    assert late_readers(ordered([first, second])) == [("a", "second")]


def test_values_are_made_where_they_are_read():
    count = 40
    values = [Item((step, end), {(step - 1, end)} if step else {f"r{end}"}, (step, end))
              for step in range(3) for end in range(count)]
    ends = [Item(end, {(2, end)}, changes={f"r{end}"}) for end in range(count)]
    found = ordered(values + ends)
    for at in range(0, len(found), 4):
        end = found[at + 3].what
        assert [item.what for item in found[at:at + 3]] == [(0, end), (1, end), (2, end)]


def test_next_comes_what_needs_fewest_others():
    long = [Item(("long", step), {("long", step - 1)}, ("long", step)) for step in range(5)]
    items = [*long, Item("short", {"r0"}, "short"),
             Item("last", {("long", 4)}), Item("first", {"short"})]
    at = places(ordered(items))
    assert at["first"] < at["long", 0]
