# SPDX-License-Identifier: Apache-2.0
"""A job on a simulated controller, as scenarios drive it: the operator, the tape, and the forces.

Everything goes over the serial line and the pins; probes are only read.
"""

from collections.abc import Callable
from dataclasses import dataclass

from host.link.link import Link
from host.run.events import Scale, is_event, parse
from host.run.simulation import Simulation as Piped
from host.tape.tape import Tape, encode
from testbench.cosim.record import SIGNALS, Record
from testbench.native.station import Session

__all__ = ["HEIGHT_MM", "MM", "PATIENCE_S", "Data", "Job", "program"]

MM = 10_000          # pulses
PATIENCE_S = 3.0     # machine time, longer than any wait of a scenario
LOOK_CLOCKS = 64     # between two looks at a condition
BUTTON_CLOCKS = 100  # one byte of the link takes at most so long
ORDER_CLOCKS = 3000  # a line with number and check takes at most so long
QUIET_GAP_UM = 30.0  # width at which there are discharges, but no shorts
HEIGHT_MM = 0.1      # of the electrode over program Z 0, at the start


@dataclass(frozen=True)
class Data:
    """Retraction data as on a tape: mm/min and mm."""

    speed: float = 600
    limit: float = 0.5
    high: float = 600
    low: float = 120
    changeover: float = 0.05
    ceiling: float | None = None

    def __str__(self):
        words = [f"G36 R{self.speed:g} L{self.limit:g} H{self.high:g} E{self.low:g} "
                 f"Q{self.changeover:g}"]
        return " Z".join([*words, *([f"{self.ceiling:g}"] if self.ceiling is not None else [])])


def program(*blocks: str | Data, condition: int = 100) -> str:
    """A tape's text: machining is on in ``blocks``, in millimetres and absolute."""
    # The dwell is longer than the transfer of the tape: all is read before the machine moves.
    head = ["G21 G90 G94", f"C{condition}", "G04 P60", "M03"]
    return "\n".join(["%", *head, *map(str, blocks), "M05", "M02", "%", ""])


class Job:
    """One controller from switching on: an operator who unlocks it and sets Z 0.

    ``events`` are those of the run (see ``host.run.events``), ``said`` all other lines, ``record``
    the changes of the watched signals. The gap has discharges and no shorts until a force is set.

    Parameters
    ----------
    session : Session
        The controller, switched on.
    lines : str
        Lines entered by hand first: settings and defaults.
    watched : iterable of str
        Probes to record.
    """

    def __init__(self, session: Session, *lines: str, watched=SIGNALS):
        self.session = session
        self.pipe = Piped(session)
        self.link = Link(self.pipe, self._hear)
        self.events: list[dict] = []
        self.said: list[str] = []
        self._scale = Scale(session.clock_hz, MM)
        self.record = Record()
        session.watch(watched)
        session.set("force.short", 0)
        session.set("force.gap_um", QUIET_GAP_UM)
        self.link.await_greeting()
        self.make_ready()
        for line in (f"G92 X0 Y0 Z{HEIGHT_MM}", *lines):
            self.link.command(line)

    def _hear(self, line):
        if is_event(line):
            self.events.append(parse(line, self._scale))
        else:
            self.said.append(line)

    # ---- the operator

    def make_ready(self) -> None:
        """Unlock, arm by hand, and accept the counted position."""
        self.link.command("$X")
        self.pipe.press_arm()
        self.link.command("$POSITION=HERE")

    def start(self, tape: str | Tape) -> None:
        """Send a tape, all of it."""
        rows = (encode(tape) if isinstance(tape, str) else tape).rows
        assert self.link.send_tape(rows, lambda: False)

    def press(self, button: bytes | str) -> None:
        """Press a button of the operator's, a real-time byte or an order, and let it arrive."""
        self.link.press(button)
        self.run(BUTTON_CLOCKS if isinstance(button, bytes) else ORDER_CLOCKS)

    def short(self, on: bool) -> None:
        """Close the gap, or open it again."""
        self.session.set("force.short", int(on))

    # ---- time

    def run(self, clocks: int) -> None:
        """Let ``clocks`` clocks pass."""
        end = self.session.cycle + clocks
        while self.session.cycle < end:
            self.link.poll((end - self.session.cycle) / self.session.clock_hz)

    def until(self, condition: Callable[[], object], what: str, step: int = LOOK_CLOCKS,
              seconds: float = PATIENCE_S) -> None:
        """Run until a condition holds, looked at every ``step`` clocks.

        Raises
        ------
        AssertionError
            If it does not in time; the text has ``what`` and the present state.
        """
        end = self.session.cycle + round(seconds * self.session.clock_hz)
        while not condition():
            assert self.session.cycle < end, f"{what} did not come; {self._standing()}"
            self.link.poll(step / self.session.clock_hz)

    def reach(self, coordinate: int, clocks_per_pulse: float, backward: bool = False) -> None:
        """Run until exactly the clock in which the path is at a coordinate.

        The approach is at most at this speed.
        """
        sign = -1 if backward else 1
        end = self.session.cycle + round(PATIENCE_S * self.session.clock_hz)
        while (left := sign * (coordinate - self.probe("path_position"))) > 0:
            assert self.session.cycle < end, (
                f"path coordinate {coordinate} was not reached; {self._standing()}")
            self.run(max(1, int((left - 1) * clocks_per_pulse)))

    def wait(self, event: str, count: int = 1, *, seconds: float = PATIENCE_S, **fields) -> dict:
        """Run until there are ``count`` such events; return the last one."""
        self.until(lambda: len(self.told(event, **fields)) >= count, f"{event} {fields}",
                   step=2000, seconds=seconds)
        return self.told(event, **fields)[count - 1]

    def finish(self) -> None:
        """Run to the end of the program.

        Raises
        ------
        AssertionError
            If an alarm ends it, or it does not end.
        """
        self.until(lambda: self.told("program_end") or self.told("alarm"), "the end", step=10_000)
        assert not self.told("alarm"), self.told("alarm")
        self.collect()

    def alarm(self, seconds: float = PATIENCE_S) -> dict:
        """Run to the only alarm, and return it; its line must have the same code."""
        self.wait("alarm", seconds=seconds)
        self.run(20_000)
        alarms = self.told("alarm")
        assert len(alarms) == 1, alarms
        assert f"ALARM:{alarms[0]['code']}" in self.said
        self.collect()
        return alarms[0]

    # ---- what is seen

    def probe(self, name: str) -> int:
        """Present value of a probe."""
        return self.session.probe(name)

    def told(self, event: str, **fields) -> list[dict]:
        """Events of a name with these fields."""
        return [one for one in self.events
                if one["event"] == event and all(one[key] == fields[key] for key in fields)]

    def collect(self) -> Record:
        """Add the latest changes of the watched signals to the record."""
        self.record.extend(self.session.changes())
        return self.record

    def _standing(self):
        names = ("path_status_state", "path_position", "path_command", "safety_latched")
        return (f"{ {name: self.probe(name) for name in names} }, "
                f"events {[one['event'] for one in self.events[-5:]]}, said {self.said[-3:]}")
