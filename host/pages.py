# SPDX-License-Identifier: Apache-2.0
"""The page of the command line, made from the program itself: ``python -m host.pages``."""

from pathlib import Path

import typer
from typer import _click
from typer.cli import get_docs_for_click

from host.cli import app

__all__ = ["COMMAND_LINE", "command_line"]

ROOT = Path(__file__).parents[1]
COMMAND_LINE = ROOT / "docs" / "reference" / "command-line.md"


def command_line() -> str:
    """Every command with its options, as Markdown."""
    command = typer.main.get_command(app)
    context = _click.Context(command, info_name="gapkeeper")
    text = get_docs_for_click(obj=command, ctx=context, name="gapkeeper", title="Command line")
    notice = "<!-- Generated from host/cli.py by `python -m host.pages`; do not edit. -->\n"
    return notice + text.replace(f"{ROOT}/", "").rstrip() + "\n"


if __name__ == "__main__":
    COMMAND_LINE.write_text(command_line(), encoding="utf-8")
