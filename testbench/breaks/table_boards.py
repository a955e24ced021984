# SPDX-License-Identifier: Apache-2.0
"""Planted breaks of what a person loads and wires by: the loader's orders, the doctor's words."""

from testbench.breaks.harness import breaks_of

__all__ = ["BOARDS"]

BOARDS = (
    *breaks_of(
        "host/flash.py", "unit/host/test_flash.py",
        ('cable or target.cable, *where', 'target.cable, *where', "the cable asked for is used"),
        ("if permanent else [\"--write-sram\"]", "if not permanent else [\"--write-sram\"]",
         "nothing is overwritten without --permanent"),
        ('        if not confirm("Overwrite it?"):', '        if False:', "a no writes nothing"),
        ("    if packaged and used == DAP:", "    if False:", "the package knows no CMSIS-DAP"),
    ),
    *breaks_of(
        "host/doctor/complaints.py", "unit/host/test_complaints.py",
        ('(r"upper limit switch", ("limit_high",)', '(r"upper limit switch", ("limit_low",)',
         "the upper switch is accused"),
        ("for bit in ((bits or range", "for bit in ((range", "only the axis named is accused"),
        ("wire.pins.split()[bit], board.sites_of(wire)[bit]",
         "wire.pins.split()[bit], board.sites_of(wire)[0]", "a pin has its own site"),
    ),
)
