# SPDX-License-Identifier: Apache-2.0
"""The tools for ECP5, which come as Python packages: how they are run, and how they fail."""

import subprocess
import sys
from pathlib import Path

__all__ = ["BuildError", "run_tool"]


class BuildError(RuntimeError):
    """The build has failed; the text says why in one sentence."""


def run_tool(command: list[str], folder: Path) -> None:
    """Run a tool for ECP5 in ``folder``. ``command`` starts with the tool's upstream name.

    Raises
    ------
    BuildError
        If it fails.
    """
    # The tools are in the interpreter's folder, whether or not its environment is active.
    program = Path(sys.executable).with_name(f"yowasp-{command[0]}")
    try:
        done = subprocess.run([program, *command[1:]], cwd=folder, capture_output=True, text=True,
                              check=False)
    except OSError as error:
        raise BuildError(f"{command[0]} cannot be started: {error.strerror}.") from error
    if done.returncode:
        said = (done.stdout + done.stderr).strip().splitlines() or ["nothing was said"]
        raise BuildError(f"{command[0]} failed in {folder}: {said[-1]}")
