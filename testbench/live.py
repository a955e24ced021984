# SPDX-License-Identifier: Apache-2.0
"""A controller that runs in a thread of this program, and clients that connect to it."""

import threading
import time
from contextlib import contextmanager

from host.link.serve import Tcp
from host.run import simulation
from host.run.live import Live

__all__ = ["Client", "serving", "switched_on"]

BOOTED_S = 0.3      # of the machine's time, from power-on


@contextmanager
def serving(machine, line=None, **options):
    """Run ``machine`` during the block; yield its URL, and the messages about clients.

    Clients reach it by ``line``, which is closed at the end, or else by TCP. A failure of the
    thread is raised at the end of the block, whatever else went wrong in it.
    """
    said, failures, over = [], [], threading.Event()
    line = line or Tcp("127.0.0.1", 0, said.append)
    live = Live(machine, line, said.append, **options)

    def go_on():
        try:
            while not over.is_set():
                live.step()
        except Exception as error:  # whatever it is, the block raises it at its end
            failures.append(error)

    thread = threading.Thread(target=go_on)
    thread.start()
    try:
        yield line.url, said
    finally:
        over.set()
        thread.join()
        line.close()
        if failures:
            raise failures[0]


@contextmanager
def switched_on(machine):
    """A simulated machine, just switched on; yield the URL of its controller, and the machine."""
    begun = simulation.start(machine, clock_hz=machine.clock_hz, seed=1, waves=None, trace=False,
                             progress=print)
    try:
        with serving(begun, arm=True, clock=begun.time_s) as (url, _):
            while begun.time_s() < BOOTED_S:
                time.sleep(0.01)
            yield url, begun
    finally:
        begun.close()


class Client:
    """Lines over a port, as a program without our link would send them."""

    def __init__(self, port):
        self.port = port
        self.text = ""

    def send(self, text):
        self.port.write(text.encode("latin-1"))

    def lines_until(self, enough, seconds=20.0):
        """Lines that come until ``enough(lines)``; the last one is complete."""
        end = self.port.time_s() + seconds
        while self.port.time_s() < end:
            self.text += self.port.read(0.05).decode("ascii")
            whole, _, rest = self.text.rpartition("\n")
            lines = [line.strip() for line in whole.split("\n")] if whole else []
            if enough(lines):
                self.text = rest
                return lines
        raise TimeoutError(f"within {seconds} s it says no more than {self.text!r}")

    def ask(self, text):
        """Send a line; return all lines up to its answer."""
        self.send(text + "\n")
        return self.lines_until(lambda lines: any(
            line.strip() == "ok" or line.startswith("error:") for line in lines))
