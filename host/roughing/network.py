# SPDX-License-Identifier: Apache-2.0
"""A small neural network, trained on a few samples by a learning operation that can be repeated.

Three inputs, six hidden units and a linear part beside them, one output:

    y = a0 + Σ a[j] x[j] + Σ c[k] φ(b[k] + Σ w[k][j] x[j]),   φ(z) = z / (1 + z²)

``softcore/firmware/roughing/network.c`` is the same in C. Both use nothing but + - * / on IEEE
numbers of single precision, and in the same order, so that they agree to the last bit. Sums are
therefore loops and not ``numpy.sum``, whose order is numpy's own. The soft core has no floating
point unit: single precision takes a third of the time and half of the memory of double precision,
and basic data are less exact anyway.

Inputs and output are scaled to -1 … 1 over the samples. From the third input its linear fit on the
first two (over the samples) is then subtracted: the least undersize and the current rise together,
and only their difference matters.

The start weights have one hidden unit of each sign for every pair of inputs, at the bend of φ, each
jittered by a seeded generator: two such units approximate the product of two inputs without the
square of either. Learning is the method of Levenberg and Marquardt over the whole batch, in its
dual form: the linear system has as many equations as there are samples, not weights.

Ref: D. W. Marquardt, J. SIAM 11(2), 431-441 (1963).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["HIDDEN", "INPUTS", "ITERATIONS", "SAMPLES", "TOLERANCE", "Network", "train"]

INPUTS, HIDDEN = 3, 6
SAMPLES = 8                 # at most; 2 at least
ITERATIONS = 40             # of the learning, at most
TOLERANCE = 1e-5            # of the scaled output, for every sample
PAIRS = ((0, 1, 1.0), (0, 1, -1.0), (0, 2, 1.0), (0, 2, -1.0), (1, 2, 1.0), (1, 2, -1.0))
SINGLE = np.float32
# All are of SINGLE. numpy's annotations wrongly make doubles of sums with Python numbers.
Singles = NDArray[Any]
Number = float | np.float32
Weights = tuple[Singles, Singles, Singles, Singles, np.float32]     # w, b, c, a, a0
W = TypeVar("W", Singles, np.float32)
WEIGHT, BEND, JITTER, FAINT = 0.25, 0.40625, 0.1, 0.01
DAMPING, LEAST_DAMPING = 2.0**-7, 2.0**-20
LEAST = 2.0**-12            # of a scaled input; anything less is rounding
# Square of the argument at which the slope of φ has its minimum, -1/8.
TURN, LOWEST_SLOPE = 3.0, -0.125


class _Generator:
    """Numbers from -1 to 1, by a linear congruence of 32 bits."""

    def __init__(self, seed: int) -> None:
        self._state = seed % 2**32

    def next(self) -> np.float32:
        self._state = (self._state * 1664525 + 1013904223) % 2**32
        return SINGLE(((self._state >> 16) - 32768) / 32768)


@dataclass(frozen=True)
class Network:
    """A network that has learned.

    ``iterations`` is the number of learning steps. ``converged`` says whether every sample is
    reproduced within ``TOLERANCE``. ``lowest`` and ``highest`` are the bounds of the samples'
    inputs, scaled as the hidden units get them.
    """

    middle: Singles
    half: Singles
    slopes: tuple[np.float32, np.float32]
    inverse: np.float32
    w: Singles
    b: Singles
    c: Singles
    a: Singles
    a0: np.float32
    lowest: Singles
    highest: Singles
    iterations: int
    converged: bool

    def _scaled(self, inputs: Sequence[Number]) -> list[np.float32]:
        x = [(SINGLE(value) - middle) / half
             for value, middle, half in zip(inputs, self.middle, self.half, strict=False)]
        for j in (0, 1):
            x[2] = x[2] - self.slopes[j] * x[j]
        x[2] = x[2] * self.inverse
        return x

    def infer(self, inputs: Sequence[Number]) -> np.float32:
        """Output for three inputs, all in the samples' units."""
        x = np.array([self._scaled(inputs)], dtype=SINGLE)
        y = _forward(x, self.w, self.b, self.c, self.a, self.a0)[0][0]
        inferred: np.float32 = y * self.half[INPUTS] + self.middle[INPUTS]
        return inferred

    def rises(self, signs: Sequence[int], inputs: Sequence[Number]) -> bool:
        """Whether the output is proved monotone over the samples' box, widened to ``inputs``.

        ``signs`` says for each input whether the output must rise (1) or fall (-1) with it, or
        need not (0). The proof uses bounds of the slope of each hidden unit over the box: it may
        fail for a network that is monotone, but never succeeds for one that is not. An input that
        is the same in all samples is not tested.
        """
        x = self._scaled(inputs)
        low, high = np.minimum(self.lowest, x), np.maximum(self.highest, x)
        unscaled = list(self.a)
        _unmix(unscaled, self.slopes, self.inverse)
        total = [sign * one for sign, one in zip(signs, unscaled, strict=True)]
        for k in range(HIDDEN):
            least, greatest = _slope_bounds(self.w[k], self.b[k], low, high)
            weights = list(self.w[k])
            _unmix(weights, self.slopes, self.inverse)
            for j in range(INPUTS):
                part = signs[j] * self.c[k] * weights[j]
                total[j] = total[j] + part * (least if part > 0 else greatest)
        return all(sign == 0 or self.lowest[j] == self.highest[j] or total[j] > 0
                   for j, sign in enumerate(signs))


