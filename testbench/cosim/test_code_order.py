# SPDX-License-Identifier: Apache-2.0
"""The model by which the order of the firmware's functions is sought: linker and cache."""

import numpy as np
import pytest

from softcore.image import target_image
from testbench.cosim.code_order import CACHE, LINE, LIST, SCRIPT, code_of, listed, misses


@pytest.fixture(scope="module")
def image():
    return target_image()


def test_the_model_puts_functions_where_the_linker_does(image):
    code = code_of(image, [])
    order = range(code.fixed, len(code.names))
    starts, near = code.addresses(order)
    assert len(order) > 60
    assert near.any()
    assert dict(zip(code.names, starts, strict=True)) == dict(
        zip(code.names, code.starts, strict=True))
    other, _ = code.addresses(list(reversed(order)))
    assert other[order[-1]] == code.starts[code.fixed]
    assert sorted(other) != sorted(code.starts), "other calls are short then"


def test_fetches_follow_their_functions(image):
    bare = code_of(image, [])
    first = int(bare.starts[bare.fixed])
    places = np.arange(first, int(bare.starts[-1]), 2)
    code = code_of(image, places)
    order = list(range(code.fixed, len(code.names)))
    assert np.array_equal(code.fetches(order), places)
    order = order[::-1]
    starts, near = code.addresses(order)
    moved = code.fetches(order)
    assert np.array_equal(moved[code.places == 0], starts[code.of[code.places == 0]])
    # No two are in one place, but for the second halves of calls that are short now.
    assert len(moved) - len(np.unique(moved)) <= np.count_nonzero(near)


def test_misses_are_those_of_a_cache_of_one_way(rng):
    fetches = [rng.randrange(3 * CACHE) & ~1 for _ in range(5000)]
    held, expected = {}, 0
    for address in fetches:
        line = address // LINE
        expected += held.get(line % (CACHE // LINE)) != line
        held[line % (CACHE // LINE)] = line
    assert misses(np.array(fetches)) == expected


def test_the_list_of_the_script_is_written_as_it_is_read(image):
    script = SCRIPT.read_text(encoding="utf-8")
    code = code_of(image, [])
    text = LIST.sub(lambda _: listed(code.names[code.fixed:]), script)
    named = LIST.search(text)[0]
    assert all(f"*(.text.{name})" in named for name in code.names[code.fixed:])
    assert text.replace(named, "") == script.replace(LIST.search(script)[0], "")
