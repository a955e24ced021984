# SPDX-License-Identifier: Apache-2.0
"""Members of the controller that lead to pads."""

from amaranth.lib.wiring import In, Out

from rtl.pads import INPUTS, OUTPUTS

__all__ = ["AXES", "SERIAL", "pins"]

AXES = "xyz"
# Of the processor: the link, and the flash memory.
SERIAL = ("rx", "tx", "flash_select", "flash_clock", "flash_command", "flash_data")


def pins():
    """Members of a controller that lead to pads, as plain active-high signals.

    Vectors have one bit per axis. ``gap_high`` to ``gap_current`` are the comparators of the gap:
    voltage above the open level, below the arc level, below the short level, current flowing;
    ``gap_reference`` are the streams that set the first three levels, and ``gap_noise`` says that a
    discharge has high frequencies. ``adc_select`` to ``adc_data`` lead to the converter that
    ``rtl.gap.sampler`` asks. ``gap_supply`` is the power supply's open voltage and, in bit 4, its
    polarity.
    ``gap_on`` and ``gap_sense`` are the gates of the discharge and of the current-limited sensing
    source.
    ``dac`` has a density of ones proportional to the speed command, ``dac_negative`` its sign.
    ``safe`` says that the interlock holds the outputs in their safe state.
    """
    members = {name: In(width) for name, (width, _) in INPUTS.items() if name not in SERIAL}
    return members | {name: Out(width, init=init) for name, (width, init) in OUTPUTS.items()
                      if name not in SERIAL}
