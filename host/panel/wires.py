# SPDX-License-Identifier: Apache-2.0
"""What the panel is connected to: a simulated machine in this program, or a controller at a port.

Both are pipes of bytes for ``host.link.link.Link``. The simulated machine keeps to the computer's
clock, as that of ``gapkeeper simulate`` does, and has its button ``arm`` on the page.
"""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from host.link.link import BytePipe
from host.link.port import Port
from host.machines.machine import Machine
from host.run import simulation
from host.run.controller import Controller
from host.run.live import STEP_S, Live

__all__ = ["Bench", "Remote", "Wire"]

Say = Callable[[str], None]


class Wire(BytePipe, Protocol):
    """A machine at the other end of a pipe."""

    simulated: bool
    clock_hz: int
    pace: str   # says how slow a simulated machine is; empty if it keeps up with real time

    def arm(self) -> None:
        """Press the button ``arm`` of a simulated machine."""

    def voltage(self) -> float | None:
        """Mean gap voltage since it was asked for last, V; None if nobody tells it."""

    def close(self) -> None:
        """Let go of the machine."""


class _Cable:
    """Both ends of a line within one program; see ``host.link.serve.Line``."""

    url, gone = "", 0

    def __init__(self) -> None:
        self.down, self.up = bytearray(), bytearray()

    def take(self, most: int) -> bytes:
        data = bytes(self.down[:most])
        del self.down[:most]
        return data

    def give(self, data: bytes) -> None:
        self.up += data

    def wait(self, timeout_s: float) -> None:
        """Return at once: a lead of some milliseconds is not slept away."""

    def close(self) -> None:
        pass


class Bench:
    """A simulated machine, which runs while somebody reads.

    Raises
    ------
    UsageError, UserError
        As ``host.run.simulation.start``.
    """

    simulated = True

    def __init__(self, machine: Machine, *, clock_hz: int, seed: int, say: Say,
                 flash: Path | None = None) -> None:
        self.clock_hz = clock_hz
        self._machine = simulation.start(machine, clock_hz=clock_hz, seed=seed, waves=None,
                                         trace=False, progress=say, flash=flash)
        self._cable = _Cable()
        self._live = Live(self._machine, self._cable, self._paced)
        self.pace = ""
        self._last = 0.0, 0     # sum of volts over the clocks, clocks

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        self._cable.down += data

    def read(self, timeout_s: float) -> bytes:
        """Run the machine until it sends something, at most ``timeout_s`` of its time."""
        end = self.time_s() + timeout_s
        while not self._cable.up and (left := end - self.time_s()) > 0:
            self._live.step(min(left, STEP_S))
        data = bytes(self._cable.up)
        self._cable.up.clear()
        return data

    def time_s(self) -> float:
        """Seconds of the machine's time."""
        return self._machine.time_s()

    def arm(self) -> None:
        """Press the button ``arm``."""
        self._live.press()

    def voltage(self) -> float | None:
        """Mean gap voltage since it was asked for last, V."""
        volts, clocks = self._machine.get("read.gap_v_clocks"), self._machine.cycle
        (volts_before, before), self._last = self._last, (volts, clocks)
        return (volts - volts_before) / (clocks - before) if clocks > before else None

    def _paced(self, text: str) -> None:
        """Note what the machine says about its speed."""
        share = re.search(r"\d+ % of real time", text)
        self.pace = share[0] if share else ""

    def close(self) -> None:
        """Switch the machine off."""
        self._machine.close()


class Remote(Controller):
    """A controller at a port; it is asked who it is, and reset.

    Raises
    ------
    LinkError
        If nobody answers, something else does, or the controller is at work.
    """

    simulated = False
    pace = ""

    def __init__(self, url: str, machine: Machine, *, baud: int, clock_hz: int, say: Say) -> None:
        port = Port(url, baud)
        super().__init__(port, machine, clock_hz=clock_hz, say=say)
        try:
            self.identify(reset=False)
        except BaseException:
            port.close()
            raise

    def arm(self) -> None:
        """Do nothing: a person presses the button at the machine."""

    def voltage(self) -> float | None:
        """None: no controller tells its gap voltage."""
        return None

    def close(self) -> None:
        """Close the port."""
        self.port.close()
