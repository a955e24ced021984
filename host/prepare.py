# SPDX-License-Identifier: Apache-2.0
"""Build what the first run needs, so that it is fast: ``python -m host.prepare``.

``make install`` runs it. Every product is kept under ``build/`` by the content of its sources;
nothing happens if none of them has changed.
"""

import sys
import time

from host.errors import UserError
from host.machines import machine
from host.run import simulation


def main() -> None:
    """Build the simulated machine and its firmware by switching it on once."""
    began = time.monotonic()

    def say(text: str) -> None:
        print(f"[{time.monotonic() - began:4.0f} s] {text}", flush=True)

    try:
        sinker = machine.load("sinker")
        simulation.start(sinker, clock_hz=sinker.clock_hz, seed=1, waves=None,
                         progress=say).close()
    except UserError as error:
        sys.exit(f"gapkeeper: {error}")


if __name__ == "__main__":
    main()
