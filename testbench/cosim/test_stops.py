# SPDX-License-Identifier: Apache-2.0
"""`!` and Ctrl-X stop the whole simulated controller, after any part of any line or frame."""

import pytest

from host.link.framing import frame, frames, numbered
from host.link.link import HOLD, RESET
from host.machines import machine as machines
from testbench.native.simulation import Simulation
from testbench.native.station import Session

MACHINE = machines.load("sinker")
DIVISOR = 8                             # clocks per bit: softcore.top.SIMULATED_DIVISOR
MIDDLE = 9 * DIVISOR + DIVISOR // 2     # of the stop bit, in clocks from the start bit's first
PADS = 3                                # clocks from a pin to the gateware
REACTION = 8                            # clocks from there
PATIENCE = 1_000_000
CLOSER = frame(1, 77, b"A")             # refused, and so the end of whatever frame is open
WATCHED = ("pp", "gap_on", "axis_x_command")


class Cut:
    """A controller in a long cut along X, at the start/stop speed: pulses are closest there."""

    def __init__(self, session: Session):
        self.session, self.number = session, 0
        self.heard = bytearray()
        self.changes: list[tuple[int, str, int]] = []
        session.watch(WATCHED)
        session.set("force.short", 0)
        session.set("force.gap_um", 30.0)
        self.until(b"Grbl ")

    def until(self, text: bytes) -> None:
        """Wait for something to be said."""
        end = self.session.cycle + PATIENCE
        while text not in self.heard:
            assert self.session.cycle < end, f"{text} did not come: {bytes(self.heard[-200:])}"
            self.heard += self.session.receive(2000)
        self.heard.clear()

    def enter(self, line: str) -> None:
        """Send a line, and wait for its answer."""
        self.session.send(numbered(self.number, line))
        self.until(b"ok @%d\r\n" % self.number)
        self.number += 1

    def begin(self) -> None:
        """Begin to cut, from a reset on."""
        self.number = 0
        self.enter("$X")
        self.session.press_arm()
        for line in ("$POSITION=HERE", "G91 G94 F600", "C100", "M03", "G01 X100"):
            self.enter(line)

    def moves(self) -> None:
        """Wait for it to go on."""
        before, end = self.session.probe("path_command"), self.session.cycle + PATIENCE
        while self.session.probe("path_command") <= before + 20:
            assert self.session.cycle < end, "it stands still"
            self.session.run(1000)

    def stop(self, prefix: bytes, byte: bytes) -> int:
        """Send a prefix and a stop, and go on; the clock that sees the middle of its stop bit."""
        self.session.send(prefix + byte)
        middle = self.session.cycle + 1 + 10 * DIVISOR * len(prefix) + MIDDLE + PADS
        self.session.run(middle + 600 - self.session.cycle)
        self.changes = self.session.changes()
        return middle

    def last(self, name: str) -> int:
        """Clock in which a signal was high last."""
        falls = [clock for clock, signal, value in self.changes if signal == name and not value]
        assert falls
        assert [value for _, signal, value in self.changes if signal == name][-1] == 0
        return falls[-1] - 1


def prefixes():
    """Every part of every kind of frame and line."""
    _, tape = zip(*frames(b"\nG00 X1\n\x02\x10\x18!?~" + bytes(range(0x8C, 0xCC))), strict=True)
    pieces = [*tape, frame(0xFE, 9), numbered(65535, "X-.5 (A)"), numbered(7, "$RESUME"),
              b"G00 X1\r\n", b"\x80\xc3(", b"\x02\x02", b"\x10"]
    return sorted({piece[:length] for piece in pieces for length in range(len(piece) + 1)})


SOME = pytest.param(19, id="some")
ALL = pytest.param(1, id="all", marks=pytest.mark.soak)


@pytest.mark.parametrize("step", [SOME, ALL])
@pytest.mark.parametrize("byte", [HOLD, RESET], ids=["hold", "reset"])
def test_stops_within_8_clocks_after_every_prefix(byte, step):
    """Time from the middle of the stop bit to the last path pulse; Ctrl-X ends the discharge too.

    The sensing source watches for contact until the axes have come to rest. Then firmware does
    its part: `?` is answered, and the machine goes on when it is told to.
    """
    tried = prefixes()
    assert len(tried) > 200
    tried = tried[::step]
    latest = {}
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        cut = Cut(session)
        cut.begin()
        for prefix in tried:
            cut.moves()
            middle = cut.stop(prefix, byte)
            for name in ("pp",) if byte == HOLD else ("pp", "gap_on"):
                latest[name] = max(latest.get(name, 0), cut.last(name) - middle)
                assert cut.last(name) - middle <= REACTION, (prefix, name)
            if byte == HOLD:
                session.send(b"?" + CLOSER + b"\n")
                cut.until(b"<Hold:")
                session.run(4000)
                cut.enter("$RESUME")
            else:
                cut.until(b"Grbl ")
                session.send(b"?")
                cut.until(b"<Alarm|")
                assert not session.probe("power_control_machining")
                cut.begin()
    assert "pp" in latest
