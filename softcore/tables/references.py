# SPDX-License-Identifier: Apache-2.0
"""Sentences of the tables that cite numbers of settings and alarms by their names."""

import re
from collections.abc import Sequence

from softcore.tables.faults import FAULTS, Fault
from softcore.tables.settings import SETTINGS, Setting

__all__ = ["filled", "plain"]


def filled(text: str, settings: Sequence[Setting] = SETTINGS,
           faults: Sequence[Fault] = FAULTS) -> str:
    """Fill in the numbers for ``{setting}``, ``{alarm_fault}`` and ``{error_fault}``.

    Raises
    ------
    KeyError
        If no setting or fault has that name.
    """
    numbers = {setting.name: setting.number for setting in settings}
    numbers |= {f"alarm_{fault.name}": fault.alarm for fault in faults}
    numbers |= {f"error_{fault.name}": fault.error for fault in faults}
    return text.format_map(numbers)


def plain(text: str) -> str:
    """Make a sentence of Markdown plain text for a terminal: without marks of code and links."""
    return re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text).replace("`", "")