def _unmix(weights: list[np.float32], slopes: tuple[np.float32, np.float32],
           inverse: np.float32) -> None:
    """Weights of the original third input, from those of the third input less its fit."""
    weights[2] = weights[2] * inverse
    for j in (0, 1):
        weights[j] = weights[j] - slopes[j] * weights[2]


def _slope_bounds(w: Singles, b: np.float32, low: Singles,
                  high: Singles) -> tuple[Number, Number]:
    """Bounds of the slope of φ over a box."""
    least = greatest = b
    for j in range(INPUTS):
        one, other = w[j] * low[j], w[j] * high[j]
        least, greatest = least + min(one, other), greatest + max(one, other)
    near = 0.0 if least <= 0 <= greatest else min(abs(least), abs(greatest))
    far = max(abs(least), abs(greatest))
    return (LOWEST_SLOPE if far * far > TURN else _slope(far),
            0.0 if near * near > TURN else _slope(near))


def _slope(z: Number) -> Number:
    m = 1.0 / (1.0 + z * z)
    return (1.0 - z * z) * m * m


def _forward(x: Singles, w: Singles, b: Singles, c: Singles, a: Singles,
             a0: np.float32) -> tuple[Singles, Singles, Singles]:
    """Outputs, hidden units and their slopes, for rows of scaled inputs."""
    z = b + x[:, :1] * w[:, 0]
    for j in range(1, INPUTS):
        z = z + x[:, j:j + 1] * w[:, j]
    m = 1.0 / (1.0 + z * z)
    hidden, slope = z * m, (1.0 - z * z) * m * m
    y = a0 + x[:, 0] * a[0]
    for j in range(1, INPUTS):
        y = y + x[:, j] * a[j]
    for k in range(HIDDEN):
        y = y + c[k] * hidden[:, k]
    return y, hidden, slope


def _solve(matrix: Singles, right: Singles) -> Singles:
    """Solution of a symmetric positive system, by L D Lᵀ without a root.

    Below the diagonal ``matrix`` becomes L, on it D, above it (L D)ᵀ.
    """
    n = len(right)
    for j in range(n):
        for i in range(j, n):
            rest = matrix[i, j]
            for k in range(j):
                rest = rest - matrix[i, k] * matrix[k, j]
            matrix[j, i] = rest
            if i != j:
                matrix[i, j] = rest / matrix[j, j]
    v = right.copy()
    for i in range(n):
        for k in range(i):
            v[i] = v[i] - matrix[i, k] * v[k]
    for i in range(n):
        v[i] = v[i] / matrix[i, i]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            v[i] = v[i] - matrix[k, i] * v[k]
    return v


def _totals(weights: W, terms: Iterable[Any]) -> W:
    """Each weight less the sum of its terms, sample by sample."""
    for term in terms:
        weights = weights - term
    return weights


