# SPDX-License-Identifier: Apache-2.0
"""The panel without its page: one controller, what it says, and the orders of one page.

A thread of its own speaks with the controller. Pages call ``order`` and ``seen``, and read
``heard`` while they hold ``lock``. Nothing here knows of a browser.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from host.errors import UserError
from host.link.link import HOLD, RESET, RESUME, RETRACT, STATUS, Link, LinkError, RefusedError, Sent
from host.machines.machine import Machine
from host.panel.by_hand import ByHand
from host.panel.heard import Heard, on_beginning
from host.panel.job import Job
from host.panel.orders import BEGIN, MEASURING, ORDERS, TOUCHING, Moment, why_not
from host.panel.scoping import Scoping
from host.panel.sharing import LEASE_S, Jog, Sharing
from host.panel.touching import Touching
from host.panel.tuning import Tuning
from host.panel.wires import Wire
from host.run.events import Scale

__all__ = ["CANCEL", "ORDERS", "Session"]

SAMPLE_S = 0.1      # between two status reports
POLL_S = 0.01
MODES_S = 2.0       # between two questions for the modal words
STOP_S = 3.0        # longest wait for rest between the hold and the reset of a stop
SILENT_S = 3.0      # without a status report the connection is lost
CANCEL = b"\x85"    # grbl's byte that cancels a jog
_WATCHES = "This page only watches: take the controls first."
_REST = ("", "Hold:0", "Idle", "Alarm")
_OWN = "$G"         # asked by the panel itself: a refusal is not told


class Session:
    """A connection to one controller, shared by several pages.

    Parameters
    ----------
    machine : Machine
        The machine that the controller moves.
    connect : callable
        Called with a function that takes sentences on the progress; returns the open connection.
        Failures are ``UserError``.
    clock : callable
        The computer's time in seconds.

    ``link`` says how the connection is: ``starting``, ``connected`` or ``lost``. ``notices`` are
    sentences for everybody, with the time of each; ``notice`` is the newest.
    """

    def __init__(self, machine: Machine, connect: Callable[[Callable[[str], None]], Wire],
                 clock: Callable[[], float] = time.monotonic) -> None:
        self.machine, self._connect, self._clock = machine, connect, clock
        self.lock = threading.RLock()
        self.sharing = Sharing(clock)
        self.scope = Scoping()
        self.heard = Heard(Scale(machine.clock_hz, machine.pulses_per_mm))
        self.job: Job | None = None
        self.link = "starting"
        self.notices: deque[tuple[float, str]] = deque(maxlen=200)
        self.running = False        # a tape has been begun and has not ended
        self.simulated = False
        self.offset: float | None = None    # contact offset, mm, if a touch has calibrated it
        self.tuning: Tuning | None = None   # the last measurement of the drives
        self._thread: threading.Thread | None = None
        self._over = threading.Event()
        self._again = threading.Event()     # connect anew
        self._forget()

    def _forget(self) -> None:
        """Forget what belonged to the last connection."""
        self._orders: deque[tuple[str, str, tuple[Any, ...]]] = deque()
        self._hand = ByHand()
        self._sent: Sent | None = None
        self._sent_said = ""        # the controller's message since that line was sent
        self._before: tuple[int, str] | None = None     # the alarm in force when it was sent
        self._jog: tuple[str, Jog] | None = None     # its page, and the jog
        self._touch: tuple[str, Touching] | None = None     # its page, and the cycle
        self._lift_s = 0.0      # until when a finger counts as one that was refused
        self._tuner = ""        # the page that has begun to measure the drives, until it is done
        self._of_scope = False      # that line is the oscilloscope's
        self.scope.forget()
        self._start = ""            # block at which the tape is to begin; empty: not yet
        self._stop_s: float | None = None   # machine's time when the stop was pressed
        self._asked_s = self._modes_s = self._report_s = self._clock()
        self.running = False

    # ---- for the pages

    @property
    def notice(self) -> str:
        """The newest sentence."""
        return self.notices[-1][1] if self.notices else ""

    @property
    def pace(self) -> str:
        """How fast a simulated machine's time goes, if it cannot keep up; else nothing."""
        return self._wire.pace if self.link == "connected" else ""

    def seen(self, page: str) -> None:
        """Note that a page is there; call it once a second."""
        with self.lock:
            self.sharing.seen(page)

    def gone(self, page: str) -> None:
        """Note that a page has gone: its jog ends, and it lets go of the controls."""
        with self.lock:
            self.sharing.gone(page)

    def take(self, page: str) -> bool:
        """Give a page the controls, if nobody has them; return whether it has."""
        with self.lock:
            return self.sharing.take(page)

    def let_go(self, page: str) -> None:
        """Take the controls from a page."""
        with self.lock:
            self.sharing.let_go(page)

    def order(self, page: str, name: str, *words: Any) -> str:
        """Order something: one of ``ORDERS``. Return why it cannot be, or nothing.

        ``line`` has a text, ``jog`` an axis, a way (1 or -1) and a feed in mm/min, ``choose`` a
        ``Job``, ``run`` the first block or ``LAST``, ``touch`` and ``tune`` one of their objects,
        ``scope`` a ``Trigger`` and whether to go on; the others have none. ``notices`` tell what is
        refused.
        """
        with self.lock:
            if self.sharing.holder != page:
                return _WATCHES
            if name == "connect":
                self._again.set()
                return ""
            why = self._why_not(name, words)
            if name == "jog":   # a finger that was refused must be lifted before it moves anything
                now = self._clock()
                if why or now < self._lift_s:
                    self._lift_s = now + LEASE_S
                    why = why or "Release the button, and press it again."
            elif name == "jog_end":
                self._lift_s = 0.0
            if not why:
                if name == "choose":
                    self.job = words[0]
                    self.heard.scale = Scale(self.heard.scale.clock_hz, self.machine.pulses_per_mm,
                                             self.job.tape.line, self.job.tape.told)
                else:
                    self._orders.append((page, name, words))
            return why

    def pending(self, line: str) -> bool:
        """Whether a line that a page has ordered is still on its way; see ``ByHand.pending``."""
        with self.lock:
            return self._hand.pending(line) or any(
                name == "line" and words[0].upper() == line for _, name, words in self._orders)

    def _why_not(self, name: str, words: tuple[Any, ...]) -> str:
        if self.link != "connected":
            return "There is no connection to the controller."
        ordered = {one for _, one, _ in self._orders}
        touches = self._touch is not None or "touch" in ordered
        moment = Moment(
            heard=self.heard, job=self.job, running=self.running, simulated=self.simulated,
            busy=MEASURING if self._tuner else TOUCHING if touches else "",
            begins=bool(self._start or ordered.intersection(BEGIN)), waiting=len(self._hand))
        return why_not(name, words, moment)

    # ---- the thread

    def start(self) -> None:
        """Begin to connect, in a thread of its own."""
        self._thread = threading.Thread(target=self._live, name="panel", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Hold the machine, leave the controller to whoever comes next, and end the thread.

        A start that is under way, with its compilers, is not waited for: nothing moves yet.
        """
        self._over.set()
        if self._thread is not None:
            self._thread.join(1.0 if self.link == "starting" else None)

    def tell(self, text: str) -> None:
        """Tell every page a sentence."""
        with self.lock:
            self.notices.append((self._clock(), f"{text[:1].upper()}{text[1:]}"))

    def _live(self) -> None:
        while not self._over.is_set():
            self._again.clear()
            try:
                self._connection()
            except UserError as error:
                self.tell(str(error))
            except Exception as error:  # a fault of this program: the page must not show a picture
                self.tell(f"unexpected failure, {type(error).__name__}: {error}")
            with self.lock:
                self.link = "lost"
            while not self._over.is_set() and not self._again.wait(0.1):
                pass

    def _connection(self) -> None:
        with self.lock:
            self.link = "starting"
            self._forget()
        wire = self._connect(self.tell)
        try:
            self._wire = wire
            self._controller = Link(wire, self._hear)
            self._set_up(wire)
            while not self._over.is_set() and not self._again.is_set():
                self._pass()
                if self._start and self._sent is None:
                    self._send_tape()
                if self._tuner and self._sent is None:
                    self._measure()
                self._controller.poll(POLL_S)
        finally:
            with suppress(UserError):
                self._leave(wire)
            wire.close()

    def _leave(self, wire: Wire) -> None:
        """Hold whatever moves, wait for rest, and leave the controller to whoever comes next."""
        self._end_jog()
        end = wire.time_s() + STOP_S
        if self.heard.state not in _REST:
            self._controller.press(HOLD)
            while self.heard.state not in _REST and wire.time_s() < end:
                self._controller.realtime(STATUS)
                self._controller.poll(SAMPLE_S)
        self._controller.press(RESET)
        wire.read(POLL_S)   # a simulated line takes its time

    def _set_up(self, wire: Wire) -> None:
        """Begin as ``gapkeeper run`` does; a real machine keeps its lock, its place, its values."""
        with self.lock:
            scale = self.heard.scale
            self.heard = Heard(Scale(wire.clock_hz, scale.pulses_per_mm, scale.source, scale.told))
            self.simulated = wire.simulated
        self._controller.await_greeting()
        if wire.simulated:
            for line in ("$X",
                         *(f"${number}={value}" for number, value in self.machine.settings.items()),
                         "$POSITION=HERE", self.machine.start_line):
                self._controller.command(line)
        self._controller.command("$$")
        with self.lock:
            self._report_s = self._clock()
            self.link = "connected"
        self.tell("connected: " + ("a simulated machine stands at its start." if wire.simulated
                                   else "unlock, and declare the position, before any motion."))

    def _send_tape(self) -> None:
        begin, self._start = self._start, ""
        assert self.job is not None
        try:
            if begin != "1":
                self._controller.command(f"$FROM={begin.upper()}")
        except RefusedError as error:
            self.tell(str(error))
            return
        with self.lock:
            self.running, self.heard.ended = True, ""
        self._controller.send_tape(self.job.tape.rows, self._interrupted)

    def _measure(self) -> None:
        assert self.tuning is not None
        try:
            self.tuning.run(self._controller, self._measures_on)
        except UserError as error:
            with self.lock:     # perhaps not every setting could be put back
                self.heard.settings, self.heard.unlisted = {}, True
            self.tell(str(error))
        finally:
            self._tuner = ""

    def _measures_on(self) -> bool:
        """Do what has to be done in a measurement; return whether it may go on."""
        self._pass()
        return (self.sharing.holder == self._tuner and self._stop_s is None
                and not self._over.is_set() and not self._again.is_set())

    def _interrupted(self) -> bool:
        self._pass()
        return not self.running or self._over.is_set() or self._again.is_set()

    def _pass(self) -> None:
        """Do all that has to be done now; waits for nothing."""
        with self.lock:
            now = self._clock()
            if now - self._asked_s >= SAMPLE_S:
                self._asked_s = now
                self._controller.realtime(STATUS)
            if now - self._report_s > SILENT_S:
                raise LinkError("the controller has fallen silent.")
            while self._orders:
                self._carry_out(*self._orders.popleft())
            self._tend_hand(now)
            self._tend_stop(self._wire.time_s())
            self._tend_jog()
            self._tend_touch()
            self._tend_lines(now)
            if self.running and self.heard.ended:
                self.running = False
                self.tell(self.heard.ending)

    def _carry_out(self, page: str, name: str, words: tuple[Any, ...]) -> None:
        if name == "hold":
            self._end_jog()
            self._controller.press(HOLD)
        elif name == "resume":
            self._controller.press(RESUME)
            if not self.running and self._touch is None and not self._tuner:
                self._hand.moves(page)
        elif name == "retract":
            self._controller.press(RETRACT)
        elif name == "stop":
            self._end_jog()
            self._hand.clear()
            self._touch = None
            self._start = self._tuner = ""
            self._controller.press(HOLD)
            self._stop_s = self._wire.time_s()
            self.tell("stop: the feed is held; the program ends as soon as the axes rest.")
        elif name == "line":
            self._hand.add(words[0].upper(), page)
        elif name == "jog":
            if self._jog is not None and self._jog[0] == page and self._jog[1].renew(*words):
                return
            self._end_jog()
            self._jog = page, Jog(*words, clock=self._clock, machine_s=self._wire.time_s)
        elif name == "jog_end":
            self._end_jog()
        elif name == "run":
            self._start = str(words[0] if words else 1)
        elif name == "arm":
            self._wire.arm()
        elif name == "touch":
            self._touch = page, words[0]
        elif name == "tune":
            self._tuner, self.tuning = page, words[0]
        elif name == "scope":
            self.scope.arm(words[0], again=words[1])
        elif name == "scope_stop":
            self.scope.stop()
        elif name == "scope_force":
            self.scope.force()

    def _tend_stop(self, now: float) -> None:
        if self._stop_s is None:
            return
        waited = now - self._stop_s     # the first report may be older than the hold
        rests = waited > 3 * SAMPLE_S and self.heard.state in _REST
        if rests or waited > STOP_S:
            self._stop_s = None
            self._controller.press(RESET)
            if self._sent is not None:
                self.heard.answered(self._sent.text, self._sent.answer)
                self._sent = None
            self.scope.lost()
            if self.running:
                self.running = False
                self.heard.ended = "stopped"
                self.tell(self.heard.ending)

    def _tend_hand(self, now: float) -> None:
        """Hold what a page moves that has let go, drop what it has not sent; tell refusals."""
        if self._hand.jogs not in ("", self.sharing.holder):
            self._end_jog()     # nobody looks any more at what was typed
        lines, moves = self._hand.left(self.sharing.holder)
        if lines:
            self.tell("not sent, as the page has let go of the controls: " + "; ".join(lines))
        if moves and not self.running:
            self._controller.press(HOLD)
            self.tell("the machine is held: the page that moved it has let go of the controls.")
        if refusal := self._hand.refusal(self.heard.alarm, now):
            self.tell(refusal)

    def _tend_jog(self) -> None:
        if self._jog is None:
            return
        page, jog = self._jog
        if jog.over or self.sharing.holder != page:
            self._end_jog()
        elif self._sent is None and not self._hand and (line := jog.segment()):
            self._send(line)

    def _end_jog(self) -> None:
        if self._jog is not None or self._hand.jogs:
            self._jog, self._hand.jogs = None, ""
            self._controller.realtime(CANCEL)

    def _tend_touch(self) -> None:
        """Go on with a touching cycle, or hold it if the page that began it has let go."""
        if self._touch is None:
            return
        page, touching = self._touch
        if self.sharing.holder != page:
            self._touch = None
            self._controller.press(HOLD)
            self.tell("touching is held: the page that began it has let go of the controls.")
        elif self._sent is None and not self._hand:
            try:
                line = touching.line()
            except UserError as error:
                self._touch = None
                self.tell(str(error))
                return
            if line is not None:
                self._send(line)
            elif touching.over:
                self._touch = None
                said, zero = touching.ending()
                self.tell(said)
                self.offset = touching.offset if touching.offset is not None else self.offset
                for line in zero:
                    self._hand.add(line, page)

    def _tend_lines(self, now: float) -> None:
        sent = self._sent
        if sent is not None:
            if sent.answer is None:
                return
            self._sent = None
            self._answered(sent)
            if self._touch is not None:
                return      # the next line is the cycle's
        if self._hand:
            self._send(self._hand.take())
        elif self._jog is not None or self._stop_s is not None:
            return
        elif self.heard.unlisted and self._touch is None and not self._tuner:
            self._send("$$")
        elif now - self._modes_s > MODES_S:
            self._modes_s = now
            self._send(_OWN)
        elif (line := self.scope.line(now)) is not None:
            self._send(line)
            self._of_scope = True

    def _send(self, line: str) -> None:
        self._of_scope = False
        self._sent_said, self._before = "", self.heard.alarm
        self._sent = self._controller.send_line(line)

    def _answered(self, sent: Sent) -> None:
        assert sent.answer is not None
        if self._of_scope:
            self.scope.answered(sent.answer, self._sent_said, self._clock())
            return
        self._hand.answered()
        self.heard.answered(sent.text, sent.answer)
        if sent.answer == "ok":
            if self._touch is None and not sent.text.startswith(("$J=", "$$", _OWN)):
                self.tell(f"{sent.text}: ok")
            return
        if sent.text.startswith("$J="):
            self._jog = None
        if sent.text != _OWN:
            self._hand.refused(sent.text, sent.answer, self._sent_said, self._before, self._clock())
            if self._touch is not None:
                self._touch = None      # nothing more of a cycle whose line is refused

    def _hear(self, line: str) -> None:
        with self.lock:
            if self.scope.hear(line):
                return
            before = self.heard.starts
            volts = None
            if line.startswith("<"):
                self._report_s = self._clock()
                volts = self._wire.voltage()
            if self._touch is not None:
                self._touch[1].hear(line)
            if line.startswith("[MSG:"):
                self._sent_said = line[5:-1]
                if begins := on_beginning(self._sent_said):
                    self.tell(begins)
            self.heard.hear(line, self._wire.time_s(), volts)
            if line.startswith("ALARM:") and (lines := self._hand.overtaken()):
                self.tell("not sent, as an alarm came: " + "; ".join(lines))
            if line.startswith("<"):
                self._hand.report(self.heard.state)
            if self.heard.starts != before and self.running:
                self.running, self.heard.ended = False, "stopped"
