# SPDX-License-Identifier: Apache-2.0
"""Meaning of the numbers of alarms and errors, from ``softcore.tables.faults``."""

from softcore.tables.faults import Fault, of_alarm, of_error
from softcore.tables.references import filled, plain

__all__ = ["cause", "of_machine", "refusal", "remedy", "sentence"]


def of_machine(code: int) -> bool:
    """Whether the machine is at fault; so it is for an unknown number."""
    fault = of_alarm(code)
    return fault is None or fault.of_machine


def _whole(fault: Fault | None) -> str:
    return f"{fault.sentence[:1].upper()}{fault.sentence[1:]}." if fault else ""


def sentence(code: int) -> str:
    """Sentence on an alarm, for use when the controller's own sentence has not come."""
    return _whole(of_alarm(code))


def refusal(code: int) -> str:
    """Sentence on the error that answers a line, likewise."""
    return _whole(of_error(code))


def cause(code: int) -> str:
    """Why an alarm comes, in whole sentences; empty for an unknown number."""
    fault = of_alarm(code)
    return plain(filled(fault.cause)) if fault else ""


def remedy(code: int) -> str:
    """What to do about an alarm, in whole sentences; empty for an unknown number."""
    fault = of_alarm(code)
    return plain(filled(fault.remedy)) if fault else ""
