# SPDX-License-Identifier: Apache-2.0
"""What the numbers of alarms and errors mean, as ``softcore.tables.faults`` has it."""

from softcore.tables.faults import coded
from softcore.tables.references import filled, plain

__all__ = ["cause", "of_machine", "remedy", "sentence"]


def of_machine(code: int) -> bool:
    """Whether the machine is at fault. A number that is not known is taken for the machine's."""
    fault = coded(code)
    return fault is None or fault.of_machine


def sentence(code: int) -> str:
    """What is wrong, for when the controller's own sentence has not come."""
    fault = coded(code)
    return f"{fault.sentence[:1].upper()}{fault.sentence[1:]}." if fault else ""


def cause(code: int) -> str:
    """Why it comes, in whole sentences; empty for a number that is not known."""
    fault = coded(code)
    return plain(filled(fault.cause)) if fault else ""


def remedy(code: int) -> str:
    """What to do, in whole sentences; empty for a number that is not known."""
    fault = coded(code)
    return plain(filled(fault.remedy)) if fault else ""