def _square(errors: Singles) -> Number:
    total = 0.0
    for error in errors:
        total = total + error * error
    return total


def _scale(samples: Singles) -> tuple[Singles, Singles, Singles,
                                      tuple[np.float32, np.float32], np.float32]:
    """Scaled samples, and how they were scaled."""
    low, high = samples.min(axis=0), samples.max(axis=0)
    middle, half = (low + high) * 0.5, (high - low) * 0.5
    half = np.where(half > 0, half, SINGLE(1))
    x = (samples - middle) / half
    slopes: list[Any] = []      # of SINGLE
    for j in (0, 1):
        along = across = 0.0
        for row in x:
            along = along + row[2] * row[j]
            across = across + row[j] * row[j]
        slopes.append(along / across if across > 0 else SINGLE(0))
        x[:, 2] = x[:, 2] - slopes[j] * x[:, j]
    widest = np.abs(x[:, 2]).max()
    inverse: np.float32 = 1.0 / widest if widest > LEAST else SINGLE(0)
    x[:, 2] = x[:, 2] * inverse
    return x, middle, half, (slopes[0], slopes[1]), inverse


def _start(seed: int) -> Weights:
    draw = _Generator(seed)
    w, b, c, a = (np.zeros(shape, dtype=SINGLE)
                  for shape in ((HIDDEN, INPUTS), HIDDEN, HIDDEN, INPUTS))
    for k, (i, j, sign) in enumerate(PAIRS):
        for one in range(INPUTS):
            w[k, one] = JITTER * draw.next() * WEIGHT
        w[k, i] = w[k, i] + WEIGHT
        w[k, j] = w[k, j] + sign * WEIGHT
        b[k] = BEND + JITTER * draw.next() * BEND
        c[k] = FAINT * draw.next()
    return w, b, c, a, SINGLE(0)


def train(samples: Sequence[Sequence[float]], seed: int) -> Network:
    """Network that has learned rows of three inputs and an output.

    The same samples and seed give the same network, to the bit.

    Raises
    ------
    ValueError
        If there are less than 2 or more than ``SAMPLES`` of them.
    """
    rows = np.array(samples, dtype=SINGLE)
    if not 2 <= len(rows) <= SAMPLES:
        raise ValueError(f"a network learns 2 to {SAMPLES} samples, not {len(rows)}")
    x, middle, half, slopes, inverse = _scale(rows)
    inputs, target = x[:, :INPUTS], x[:, INPUTS]
    kernel = np.full((len(x), len(x)), SINGLE(1))
    for j in range(INPUTS):
        kernel = kernel + np.outer(inputs[:, j], inputs[:, j])
    weights = _start(seed)
    y, hidden, slope = _forward(inputs, *weights)
    errors = y - target
    damping, iterations = DAMPING, 0
    while np.abs(errors).max() > TOLERANCE and iterations < ITERATIONS:
        iterations += 1
        w, b, c, a, a0 = weights
        steep = c * slope
        matrix = np.full_like(kernel, SINGLE(1))
        for k in range(HIDDEN):
            matrix = matrix + np.outer(steep[:, k], steep[:, k])
        matrix = kernel * matrix
        for k in range(HIDDEN):
            matrix = matrix + np.outer(hidden[:, k], hidden[:, k])
        v = _solve(matrix + damping * np.eye(len(x), dtype=SINGLE), errors)
        back = v[:, None] * steep
        tried = (_totals(w, [np.outer(back[i], inputs[i]) for i in range(len(x))]),
                 _totals(b, back), _totals(c, v[:, None] * hidden),
                 _totals(a, v[:, None] * inputs), _totals(a0, v))
        y, tried_hidden, tried_slope = _forward(inputs, *tried)
        tried_errors = y - target
        if _square(tried_errors) < _square(errors):
            weights, hidden, slope, errors = tried, tried_hidden, tried_slope, tried_errors
            damping = max(damping * 0.125, LEAST_DAMPING)
        else:
            damping = damping * 8.0
    return Network(middle, half, slopes, inverse, *weights, lowest=inputs.min(axis=0),
                   highest=inputs.max(axis=0), iterations=iterations,
                   converged=bool(np.abs(errors).max() <= TOLERANCE))
