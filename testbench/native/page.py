# SPDX-License-Identifier: Apache-2.0
"""Write the page of all signals of a waveform file: ``python -m testbench.native.page``."""

from collections.abc import Iterator
from pathlib import Path

from testbench.native.signals import NAMES, SIGNALS

__all__ = ["PAGE", "page"]

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "waveforms.md"


def _rows(scope: str) -> Iterator[str]:
    for signal in SIGNALS:
        if signal.scope == scope:
            meaning = signal.meaning
            if signal.names:
                meaning += ": " + ", ".join(f"`{name}`" for name in NAMES[signal.names])
            pin = "pin" if signal.pin else "" if scope == "machine" else "register"
            yield f"| `{signal.name}` | {signal.bits} | {pin} | {meaning} |"


def page() -> str:
    """The page of all signals, as Markdown."""
    lines = [
        "<!-- Generated from testbench/native/signals.py by `python -m testbench.native.page`; "
        "do not edit. -->",
        "# Signals of a waveform file", "",
        "Every run with `--waves` writes them; see "
        "[Look at waveforms](../how-to/look-at-waveforms.md). The scopes below `gapkeeper` have "
        "the names of the folders in `rtl/`. Names such as Zc, Pi and Er are those of the first "
        "patent, counters 5 to 7, UP and DOWN those of the second, Es and Ex those of the fourth "
        "([the four patents](../explanation/four-patents.md)). Only the scope `machine` is "
        "unknown to the controller.", "",
        "A value stands from its clock until the next one that is written. A pin is shown as it is "
        "outside of the controller: an input is seen inside three clocks later, and an output "
        "follows its register by one clock. The streams of `gap_reference` and the wires of the "
        "converter, which change in nearly every clock, are left out; their results (`voltage`, "
        "the levels of the condition) are there."]
    for scope in dict.fromkeys(signal.scope for signal in SIGNALS):
        lines += ["", f"## `{scope}`", "", "| signal | bits | | what it is |",
                  "| --- | --- | --- | --- |", *_rows(scope)]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
