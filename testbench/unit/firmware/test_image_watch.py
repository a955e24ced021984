# SPDX-License-Identifier: Apache-2.0
"""The firmware's check of its own image: every word that differs is found, and stays found."""

import ctypes

import pytest

from softcore.image import image_digest
from softcore.tables.faults import alarm_line, error_line
from testbench.firmware import Controller

WORDS = 200
TEXT = "the firmware in memory is not what was loaded: configure the controller anew"


@pytest.fixture
def words(rng):
    return [rng.getrandbits(32) for _ in range(WORDS)]


def load(machine, words, digest):
    machine.library.gk_image((ctypes.c_uint32 * len(words))(*words), len(words), digest)


def ready(words, digest):
    machine = Controller()
    load(machine, words, digest)
    machine.unlock()
    return machine


def test_a_sound_image_goes_unnoticed(words):
    machine = ready(words, image_digest(words))
    machine.run(2000)
    assert "safe" not in machine.flags
    assert not [line for line in machine.lines if line.startswith("ALARM")]


@pytest.mark.parametrize("place", [0, 63, 64, 131, WORDS - 1])
@pytest.mark.parametrize("bits", [1, 2, 32])
def test_a_word_that_differs_is_found_and_told(words, rng, place, bits):
    bent = list(words)
    for bit in rng.sample(range(32), bits):
        bent[place] ^= 1 << bit
    machine = ready(words, image_digest(words))
    load(machine, bent, image_digest(words))
    machine.run(200)
    assert "safe" in machine.flags
    assert machine.lines.count(alarm_line("guard")) == 1
    assert any("alarm" in line and TEXT in line for line in machine.lines)
    # Not even when the word is right again: damaged code may have run meanwhile.
    load(machine, words, image_digest(words))
    machine.run(200)
    assert machine.line("$X")[-2:] == [f"[MSG:{TEXT}.]", error_line("guard")]
    assert "safe" in machine.flags
    assert machine.lines.count(alarm_line("guard")) == 1


def test_words_that_change_places_are_found(words):
    machine = ready(words, image_digest(words))
    load(machine, [*words[:50], words[51], words[50], *words[52:]], image_digest(words))
    machine.run(200)
    assert alarm_line("guard") in machine.lines
