# SPDX-License-Identifier: Apache-2.0
"""The network that the roughing planner trains."""

import random
from itertools import product

import numpy as np
import pytest

from host.roughing.network import TOLERANCE, train


def cube(function):
    """Samples of a function at the corners of a box."""
    return [(*at, function(*at)) for at in product((50.0, 100.0), (10.0, 15.0), (5.0, 7.0))]


def bilinear(area, depth, current):
    return 30 + 9 * current + (0.6 + 0.28 * current) * depth + 0.01 * area


def test_every_sample_is_learned():
    samples = cube(bilinear)
    network = train(samples, 1)
    assert network.converged
    reach = (max(row[3] for row in samples) - min(row[3] for row in samples)) / 2
    for *inputs, output in samples:
        assert abs(network.infer(inputs) - output) <= TOLERANCE * reach * 1.01


def test_two_samples_are_enough():
    network = train([(50, 15, 93.7, 5), (50, 15, 105.6, 6)], 1)
    assert network.converged
    assert network.infer((50, 15, 105.6)) == pytest.approx(6, abs=1e-6)
    assert 5.45 < network.infer((50, 15, 99.65)) < 5.55
    assert network.rises((0, -1, 1), (50, 15, 99.65))


@pytest.mark.parametrize("samples", [1, 9])
def test_too_few_or_too_many_samples_are_refused(samples):
    with pytest.raises(ValueError, match=rf"^a network learns 2 to 8 samples, not {samples}$"):
        train([(1, 2, 3, 4)] * samples, 1)


def test_a_seed_gives_the_same_network_and_another_seed_another():
    inputs = (70.0, 12.0, 6.2)
    same = [train(cube(bilinear), seed).infer(inputs) for seed in (7, 7, 8)]
    assert same[0] == same[1] != same[2]
    assert same[2] == pytest.approx(same[0], rel=1e-2)


def test_samples_that_say_the_same_are_no_harm():
    network = train([(50, 10, 5, 80), (50, 10, 5, 80), (50, 10, 6, 90)], 1)
    assert network.converged
    assert network.infer((50, 10, 5)) == pytest.approx(80, abs=1e-4)


def test_samples_that_contradict_each_other_are_not_learned():
    assert not train([(50, 10, 5, 80), (50, 10, 5, 81), (50, 10, 6, 90)], 1).converged


def test_an_input_that_the_first_two_tell_already_is_no_harm():
    """Two samples that differ in the area and in the third input: the cause is ambiguous."""
    network = train([(50, 10, 5, 80), (100, 10, 6, 90)], 1)
    assert network.converged
    assert network.infer((75, 10, 5.5)) == pytest.approx(85, abs=0.5)


def test_the_proof_of_monotony_agrees_with_slopes_that_are_measured():
    """Every proved network is monotone on a fine mesh; and most monotone ones are proved."""
    draw, proved, holds = random.Random(11), 0, 0
    for _ in range(150):
        bend = draw.uniform(0, 4)
        samples = cube(lambda area, depth, current, bend=bend, draw=draw:
                       bilinear(area, depth, current) + bend * draw.gauss(0, 2))
        network = train(samples, draw.randrange(2**32))
        mesh = [np.linspace(low, high, 5) for low, high in ((50, 100), (10, 15), (5, 7))]
        values = np.array([[[network.infer((x, y, z)) for z in mesh[2]] for y in mesh[1]]
                           for x in mesh[0]])
        measured = np.diff(values, axis=1).min() > 0 and np.diff(values, axis=2).min() > 0
        told = network.rises((0, 1, 1), (75, 12, 6))
        assert measured or not told
        proved, holds = proved + told, holds + measured
    assert 0 < holds < 150
    assert proved > holds // 2


def test_a_network_that_falls_is_not_proved_to_rise():
    network = train(cube(lambda area, depth, current: 100 - depth + current), 1)
    assert not network.rises((0, 1, 1), (75, 12, 6))
    assert network.rises((0, -1, 1), (75, 12, 6))
