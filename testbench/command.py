# SPDX-License-Identifier: Apache-2.0
"""The command ``gapkeeper`` in a fork of the test's process, which has imported its libraries.

To start Python and to import what draws the report takes longer than most commands.
"""

import gc
import importlib
import os
import runpy
import signal
import sys
import tempfile
import traceback
import warnings
from subprocess import CompletedProcess
from typing import NoReturn

__all__ = ["gapkeeper"]

# What most commands import, and what takes long; imported here once.
for _library in ("jinja2", "matplotlib.pyplot", "numpy", "pydantic", "rich.console",
                 "rich.progress", "rich.table", "typer"):
    importlib.import_module(_library)

WALL_S = 600        # after which a command is ended
# What Python ignores when nothing else is said; pytest makes errors of all warnings.
IGNORED = DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning


def gapkeeper(*arguments: object, columns: int = 100) -> CompletedProcess:
    """Run the command as ``python -m host.cli`` would; its exit status and what it said.

    ``columns`` is the width of its terminal.
    """
    command = ["gapkeeper", *map(str, arguments)]
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        with warnings.catch_warnings():
            # Other threads of this process are not there in the fork, and not missed.
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if child == 0:
            os.environ["COLUMNS"] = str(columns)
            _be(command, out.fileno(), err.fileno())
        _, status = os.waitpid(child, 0)
        for file in (out, err):
            file.seek(0)
        return CompletedProcess(command, os.waitstatus_to_exitcode(status), out.read(), err.read())


def _be(command: list[str], out: int, err: int) -> NoReturn:
    """Be the command, and end."""
    status = 1
    try:
        gc.freeze()     # objects of the tests are not the command's to tidy up, nor to warn of
        signal.alarm(WALL_S)
        for source, target in ((os.open(os.devnull, os.O_RDONLY), 0), (out, 1), (err, 2)):
            os.dup2(source, target)
        sys.stdin, sys.stdout, sys.stderr = (
            os.fdopen(number, mode, closefd=False)
            for number, mode in ((0, "r"), (1, "w"), (2, "w")))
        warnings.resetwarnings()
        for category in IGNORED:
            warnings.simplefilter("ignore", category)
        sys.argv = command
        runpy.run_module("host.cli", run_name="__main__", alter_sys=True)
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
