# SPDX-License-Identifier: Apache-2.0
"""A simulated machine whose time goes much slower than that of the program that sends a tape."""

import re

from host.link.framing import frames
from host.link.link import Link
from host.machines import machine as machines
from host.tape.tape import encode
from testbench.native.simulation import Simulation

SINKER = machines.load("sinker")
BLOCKS = [f"G01 X{number / 100:.2f} Y{number / 300:.3f} F60" for number in range(60)]
TAPE = encode("\n".join(["%", "G21 G90", *BLOCKS, "M02", "%", ""])).rows


class Slow:
    """The line of a machine of which a second of the sender takes ``share`` seconds."""

    def __init__(self, session, share):
        self.session, self.share = session, share
        self.now, self.marks = 0.0, bytearray()

    def write(self, data):
        self.session.send(data)

    def read(self, timeout_s):
        start = self.session.cycle
        most = max(1, round(timeout_s * self.share * self.session.clock_hz))
        data = self.session.receive(most)
        self.now += (self.session.cycle - start) / self.session.clock_hz / self.share
        self.marks += data
        return data

    def time_s(self):
        return self.now


def test_a_tape_arrives_at_a_twentieth_of_real_time():
    """Frames that came again and again, as their answers were late, overran the receiver."""
    with Simulation(machine=SINKER.tables, clock_hz=SINKER.clock_hz, seed=1, trace=False) as on:
        on.run(on.clock_hz // 10)
        line = Slow(on, 1 / 20)
        link = Link(line, lambda said: None)
        link.poll(0.5)      # the greeting
        link.command("$X")
        assert link.send_tape(TAPE, lambda: False)
    taken = re.findall(rb"\x06.", line.marks, re.DOTALL)
    assert len(set(taken)) == len(list(frames(TAPE)))
    assert len(taken) <= 2 * len(set(taken)), "each frame comes at most once more"
    assert b"\x15" not in re.sub(rb"\x06.", b"", line.marks, flags=re.DOTALL), "one was damaged"
