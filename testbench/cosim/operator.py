# SPDX-License-Identifier: Apache-2.0
"""Scenario: an operator who does anything at any time, and a model of what may move.

The model knows every order that was sent, and nothing of the firmware. An order lets each axis go
so far from where it stood when the machine last had nothing to do; orders add up until the machine
has nothing to do again. At every look

* no axis is commanded beyond its soft limits, nor further than the orders let it go;
* nothing is commanded to move without an order, in a hold at rest, or some time after a reset, a
  hold, or the cancel of a jog;
* an axis at rest stands where the controller says, unless it says that its position is lost.

A retraction, a walk and a short may lead back along the path, which is within the places where the
axes have been since an alarm, and straight up.

After every few acts the operator resets the machine and unlocks it: then a jog must end exactly
where it was sent to.
"""

import random
from collections import Counter, deque
from dataclasses import dataclass

from host.link.link import GREETING, HOLD, RESET, RESUME, RETRACT, Link, RefusedError, Sent
from host.run.simulation import Simulation as Piped
from host.tape.tape import encode
from softcore.tables.settings import assign
from softcore.tables.states import MOTION
from testbench.cosim.job import MM, Job
from testbench.native.station import Session

__all__ = ["JOG_CANCEL", "FaultError", "Operator", "operate"]

AXES = "xyz"
LIMIT_MM = 2.0          # soft limit of every axis, on both sides of the start
SLICE_S = 0.004         # between two looks
ASK_S = 0.06            # between two questions to a controller at rest, which take it 5 ms each
REST_S = 0.04           # without any command: nothing is commanded
SETTLED_S = 0.25        # then the axes have come to rest: e-fold of the loop 20 ms
STOPS_S = 0.4           # from a reset, a hold or a cancel until nothing is commanded to move
SETTLED = 2             # pulses that an axis at rest may be off
JOG_CANCEL = b"\x85"
UP = AXES.index("z")
FRONT, = (state.number for state in MOTION if state.name == "front")
DATA = "G36 R600 L0.5 H600 E120 Q0.05"
CALM_S = 1.0            # from a short of at most 0.03 s until its retraction is over
OVERRIDES = (b"\x90", b"\x91", b"\x92", b"\x93", b"\x94", b"\x95", b"\x96", b"\x97")


class FaultError(AssertionError):
    """The machine has done what it must not.

    ``kind`` is ``limit``, ``unasked``, ``held``, ``reset``, ``stop``, ``place`` or ``stuck``.
    """

    def __init__(self, kind: str, text: str):
        super().__init__(f"{kind}: {text}")
        self.kind = kind


class Cable:
    """A pipe whose cable can be pulled, in the middle of a line too."""

    def __init__(self, pipe: Piped):
        self.pipe = pipe
        self.left: int | None = None    # bytes that still get through; None: all

    def write(self, data: bytes) -> None:
        """Send what gets through."""
        if self.left is not None:
            data, self.left = data[:self.left], max(0, self.left - len(data))
        if data:
            self.pipe.write(data)

    def read(self, timeout_s: float) -> bytes:
        """Run; with the cable pulled nothing comes."""
        data = self.pipe.read(timeout_s)
        return b"" if self.left == 0 else data

    def time_s(self) -> float:
        """Time of the machine."""
        return self.pipe.time_s()


@dataclass
class Order:
    """A line or tape, and how far it may take each axis down and up, in pulses."""

    sent: Sent | None
    low: list[int]
    high: list[int]
    jog: bool = False

    @property
    def refused(self) -> bool:
        return self.sent is not None and (self.sent.answer or "").startswith("error")


def reach(*moves: list[int]) -> tuple[list[int], list[int]]:
    """How far moves in a row take each axis down and up at most."""
    low, high, at = [0] * 3, [0] * 3, [0] * 3
    for move in moves:
        for axis in range(3):
            at[axis] += move[axis]
            low[axis], high[axis] = min(low[axis], at[axis]), max(high[axis], at[axis])
    return low, high


