# SPDX-License-Identifier: Apache-2.0
"""What the numbers of alarms and errors mean, as ``softcore.tables.faults`` has it."""

from softcore.tables.faults import Fault, of_alarm, of_error
from softcore.tables.references import filled, plain

__all__ = ["cause", "of_machine", "refusal", "remedy", "sentence"]


def of_machine(code: int) -> bool:
    """Whether the machine is at fault. A number that is not known is taken for the machine's."""
    fault = of_alarm(code)
    return fault is None or fault.of_machine


def _whole(fault: Fault | None) -> str:
    return f"{fault.sentence[:1].upper()}{fault.sentence[1:]}." if fault else ""


def sentence(code: int) -> str:
    """What is wrong by an alarm, for when the controller's own sentence has not come."""
    return _whole(of_alarm(code))


def refusal(code: int) -> str:
    """What is wrong by the error that answers a line, likewise."""
    return _whole(of_error(code))


def cause(code: int) -> str:
    """Why it comes, in whole sentences; empty for a number that is not known."""
    fault = of_alarm(code)
    return plain(filled(fault.cause)) if fault else ""


def remedy(code: int) -> str:
    """What to do, in whole sentences; empty for a number that is not known."""
    fault = of_alarm(code)
    return plain(filled(fault.remedy)) if fault else ""
