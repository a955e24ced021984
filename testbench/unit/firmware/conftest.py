# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the firmware's tests."""

import pytest

from testbench.firmware import Controller


@pytest.fixture
def machine():
    """An unlocked controller, as its firmware is built for a computer."""
    ready = Controller()
    ready.unlock()
    return ready
