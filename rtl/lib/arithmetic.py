# SPDX-License-Identifier: Apache-2.0
"""Arithmetic that synthesis would make larger than it need be."""

from amaranth import *

__all__ = ["sum_or_difference"]


def sum_or_difference(a, b, minus):
    """``a - b`` if ``minus``, else ``a + b``, as wide as ``a``, in a single adder.

    ``a`` is at least as wide as ``b``, whose sign is extended if it has one. What is subtracted is
    inverted, and a carry added to it.
    """
    top = b[-1] if b.shape().signed else C(0, 1)
    wide = Cat(b, top.replicate(len(a) - len(b)))
    return (Cat(minus, a) + Cat(minus, wide ^ minus.replicate(len(a))))[1:len(a) + 1]
