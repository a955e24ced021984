# SPDX-License-Identifier: Apache-2.0
"""Arithmetic in a form that synthesis makes smaller."""

from amaranth import *

__all__ = ["sum_or_difference"]


def sum_or_difference(a, b, minus):
    """``a - b`` if ``minus``, else ``a + b``, as wide as ``a``, in a single adder.

    ``a`` is at least as wide as ``b``, whose sign is extended if it has one. To subtract, ``b`` is
    inverted and a carry added.
    """
    top = b[-1] if b.shape().signed else C(0, 1)
    wide = Cat(b, top.replicate(len(a) - len(b)))
    return (Cat(minus, a) + Cat(minus, wide ^ minus.replicate(len(a))))[1:len(a) + 1]
