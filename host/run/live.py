# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper simulate``: a simulated controller and machine that any client may connect to.

A client's bytes go over the simulated line at the line's rate, and the client gets the bytes that
the controller's UART sends. The machine keeps to the computer's clock if the simulation is fast
enough; if it is not, a message says so.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from rich.console import Console

from host.link.serve import Line, Pty, Tcp, split_address
from host.machines import machine as machines
from host.run import simulation
from host.terminal import enter_pressed

__all__ = ["Live", "simulate"]

STEP_S = 1e-3       # of the machine's time between two looks at the client
BUTTON_S = 0.03     # time for which the button is held down, and then released
TELL_S = 10.0       # between two messages on the speed
KEEPS_UP = 0.98     # share of real time that counts as keeping up
AHEAD_S = 0.005     # lead of the machine's time while a client sends without a pause
# Pause after a client has left, in the machine's time, before the next one is heard or answered.
# The controller gives up an open frame within 50 ms, and answers within a few ms; see
# softcore/firmware/link.
UNPLUGGED_S = 0.1
# Pulling the plug damages a byte. So the controller refuses a line that was left open, and the next
# client cannot complete it.
GLITCH = b"\xff"
FORGIVEN_S = 0.05   # most delay that is made up: else the machine runs too fast for its client

Say = Callable[[str], None]


class Machine(Protocol):
    """A simulated machine: its time, its line and its button."""

    byte_s: float

    def write(self, data: bytes) -> None: ...
    def read(self, timeout_s: float) -> bytes: ...
    def time_s(self) -> float: ...
    def button_arm(self, down: bool) -> None: ...
    def armed(self) -> bool: ...


class Live:
    """A machine that keeps running, connected to the line of its client.

    ``arm`` presses the button of that name by itself whenever the machine is not armed. ``clock``
    gives the computer's time in seconds, and ``sleep`` waits for some seconds.
    """

    def __init__(self, machine: Machine, line: Line, say: Say, *, arm: bool = False,
                 clock: Callable[[], float] = time.monotonic,
                 sleep: Callable[[float], None] = time.sleep) -> None:
        self.machine, self.line, self.say, self.arm = machine, line, say, arm
        self.clock, self.sleep = clock, sleep
        self._origin_s = clock() - machine.time_s()  # of the machine's time, moved when it is late
        self._told = clock(), machine.time_s()
        self._slow = False
        self._gone = line.gone
        self._plugged_s = 0.0   # machine's time from which a client is heard again
        self._button = False
        self._turn_s = 0.0      # machine's time at which the button may be moved again
        self._presses = 0       # presses still to be made

    def press(self) -> None:
        """Press the button ``arm`` once, as soon as it is up."""
        self._presses += 1

    def step(self, most_s: float = STEP_S) -> None:
        """Run the machine for at most ``most_s`` of its time, and keep to real time.

        A step ends early at the first bytes for the client.
        """
        plugged = self.machine.time_s() >= self._plugged_s
        # Only as many bytes as the line carries in that time; the others wait in the client's port.
        data = self.line.take(int(most_s / self.machine.byte_s) + 2) if plugged else b""
        if data:
            self.machine.write(data)
        self._move_button()
        said = self.machine.read(most_s)
        if said and plugged:
            self.line.give(said)
        if self.line.gone != self._gone:
            self._gone = self.line.gone
            self._plugged_s = self.machine.time_s() + UNPLUGGED_S
            self.machine.write(GLITCH)
        self._keep_time()

    def _move_button(self) -> None:
        now = self.machine.time_s()
        if now < self._turn_s:
            return
        down = not self._button and (
            self._presses > 0 or (self.arm and not self.machine.armed()))
        if down == self._button:
            return
        self.machine.button_arm(down)
        if down:
            self._presses = max(0, self._presses - 1)
        self._button, self._turn_s = down, now + BUTTON_S

    def _keep_time(self) -> None:
        now = self.clock()
        ahead = self.machine.time_s() - (now - self._origin_s)
        if ahead > AHEAD_S:
            self.sleep(ahead - AHEAD_S)
        elif ahead > 0:
            self.line.wait(ahead)   # a client that sends ends it
        elif -ahead > FORGIVEN_S:
            self._origin_s += -ahead - FORGIVEN_S
        began, machine_s = self._told
        if now - began < TELL_S:
            return
        share = (self.machine.time_s() - machine_s) / (now - began)
        if share < KEEPS_UP:
            self.say(f"the machine's time goes at {100 * share:.0f} % of real time: this computer "
                     "simulates no faster.")
        elif self._slow:
            self.say("the machine's time keeps up with real time again.")
        self._slow = share < KEEPS_UP
        self._told = now, self.machine.time_s()


def simulate(*, machine: str, tcp: str | None, pty: bool, arm: bool, seed: int,
             clock_hz: int | None, console: Console, flash: Path | None = None) -> None:
    """Switch a simulated machine on, let clients connect, and go on until Ctrl-C."""
    def say(text: str) -> None:
        console.print(text, soft_wrap=True, markup=False)

    chosen = machines.load(machine)
    line: Line = Pty(say) if pty else Tcp(*split_address(tcp or ""), say)
    try:
        machine_on = simulation.start(chosen, clock_hz=clock_hz or chosen.clock_hz, seed=seed,
                                      waves=None, trace=False, progress=say, flash=flash)
        try:
            live = Live(machine_on, line, say, arm=arm)
            for text in _introduction(chosen.name, line, arm):
                say(text)
            while True:
                live.step()
                if not arm and enter_pressed():
                    live.press()
                    say('the button "arm" is pressed.')
        except KeyboardInterrupt:
            say(f"switched off after {machine_on.time_s():.1f} s of the machine's time.")
        finally:
            machine_on.close()
    finally:
        line.close()


def _introduction(name: str, line: Line, arm: bool) -> list[str]:
    told = [f"machine {name}, simulated, at {line.url}"]
    if not isinstance(line, Pty) and not getattr(line, "local", False):
        told.append("Whoever reaches this computer over its network can connect: give an address "
                    "of localhost to keep others out.")
    elif not isinstance(line, Pty):
        told.append("Only programs on this computer can connect.")
    told.append(f"A tape: gapkeeper run TAPE --port {line.url} --at-start")
    told.append('The button "arm" is pressed by itself.' if arm else
                'Enter presses the button "arm".' if sys.stdin.isatty() else
                'Nobody presses the button "arm": there is no terminal, and no --arm was given.')
    told.append("Ctrl-C switches it off.")
    return told
