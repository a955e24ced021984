# SPDX-License-Identifier: Apache-2.0
"""A person at a terminal: plain lines and single bytes on the line of a simulated controller.

Lines are not numbered, checked or sent again: the controller gets whatever the line makes of a
byte.
"""


from testbench.cosim.record import WATCHDOG, Record
from testbench.native.station import Session

__all__ = ["Terminal"]

PATIENCE_S = 2.0
AGAIN = b"\x15"


class Terminal:
    """A controller, switched on and unlocked, with its machine in a gap that burns.

    ``lines`` are those that it has sent.

    Parameters
    ----------
    session : Session
        The controller, switched on.
    watched : iterable of str
        Probes to record, beside the watchdog's calls.
    """

    def __init__(self, session: Session, watched=()):
        self.session = session
        self.lines: list[str] = []
        self._open = bytearray()
        self.changes: list[tuple[int, str, int]] = []
        session.watch([*WATCHDOG, *watched])
        session.set("force.short", 0)
        session.set("force.gap_um", 30.0)
        self.until("Grbl ")
        self.enter("$X")
        session.press_arm()
        self.enter("$POSITION=HERE")

    def take(self, clocks: int) -> None:
        """Let time pass, and collect the lines that come."""
        for byte in self.session.receive(clocks):
            if self._open[:1] == AGAIN:
                self._open.clear()  # an answer to a frame ends with its sequence number
                continue
            self._open.append(byte)
            if byte == 0x0A:
                self.lines.append(self._open.decode("ascii").strip())
                self._open.clear()
        self.changes += self.session.changes()

    def run(self, seconds: float) -> list[str]:
        """Let so much time pass; return the lines that came meanwhile."""
        count, end = len(self.lines), self.session.cycle + round(seconds * self.session.clock_hz)
        while self.session.cycle < end:
            self.take(min(20_000, end - self.session.cycle))
        return self.lines[count:]

    def until(self, start: str) -> str:
        """Wait for a line that starts so."""
        end = self.session.cycle + round(PATIENCE_S * self.session.clock_hz)
        count = len(self.lines)
        while True:
            for line in self.lines[count:]:
                if line.startswith(start):
                    return line
            assert self.session.cycle < end, f"{start} did not come: {self.lines[-3:]}"
            count = len(self.lines)
            self.take(2000)

    def enter(self, line: str) -> None:
        """Type a line that must be accepted."""
        self.session.send(line.encode("latin-1") + b"\n")
        assert self.until(("ok", "error")) == "ok", (line, self.lines[-2:])

    def answers(self, since: int = 0) -> list[str]:
        """Answers to lines."""
        return [line for line in self.lines[since:] if line.startswith(("ok", "error"))]

    def watched_well(self) -> None:
        """Check that the watchdog was called in good time, and has not tripped."""
        record = Record()
        record.extend(self.changes)
        record.watched_well(self.session.clock_hz)
