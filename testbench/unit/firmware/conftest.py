# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the firmware's tests."""

import ctypes

import pytest

from testbench.firmware import Controller, Memory, library
from testbench.models import firmware_slots

SIZE = 311_296      # bytes of the controller's memory


@pytest.fixture
def machine():
    """An unlocked controller, as its firmware is built for a computer."""
    ready = Controller()
    ready.unlock()
    return ready


@pytest.fixture
def memory():
    """A blank flash memory of a controller that knows where its bookmark lies in it."""
    code = library("undefined")
    told = firmware_slots.words(firmware_slots.image(memory=SIZE))
    code.gk_configured((ctypes.c_uint32 * len(told))(*told), len(told) - 1, told[-1])
    yield Memory()
    code.gk_configured(None, 0, 0)
