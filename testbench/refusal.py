# SPDX-License-Identifier: Apache-2.0
"""Check that a block refuses wrong parameters: ``refuses(Block, message, width=0)``."""

import gc
import warnings

import pytest
from amaranth.hdl import UnusedElaboratable


def refuses(block: type, message: str, *wrong, **named):
    """Make a ``block`` of wrong parameters and expect a ``ValueError`` that matches ``message``.

    Amaranth warns of each object that was made and never built into a design, which this one can
    not be. The warning comes with the object's end, so that must come here too.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusedElaboratable)
        with pytest.raises(ValueError, match=message):
            block(*wrong, **named)
        gc.collect()
