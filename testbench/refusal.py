# SPDX-License-Identifier: Apache-2.0
"""Check that a block refuses wrong parameters: ``refuses(Block, message, width=0)``."""

import gc
import warnings

import pytest
from amaranth.hdl import UnusedElaboratable


def refuses(block: type, message: str, *wrong, **named):
    """Make a ``block`` of wrong parameters and expect a ``ValueError`` that matches ``message``.

    Amaranth warns of an object that was made and never used in a design, as this one cannot be. The
    warning comes when the object is deleted, so it must be deleted here.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusedElaboratable)
        with pytest.raises(ValueError, match=message):
            block(*wrong, **named)
        gc.collect()
