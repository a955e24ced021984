# SPDX-License-Identifier: Apache-2.0
"""What surrounds the building of the native simulation."""

import gc

import pytest

from testbench.native.compiling import uncollected


def fails():
    with uncollected():
        assert not gc.isenabled()
        raise KeyError


@pytest.mark.parametrize("before", [True, False])
def test_garbage_is_looked_for_again_after_an_elaboration(before):
    was = gc.isenabled()
    try:
        (gc.enable if before else gc.disable)()
        with pytest.raises(KeyError):
            fails()
        assert gc.isenabled() == before
    finally:
        (gc.enable if was else gc.disable)()
