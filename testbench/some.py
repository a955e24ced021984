# SPDX-License-Identifier: Apache-2.0
"""Which parameters of a test ``make test`` takes, and which are left to the soak."""

from collections.abc import Iterable

import pytest

__all__ = ["some"]


def some(values: Iterable, *always) -> list:
    """Parameters of a test: those in ``always`` are taken in every run, the others in the soak.

    Parameters
    ----------
    values : iterable
        All values, of one argument or, as tuples, of several. An argument whose own values are
        tuples cannot be shared so: pytest would take them for several.
    always : values
        Some of them; the first value if none is given.

    Raises
    ------
    ValueError
        If one of ``always`` is not among the values.
    """
    everything = list(values)
    always = always or (everything[0],)
    for one in always:
        if one not in everything:
            raise ValueError(f"{one!r} is no parameter of the test")
    return [one if one in always else
            pytest.param(*(one if isinstance(one, tuple) else (one,)), marks=pytest.mark.soak)
            for one in everything]
