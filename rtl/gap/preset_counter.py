# SPDX-License-Identifier: Apache-2.0
"""Preset counters: turn the classes of pulses into UP and DOWN of the gap servo."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

from rtl.gap.discriminator import PulseClass

__all__ = ["Mode", "PresetCounters"]

WEIGHT = 4   # bits
COUNT = 8
PERIOD = 24


class Mode(enum.Enum, shape=3):
    """How pulses are counted. The numbers 6 and 7 count as ``ACCUMULATE``."""

    ACCUMULATE = 0   # each class by itself: a race
    CONSECUTIVE = 1  # runs of one class
    TOTAL = 2        # shares of a window of pulses
    RELATIVE = 3     # DAME and OPEN each against OK
    OWN_GATE = 4     # as ACCUMULATE, but a strobe clears only what is full
    OK_ALONE = 5     # good pulses alone


class PresetCounters(wiring.Component):
    """Counters 5 (DAME or SHORT), 6 (OPEN) and 7 (OK), time device 13, and UP and DOWN.

    Counter 5 full asks for UP (widen the gap), counter 6 full for DOWN (narrow it). Time device 13
    gives strobes. A strobe gives UP if 5 is full, else DOWN if 6 is full; either clears both
    counters (but see ``OWN_GATE``). A strobe with neither full does nothing
    (but see ``OK_ALONE``). A full counter stays
    full until such a strobe or until 7 clears it.

    * ``ACCUMULATE``: a counter counts the pulses of its class, and is full at its preset. Counter 7
      does not stay full: at its preset it clears all three, whether 5 and 6 are full or not.
      Nothing else clears counter 7, not even UP and DOWN.
    * ``CONSECUTIVE``: the same, and a pulse of another class clears a counter that is not full.
    * ``TOTAL``: the classes of ``window`` pulses are counted. At the last of them 5 and 6 each
      become full if their count reached the preset, else are no longer full. If 7 reached its
      preset, 5 and 6 are both cleared instead. Then counts and window begin anew. Counts and window
      also begin anew at UP and DOWN: pulses from before the electrode moved do not count.
    * ``RELATIVE``: 5 counts +1 for a pulse of its class, 6 likewise, and both -``weight`` for an
      OK, not below 0. Only a strobe clears a full counter; 7 is not used.
    * ``OWN_GATE``: as ``ACCUMULATE``, but a strobe clears 5 if 5 is full, and 6 if 6 is full. What
      the other one has counted so far stays. If both are full, the result is UP, and both are
      cleared.
    * ``OK_ALONE``: 7 counts the OK and stays full at its preset; 5 and 6 are not used. Every strobe
      gives UP if 7 is full, else DOWN, and clears 7. With preset 0 there is no UP or DOWN.

    A counter with preset 0 is off: empty and never full. So each class can be used by itself. The
    count goes to 0 when its counter becomes full, and starts again when that has been cleared; in
    ``TOTAL`` counting goes on meanwhile. No count wraps: each stays below 255.

    Within a clock the pulse comes before the strobe. So the pulse in the clock of a strobe can
    still fill a counter, or make 7 clear it; after UP or DOWN it has left nothing in 5 and 6.
    ``up``, ``down`` and ``strobe`` are high in the clock after.

    Settings act at once. A new preset, ``window`` or ``weight`` leaves the counts and the state
    full. A counter becomes full only with a pulse: one of its own class, in ``TOTAL`` the last of a
    window; at a preset below its count, with the next such pulse. Preset 0 clears its counter at
    once. A change of ``mode`` (``ACCUMULATE`` before reset) clears all counts, both states full
    and the window, and loses the pulse of that clock; the time device runs on. If ``period``
    becomes less than the time since the last strobe, a strobe comes at once.

    ``freeze`` clears all of this, loses pulses, restarts the time device and holds ``up``, ``down``
    and ``strobe`` low, in the same clock. The first strobe then comes in the ``period``th clock
    without ``freeze``.

    Ref: second patent (gap by counted pulses), items 5 to 7 and 13 to 17. There each gate, 14 and
    15, clears its own counter: that is ``OWN_GATE``. The second patent names runs, shares of all
    pulses, relative shares and a single class as servo signals, without their rules: these, the
    directions of ``OK_ALONE``, ``freeze`` and the order of events in a clock are ours.
    Proof: ``testbench/formal/test_preset_counter.py``.

    Members
    -------
    sample : In(1)
        A main pulse was classified.
    kind : In(PulseClass)
        Its class. Valid with ``sample``.
    dame, open, ok : In(8)
        Presets of 5, 6 and 7, in pulses; 0 for off.
    mode : In(Mode)
    window : In(8)
        Pulses of ``TOTAL``; 0 counts as 1.
    weight : In(4)
        Weight of an OK in ``RELATIVE``.
    period : In(24)
        Period of the time device, in clocks; 0 for no strobes. The drive must be able to follow.
    freeze : In(1)
        Ss is high, or the servo is not in use.
    up, down : Out(1)
        Widen, narrow the gap by a step: high for one clock, never both.
    strobe : Out(1)
        A strobe of the time device; in the clock of ``up`` or ``down``.
    dame_full, open_full : Out(1)
        5, 6 are full.
    ok_full : Out(1)
        7 was full and has cleared all: high for one clock. In ``OK_ALONE``: 7 is full.

    Attributes
    ----------
    counts : dict of Signal(8)
        For proofs: counts of 5, 6, 7 (``dame``, ``open``, ``ok``) and of the window.
    """

    sample: In(1)
    kind: In(PulseClass)
    dame: In(COUNT)
    open: In(COUNT)
    ok: In(COUNT)
    mode: In(Mode)
    window: In(COUNT)
    weight: In(WEIGHT)
    period: In(PERIOD)
    freeze: In(1)
    up: Out(1)
    down: Out(1)
    strobe: Out(1)
    dame_full: Out(1)
    open_full: Out(1)
    ok_full: Out(1)

    def __init__(self):
        super().__init__()
        self.counts = {name: Signal(COUNT, name=f"{name}_count")
                       for name in ("dame", "open", "ok", "window")}

    def elaborate(self, platform):
        m = Module()

        consecutive, total, relative, own_gate, ok_alone = (Signal() for _ in range(5))
        m.d.comb += [
            consecutive.eq(self.mode == Mode.CONSECUTIVE),
            total.eq(self.mode == Mode.TOTAL),
            relative.eq(self.mode == Mode.RELATIVE),
            own_gate.eq(self.mode == Mode.OWN_GATE),
            ok_alone.eq(self.mode == Mode.OK_ALONE),
        ]

        mode = Signal(Mode)  # of the clock before
        clear = Signal()
        m.d.sync += mode.eq(self.mode)
        m.d.comb += clear.eq(self.freeze | (self.mode != mode))

        # Time device 13. The first clock of a period is number 1.
        number = Signal(PERIOD, init=1)
        due = Signal()
        m.d.comb += due.eq((self.period != 0) & (number >= self.period))
        with m.If(self.freeze | due | (self.period == 0)):
            m.d.sync += number.eq(1)
        with m.Else():
            m.d.sync += number.eq(number + 1)

        dame, open_, ok = Signal(), Signal(), Signal()
        m.d.comb += [
            dame.eq(self.sample & ((self.kind == PulseClass.DAME)
                                   | (self.kind == PulseClass.SHORT))),
            open_.eq(self.sample & (self.kind == PulseClass.OPEN)),
            ok.eq(self.sample & (self.kind == PulseClass.OK)),
        ]

        moved = Signal()   # UP or DOWN, as of this clock
        last = Signal()    # pulse of the window
        begun = self.counts["window"]
        with_this = Signal(COUNT)
        m.d.comb += [
            with_this.eq(begun + 1),
            last.eq(total & self.sample & (with_this >= self.window)),
        ]
        with m.If(clear | last | moved | ~total):
            m.d.sync += begun.eq(0)
        with m.Elif(self.sample):
            m.d.sync += begun.eq(with_this)

        # Counter 7.
        oks, with_ok = self.counts["ok"], Signal(COUNT)
        filled_ok = Signal()
        cleared = Signal()  # by 7
        m.d.comb += [
            with_ok.eq(oks + ok),
            filled_ok.eq((self.ok != 0) & ((ok_alone & self.ok_full)
                                           | ((with_ok >= self.ok)
                                              & (last | (ok & ~total & ~relative))))),
            cleared.eq(filled_ok & ~ok_alone),
        ]
        with m.If(clear | filled_ok | last | ((total | ok_alone) & moved) | relative
                  | (self.ok == 0) | (consecutive & self.sample & ~ok)):
            m.d.sync += oks.eq(0)
        with m.Else():
            m.d.sync += oks.eq(with_ok)
        m.d.sync += self.ok_full.eq(filled_ok & ~clear & ~(ok_alone & due))

        # Counters 5 and 6: one adder each, for +1 and for -weight = +~weight + 1.
        less = Signal()
        change = Signal(signed(WEIGHT + 1))
        m.d.comb += [
            less.eq(relative & ok),
            change.eq(Mux(less, Cat(~self.weight, 1).as_signed(), 0)),
        ]
        full = []
        for name, pulse, preset, held in (("dame", dame, self.dame, self.dame_full),
                                          ("open", open_, self.open, self.open_full)):
            count = self.counts[name]
            carried = Signal(signed(COUNT + 2), name=f"{name}_carried")
            after = Signal(COUNT, name=f"{name}_after")
            reached = Signal(name=f"{name}_reached")
            filled = Signal(name=f"{name}_filled")
            below = Signal(name=f"{name}_below")
            stop = Signal(name=f"{name}_stop")
            m.d.comb += [
                carried.eq(Cat(1, count, 0).as_signed() + Cat(pulse | less, change).as_signed()),
                after.eq(carried[1:]),
                below.eq(less & carried[-1]),
                reached.eq(after >= preset),
                filled.eq((preset != 0) & ~cleared & ~ok_alone
                          & Mux(last, reached, held | (pulse & ~total & reached))),
                stop.eq(clear | (moved & ~own_gate) | cleared | last | below | (preset == 0)
                        | ok_alone | (~total & filled) | (consecutive & self.sample & ~pulse)),
            ]
            with m.If(stop):
                m.d.sync += count.eq(0)
            with m.Else():
                m.d.sync += count.eq(after)
            m.d.sync += held.eq(filled & ~clear & ~moved)
            full.append(filled)

        up, down, strobe, widens = Signal(), Signal(), Signal(), Signal()
        m.d.comb += [
            # ``filled_ok`` is UP in OK_ALONE. In the other modes 7 has then just cleared 5 and 6,
            # and ``moved`` is low.
            widens.eq(full[0] | filled_ok),
            moved.eq(due & ~clear & (full[0] | full[1] | (ok_alone & (self.ok != 0)))),
        ]
        m.d.sync += [
            up.eq(moved & widens),
            down.eq(moved & ~widens),
            strobe.eq(due & ~self.freeze),
        ]
        m.d.comb += [
            self.up.eq(up & ~self.freeze),
            self.down.eq(down & ~self.freeze),
            self.strobe.eq(strobe & ~self.freeze),
        ]

        return m