class Operator:
    """One machine, and everything that was done to it."""

    def __init__(self, session: Session, rng: random.Random):
        self.session, self.rng = session, rng
        limits = [assign(f"{end}_{axis}_um", round(LIMIT_MM * 1000))
                  for end in ("low", "high") for axis in AXES]
        self.job = Job(session, *limits, DATA, watched=())
        self.cable = Cable(self.job.pipe)
        self.log: deque[str] = deque(["started"], maxlen=60)
        self.acts: Counter[str] = Counter()
        self.orders: list[Order] = []
        self.back = False               # something was done that may lead back along the path
        self.base = self.commands()     # when the machine last had nothing to do
        self.last = list(self.base)
        self.low, self.high = list(self.base), list(self.base)     # where the path may be
        self.calm_at = 0                # from here on no retraction for a short is under way
        self.still_since = session.cycle
        self.held: list[int] | None = None  # in a hold, at rest
        self.reset_at: int | None = None
        self.stop_at: int | None = None     # a hold or a cancel, and nothing was ordered since
        self.greets = False             # the greeting after a reset is still to come
        self.moved = 0
        self.limit = LIMIT_MM
        self.latched = False
        self.unlocks: Sent | None = None    # the last unlocking
        self.ask_at = 0
        self._connect()

    # ---- the line

    def _connect(self):
        """Begin anew on the line, as a host that was started again."""
        self.cable.left = None
        self.link = Link(self.cable, self._hear)
        self.link.realtime(RESET)
        self._was_reset()
        self.link.await_greeting()

    def _hear(self, line):
        self.greets = self.greets and not line.startswith(GREETING)
        if f"  < {line}" != self.log[-1]:   # the same status again says nothing
            self.log.append(f"  < {line}")

    def _was_reset(self):
        self.reset_at = self.session.cycle
        self.held = self.stop_at = None

    def _seconds(self, clocks):
        return clocks / self.session.clock_hz

    def commands(self) -> list[int]:
        """Commanded place of each axis in the machine frame, in pulses."""
        return [self.session.probe(f"axis_{axis}_command") for axis in AXES]

    # ---- time, and what is looked at

    def pass_time(self, seconds: float) -> None:
        """Let time pass, and look all the while."""
        end = self.session.cycle + round(seconds * self.session.clock_hz)
        while self.session.cycle < end:
            until = min(end, self.session.cycle + round(SLICE_S * self.session.clock_hz))
            while self.session.cycle < until:
                self.link.poll(self._seconds(until - self.session.cycle))
            self.look()

    def look(self) -> None:
        """Compare the axes with what may move."""
        now = self.commands()
        latched = self.session.probe("safety_latched")
        if latched or self.latched:
            # The drives are off, and the axes coast. The command becomes their place afterwards.
            self.last, self.still_since = now, self.session.cycle
            self._nothing_to_do()
            self._forget_path()
            self.reset_at = self.stop_at = None
        self.latched = bool(latched)
        if now != self.last:
            self.moved += sum(abs(a - b) for a, b in zip(now, self.last, strict=True))
            self.last, self.still_since = now, self.session.cycle
        self.low, self.high = list(map(min, self.low, now)), list(map(max, self.high, now))
        low, high = list(self.base), list(self.base)
        for order in self.orders:
            if not order.refused:
                low = [a + b for a, b in zip(low, order.low, strict=True)]
                high = [a + b for a, b in zip(high, order.high, strict=True)]
        if self.back:
            low, high = list(map(min, low, self.low)), list(map(max, high, self.high))
            high[UP] = round(self.limit * MM)
        for axis, name in enumerate(AXES):
            if abs(now[axis]) > self.limit * MM:
                self._fail("limit", f"{name} is commanded to {now[axis]}")
            if not low[axis] <= now[axis] <= high[axis]:
                self._fail("unasked", f"{name} is commanded to {now[axis]}, and may be from "
                                      f"{low[axis]} to {high[axis]}")
        still = self._seconds(self.session.cycle - self.still_since)
        if self.held is not None and now != self.held:
            self._fail("held", f"{self.held} -> {now}")
        if self.reset_at is not None:
            after = self._seconds(self.session.cycle - self.reset_at)
            if still >= REST_S:
                self._nothing_to_do()
                self.reset_at = None
            elif after > STOPS_S + REST_S:
                self._fail("reset", f"it still moves {after:.3f} s after it")
        if self.stop_at is not None:
            after = self._seconds(self.session.cycle - self.stop_at)
            if still >= REST_S or self.session.probe("path_status_state") != FRONT:
                self.stop_at = None     # a short leads back in a hold too
            elif after > STOPS_S + REST_S:
                self._fail("stop", f"it still moves {after:.3f} s after it")
        if still >= REST_S and self.session.cycle >= self.ask_at:
            self._standing(still)
            self.ask_at = self.session.cycle + round(ASK_S * self.session.clock_hz)

    def _standing(self, still):
        """Nothing has been commanded for so many seconds: ask the controller where it stands."""
        if self.cable.left is not None:
            return
        waiting = any(order.sent is not None and order.sent.answer is None
                      for order in self.orders)     # before the controller tells its state
        state = self.link.status()
        if self.commands() != self.last:
            return      # it has begun to move
        if "Lost" not in state and still >= SETTLED_S:
            told = [round(float(place) * MM) for place in state["MPos"].split(",")]
            true = [round(self.session.get(f"read.{axis}_pulses")) for axis in AXES]
            if any(abs(a - b) > SETTLED for a, b in zip(told, true, strict=True)):
                self._fail("place", f"it says {told} and stands at {true}: {state}")
        word = f"{state['state']}:{state.get('substate', '')}".rstrip(":")
        if word == "Hold:0" and self.held is None and not (waiting or self._calms()):
            self.held = list(self.last)
        if word == "Alarm":
            self._forget_path()     # the next one begins here
        if word in {"Idle", "Alarm"} and not waiting:
            self._nothing_to_do()

    def _nothing_to_do(self):
        self.base, self.orders, self.back = list(self.last), [], False

    def _calms(self):
        """A retraction for a short may still be under way."""
        return self.session.cycle < self.calm_at

    def _forget_path(self):
        self.low, self.high = list(self.last), list(self.last)

    def _fail(self, kind, text):
        raise FaultError(kind, "\n".join([text, *self.log]))

    # ---- acts

    def act(self) -> None:
        """Do anything."""
        kind = self.rng.choice((
            "jog", "jog", "jog", "line", "line", "tape", "hold", "hold", "resume", "resume",
            "resume", "cancel", "retract", "reset", "override", "status", "garbage", "pull",
            "restart", "estop", "arm", "unlock", "short", "wait", "walk", "walk"))
        self.acts[kind] += 1
        self.log.append(f"{self.session.cycle}: {kind}")
        getattr(self, f"_{kind}")()

    def _settle(self):
        """Wait until a reset or an unlocking has had its effect: an order comes after it."""
        while self.reset_at is not None:
            self.pass_time(SLICE_S)
        end = self.session.cycle + round(STOPS_S * self.session.clock_hz)
        while (self.latched and self.unlocks is not None and self.unlocks.answer is None
               and self.session.cycle < end):
            self.pass_time(SLICE_S)
        # A line that is on its way when the greeting comes would be out of sequence from then on.
        end = self.session.cycle + round(STOPS_S * self.session.clock_hz)
        while self.greets and self.session.cycle < end:
            self.pass_time(SLICE_S)
        self.greets = False

    def _send(self, line, *moves):
        self._settle()
        self.log.append(f"  > {line}")
        low, high = reach(*moves)
        self.orders.append(Order(self.link.send_line(line), low, high, line.startswith("$J=")))
        self.held = self.stop_at = None

    def _delta(self):
        size = 10 ** self.rng.uniform(-3, 0.7)
        return [round(self.rng.choice((0, 1)) * self.rng.uniform(-size, size) * MM)
                for _ in AXES]

    @staticmethod
    def _words(delta):
        return " ".join(f"{axis.upper()}{pulses / MM:.4f}"
                        for axis, pulses in zip(AXES, delta, strict=True) if pulses)

    def _jog(self):
        if any(delta := self._delta()):
            feed = round(10 ** self.rng.uniform(0.5, 3.2))
            self._send(f"$J=G91 {self._words(delta)} F{feed}", delta)

    def _line(self):
        delta = self._delta()
        if any(delta):
            word = self.rng.choice(("G00", "G01", "G01"))
            self._send(f"G91 {word} {self._words(delta)} F{round(10 ** self.rng.uniform(1, 3))}",
                       delta)

    def _tape(self):
        """Send a tape, or the beginning of one."""
        deltas = [delta for delta in (self._delta() for _ in range(self.rng.randint(1, 5)))
                  if any(delta)]
        burns = self.rng.random() < 0.5
        blocks = ["%", "G21 G91 G94", "C100", *(["M03"] if burns else []),
                  *(f"G01 {self._words(delta)} F{round(10 ** self.rng.uniform(1, 3))}"
                    for delta in deltas), *(["M05"] if burns else []), "M02", "%", ""]
        self.log.append(f"  > {blocks}")
        low, high = reach(*deltas)
        self._settle()
        self.orders.append(Order(None, low, high))
        self.held = self.stop_at = None
        until = self.link.pipe.time_s() + self.rng.choice((0.02, 0.3, 0.6))
        self.link.send_tape(encode("\n".join(blocks)).rows,
                            lambda: self.link.pipe.time_s() > until)

    def _hold(self):
        self.link.press(HOLD)
        if not self.back:
            self.stop_at = self.session.cycle

    def _resume(self):
        self.held = self.stop_at = None
        self._order(RESUME)

    def _retract(self):
        self.held = self.stop_at = None
        self.back = True
        self._order(RETRACT)

    def _order(self, word):
        self.orders.append(Order(self.link.send_line(word), [0] * 3, [0] * 3))

    def _cancel(self):
        """Cancel a jog, if there is one: those that were taken stop, one still to come is new."""
        if self.rng.random() < 0.5:
            self.recover()      # a machine that is locked or held takes none
            self._jog()
            self.pass_time(10 ** self.rng.uniform(-2, -0.5))
        self.link.realtime(JOG_CANCEL)
        if self.orders and all(order.jog and order.sent.answer == "ok" for order in self.orders):
            self.acts["cancelled"] += 1
            self.stop_at = self.session.cycle

    def _reset(self):
        self.link.realtime(RESET)
        self._was_reset()
        self.greets = True

    def _override(self):
        self.link.realtime(self.rng.choice(OVERRIDES))

    def _status(self):
        self.link.status()

    def _garbage(self):
        """Bytes that mean nothing; a line that is none. No byte of a real-time order."""
        bytes_ = bytes(self.rng.choice(b"GXYZ0123456789.-$=@* \n\x02\x03\x10")
                       for _ in range(self.rng.randint(1, 40)))
        self.cable.write(bytes_ + b"\n")

    def _pull(self):
        """Pull the cable, perhaps in a line, and plug it in again."""
        self.cable.left = self.rng.randint(0, 12)
        self._jog()
        self.cable.left = 0
        self.pass_time(10 ** self.rng.uniform(-2, 0.2))
        self.cable.left = None

    def _restart(self):
        self._connect()

    def _estop(self):
        self.session.set("force.estop", 1)
        self._was_reset()       # it stops at least as fast as by a reset
        self.pass_time(self.rng.uniform(0.001, 0.1))
        self.session.set("force.estop", 0)

    def _arm(self):
        self.session.button_arm(True)
        self.pass_time(0.02)
        self.session.button_arm(False)

    def _unlock(self):
        self._send("$X")
        self.unlocks = self.orders[-1].sent

    def _short(self):
        self.held = self.stop_at = None
        self.back = True
        self.calm_at = self.session.cycle + round(CALM_S * self.session.clock_hz)
        self.job.short(True)
        self.pass_time(self.rng.uniform(0.001, 0.03))
        self.job.short(False)

    def _walk(self):
        """Walk along the path, most often after a hold and by several steps."""
        if self.rng.random() < 0.8:
            self._hold()
            self.pass_time(10 ** self.rng.uniform(-2, -0.5))
        for _ in range(self.rng.randint(1, 4)):
            self._settle()      # a machine that has nothing to do has no way back either
            self.back = True
            self._send(f"$WALK={10 ** self.rng.uniform(-3, 0.5):.4f}")
            order = self.orders[-1]
            self.pass_time(10 ** self.rng.uniform(-2, -0.3))
            self.acts["walked"] += order.sent.answer == "ok"

    def _wait(self):
        self.pass_time(self.rng.uniform(0.1, 0.5))

    # ---- does it still work?

    def recover(self) -> None:
        """Reset and unlock the machine, and jog it to a place inside its limits."""
        self.log.append(f"{self.session.cycle}: recover")
        self._connect()
        self.pass_time(0.2)
        for line in ("$X", "$POSITION=HERE"):
            try:
                self.link.command(line)
            except RefusedError as error:
                self.log.append(f"  {error}")
        self.pass_time(2 * REST_S)
        if (state := self.link.status())["state"] != "Idle":
            self._fail("stuck", f"reset and unlocked it is {state}")
        goal = [self.rng.randint(-MM, MM) for _ in AXES]
        self._send(f"$J=G53 G90 {self._words_at(goal)} F1500",
                   [b - a for a, b in zip(self.commands(), goal, strict=True)])
        for _ in range(400):
            self.pass_time(0.05)
            if not self.orders:
                break
        if self.commands() != goal:
            self._fail("stuck", f"the last jog ends at {self.commands()}, not at {goal}")

    @staticmethod
    def _words_at(goal):
        return " ".join(f"{axis.upper()}{pulses / MM:.4f}"
                        for axis, pulses in zip(AXES, goal, strict=True))


def operate(session: Session, seed: int, acts: int, between: int = 12) -> dict[str, int]:
    """Do so many acts, and recover after every ``between`` of them.

    Returns
    -------
    dict
        How often each act was done, ``walked``, walks that were taken, ``cancelled``, cancels that
        had a jog to stop, and ``pulses`` that were commanded.

    Raises
    ------
    FaultError
        At the first thing that the machine must not do.
    """
    rng = random.Random(seed)
    operator = Operator(session, rng)
    for number in range(acts):
        if number % between == between - 1:
            operator.recover()
        operator.act()
        operator.pass_time(10 ** rng.uniform(-3, -0.7))
    operator.recover()
    return {**operator.acts, "pulses": operator.moved}
