# SPDX-License-Identifier: Apache-2.0
"""The firmware's sentences in fewer bytes: all come out as they stand in the sources."""

import ctypes

import pytest

from softcore import texts
from softcore.tables.pairs import PAIRS
from testbench.firmware import library

ALL = sorted({text for path in texts.sources() for text in texts.sentences(path.read_text())})
SHARE = 0.56    # of the characters, at most, after packing


@pytest.fixture(scope="module")
def printed():
    """What ``text_print`` of the library for this computer writes, without further arguments."""
    print_it = library().text_print
    print_it.restype = ctypes.c_size_t

    def take(data, size=256):
        buffer = ctypes.create_string_buffer(b"\xff" * size, size)
        length = print_it(buffer, ctypes.c_size_t(size), data)
        assert buffer.raw[length] == 0
        assert buffer.raw[length + 1:] == b"\xff" * (size - length - 1), "nothing beyond the end"
        return buffer.raw[:length].decode("ascii")
    return take


def test_there_are_many_and_they_take_little_more_than_half():
    assert len(ALL) > 400
    assert sum(len(texts.packed(text)) for text in ALL) < SHARE * sum(map(len, ALL))


def test_each_comes_out_as_it_stands():
    for text in ALL:
        data = texts.packed(text)
        assert texts.expanded(data) == text
        assert 0 not in data


def test_the_firmware_writes_what_the_source_says(printed):
    plain = [text for text in ALL if "%" not in text]
    assert len(plain) > 200
    for text in plain:
        assert printed(texts.packed(text)) == text


def test_a_packed_argument_is_written_too(printed):
    packed = [texts.packed(text) for text in ALL if "%" not in text][:40]
    for data in packed:
        buffer = ctypes.create_string_buffer(256)
        library().text_print(buffer, ctypes.c_size_t(256), b"<%s>", data)
        assert buffer.value.decode() == f"<{texts.expanded(data)}>"


@pytest.mark.parametrize("size", range(1, 20))
def test_a_text_is_cut_at_the_end_of_the_buffer_also_within_a_pair(printed, size):
    text = "this needs the basic data"
    assert printed(texts.packed(text), size) == text[:size - 1]


def test_what_only_looks_like_a_sentence_stays():
    kept = '''#include "base/a b c d.h" is no string of C
    // "a comment is none"
    /* "nor is this
       one" */
    char quote = '"'; _Static_assert(N < (4), "only the compiler reads this"); f("short x");
    g("no_blank_in_it_at_all");
    '''.replace('#include "base/a b c d.h" is no string of C\n', "")
    assert texts.stored(kept) == kept


def test_a_stored_source_has_the_same_lines_and_specifications():
    source = ('say("the number %u of the \\"place\\"\\r\\n"\n    "and the other %s");\n'
              'next("a b");\n')
    made = texts.stored(source)
    assert made.count("\n") == source.count("\n")
    assert "%u" in made
    assert "%s" in made
    assert made.endswith('next("a b");\n')
    assert "number" not in made
    assert texts.sentences(source) == ['the number %u of the "place"\r\n', "and the other %s"]


def test_an_escape_sequence_that_is_not_known_is_refused():
    with pytest.raises(KeyError):
        texts.stored(r'say("a bell \a is heard");')


def test_a_character_outside_of_ascii_is_refused():
    with pytest.raises(UnicodeEncodeError):
        texts.packed("a length of 3 µm")


def test_training_takes_the_pair_that_occurs_most_often_first():
    pairs = texts.trained(["ababab %u ab", "abab c"] + [f"{n} ab cd" for n in range(30)])
    assert pairs[0] == (ord("a"), ord("b"))
    assert len(pairs) < 128 == len(PAIRS)
    data = texts.packed("ab %u ab", pairs)
    assert texts.expanded(data, pairs) == "ab %u ab"
    assert b"%u" in data
