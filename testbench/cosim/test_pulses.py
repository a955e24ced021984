# SPDX-License-Identifier: Apache-2.0
"""Path pulses come every 4 clocks at the highest speed, whatever the way."""

import pytest

from testbench.cosim.pulses import WAYS, clocks_a_pulse


@pytest.mark.parametrize("way", WAYS)
def test_a_path_pulse_every_four_clocks(way):
    mean, least = clocks_a_pulse(way)
    assert least == 4
    assert mean < 4.01
