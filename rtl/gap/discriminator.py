# SPDX-License-Identifier: Apache-2.0
"""Pulse discriminator: classifies each pulse by the gap's comparators."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Discriminator", "PulseClass"]


class PulseClass(enum.Enum, shape=2):
    """What a pulse was. The DAME of the second patent is ``DAME`` or ``SHORT``."""

    OPEN = 0   # no discharge
    OK = 1     # a good discharge
    DAME = 2   # an arc
    SHORT = 3  # the voltage was below the short level


class Discriminator(wiring.Component):
    """Class of each pulse: discriminators 2, 3 and 4 of the second patent.

    A pulse is a run of clocks with ``on`` high (a main pulse), or with ``sense`` high and ``on``
    low (a sensing pulse). Its first ``blanking`` clocks are ignored; they also cover the delay from
    the gates to the comparators. A pulse that is not longer than ``blanking`` gives no sample. Any
    other pulse gives one in the clock after its last clock: ``sample`` is high, and ``kind`` is
    the class.

    A main pulse *ignites* in the first clock past the blanking in which ``high`` is low or, with
    ``use_current``, in which ``current`` is high. With ``from_ignition``, when the on-time counts
    from there, the blanking of a main pulse ends sooner: after a clock with ``high``, as the
    voltage has risen, or with ``use_current`` after the first clock. The next ``settle`` clocks are
    ignored, as the voltage is still falling. The class of a main pulse is

    * ``OPEN`` if it did not ignite;
    * ``SHORT`` if ``short`` was high in its last clock;
    * ``DAME`` if ``arc`` was high in its last clock, or if its discharge is suspect;
    * ``OK`` otherwise, and if the pulse ended before the voltage had settled.

    A discharge is suspect if at least one criterion is in use and all in use are met. By
    ``use_delay`` it ignited less than ``delay_least`` clocks after the pulse began; by
    ``use_noise`` the input ``noise`` was low in every clock from the ignition to the last one.
    Sensing pulses carry too little current for any of this: they are ``SHORT`` if ``short`` was
    high in the last clock, else ``OPEN``.

    With ``relaxation``, for a supply that charges a capacitor until the gap breaks down, the
    voltage rises slowly, and the capacitor is empty after the discharge. So the class comes from
    how far the voltage had risen before:

    * the main pulse is *charged* once ``short`` has been low in a clock of it, blanked or not, and
      *full* once ``high`` has been high. With ``from_ignition`` the blanking ends after a clock
      with ``short`` low, too;
    * it ignites (breaks down) in the first clock past the blanking in which ``high`` is low and it
      was full before, or ``short`` is high and it was charged before; with ``use_current`` by
      ``current`` as above;
    * it is ``SHORT`` if it was never charged, else ``OPEN`` if it did not ignite, ``DAME`` if it
      was not full before it ignited or if it is suspect, and ``OK`` otherwise. ``arc`` and
      ``settle`` have no effect;
    * ``shorted_now`` says that it is past its blanking and not charged, ``abnormal`` that this has
      been so for ``confirm`` clocks, or that it has ignited before it was full.

    ``ignited`` says in the same clock that the main pulse has ignited. ``shorted_now`` says in the
    same clock that the pulse is past its blanking and settling, and ``short`` is high. ``abnormal``
    says that in a main pulse ``short`` or ``arc`` has been high for ``confirm`` clocks in a row,
    this one included; 0 counts as 1. The counters and ``last`` follow main pulses only, one clock
    after the sample; counters wrap.

    Settings may change between pulses only: after the clock of the sample, and before the last
    clock of the pause.

    Ref: the class scheme (open, normal, arc, short by voltage and ignition delay): doi
    10.1177/0954405414543488; arcs burn below 15 to 20 V, shorts below 10 to 15 V. Arcs have no high
    frequencies: ASME J. Eng. Ind. 102 (3), 1980, p. 189.

    Members
    -------
    on, sense : In(1)
        Gates of the main and of the sensing source, as ``rtl.power.pulse_generator`` makes them.
    high : In(1)
        Gap voltage above the open level.
    arc, short : In(1)
        Gap voltage below the arc level, and below the short level.
    current : In(1)
        Gap current above its threshold.
    noise : In(1)
        The discharge has high frequencies.
    blanking : In(16)
        In clocks, from the first clock of the gate.
    settle, confirm : In(8)
        In clocks.
    delay_least : In(16)
        Shortest ignition delay of a good discharge, in clocks.
    use_current, use_delay, use_noise : In(1)
        Criteria in use.
    from_ignition : In(1)
        The blanking ends when the voltage has risen.
    relaxation : In(1)
        The main source charges a capacitor.
    sample : Out(1)
        A pulse was classified: high for one clock.
    kind : Out(PulseClass)
        What it was. Valid with ``sample``.
    sample_sensing : Out(1)
        It was a sensing pulse. Valid with ``sample``.
    sample_shorted : Out(1)
        ``kind`` is ``SHORT``. Valid with ``sample``.
    ignited : Out(1)
        The main pulse has ignited, in this clock or before.
    shorted_now : Out(1)
        The pulse is shorted in this clock.
    abnormal : Out(1)
        The main pulse is a short or an arc.
    last : Out(PulseClass)
        Class of the last main pulse.
    open_count, ok_count, dame_count, short_count : Out(32)
        Main pulses of each class since reset.
    """

    on: In(1)
    sense: In(1)
    high: In(1)
    arc: In(1)
    short: In(1)
    current: In(1)
    noise: In(1)
    blanking: In(16)
    settle: In(8)
    confirm: In(8)
    delay_least: In(16)
    use_current: In(1)
    use_delay: In(1)
    use_noise: In(1)
    from_ignition: In(1)
    relaxation: In(1)
    sample: Out(1)
    kind: Out(PulseClass)
    sample_sensing: Out(1)
    sample_shorted: Out(1)
    ignited: Out(1)
    shorted_now: Out(1)
    abnormal: Out(1)
    last: Out(PulseClass)
    open_count: Out(32)
    ok_count: Out(32)
    dame_count: Out(32)
    short_count: Out(32)

    def elaborate(self, platform):
        m = Module()

        gates = Signal(2)   # main, sensing: never both
        before = Signal(2)
        same = Signal()     # the pulse goes on
        m.d.comb += [
            gates.eq(Cat(self.on, self.sense & ~self.on)),
            same.eq(gates == before),
        ]
        m.d.sync += before.eq(gates)

        age = Signal(16)      # clocks of the pulse before this one, but in its first
        with m.If(same):
            m.d.sync += age.eq(age + 1)
        with m.Else():
            m.d.sync += age.eq(1)

        def since(limit, name, sooner=0):
            """High in a pulse from when ``limit`` clocks of it are over. Equal is enough.

            ``sooner`` ends it after this clock.
            """
            reached = Signal(name=f"{name}_before")
            now = Signal(name=name)
            m.d.comb += now.eq(Mux(same, reached | (age == limit), limit == 0))
            m.d.sync += reached.eq(now | sooner)
            return now

        # A capacitor: how far it had been charged before this clock.
        charges = Signal()
        was_charged, was_full = Signal(), Signal()
        charged, full = Signal(), Signal()      # the same within this pulse
        m.d.comb += [
            charges.eq(self.relaxation & self.on),
            charged.eq(was_charged & same), full.eq(was_full & same),
        ]
        m.d.sync += [was_charged.eq(charged | ~self.short), was_full.eq(full | self.high)]
        empty = Signal()      # it is not charged in this clock either
        m.d.comb += empty.eq(~charged & self.short)

        risen = Signal()      # nothing is left to wait for at the start of the pulse
        m.d.comb += risen.eq(self.from_ignition & self.on
                             & (self.use_current | self.high | (self.relaxation & ~self.short)))
        past = Signal()       # the comparators count
        m.d.comb += past.eq((gates != 0) & since(self.blanking, "unblanked", risen))

        # From the ignition on.
        lit = Signal()        # up to the last clock
        burning = Signal()    # of the main pulse
        burnt = Signal(8)     # clocks burning before this one
        was_settled = Signal()
        settled = Signal()
        early = Signal()
        heard = Signal()
        fallen = Signal()
        was_weak, weak = Signal(), Signal()     # the capacitor has broken down before it was full
        m.d.comb += [
            fallen.eq(Mux(self.relaxation, (full & ~self.high) | (charged & self.short),
                          ~self.high)),
            burning.eq(past & self.on
                       & ((lit & same) | Mux(self.use_current, self.current, fallen))),
            self.ignited.eq(burning),
            settled.eq(Mux(self.on, burning & (was_settled | (burnt == self.settle)), past)),
            weak.eq(burning & charges & Mux(lit & same, was_weak, ~full)),
            self.shorted_now.eq(Mux(charges, past & empty, settled & self.short)),
        ]
        m.d.sync += [lit.eq(burning), was_settled.eq(settled & self.on), was_weak.eq(weak)]
        with m.If(burning):
            m.d.sync += burnt.eq(burnt + 1)
        with m.Else():
            m.d.sync += burnt.eq(0)
        late = since(self.delay_least, "late")
        with m.If(~(lit & same)):
            m.d.sync += [early.eq(~late), heard.eq(burning & self.noise)]
        with m.Elif(self.noise):
            m.d.sync += heard.eq(1)

        low = Signal()
        number = Signal(8, init=1)  # of this clock among those low running
        was_abnormal = Signal()
        m.d.comb += [
            low.eq(Mux(charges, weak | (past & empty),
                       settled & self.on & (self.arc | self.short))),
            # A breakdown ends its pulse at once: nothing is left to confirm.
            self.abnormal.eq(weak | (low & (was_abnormal | (number == self.confirm)
                                            | (self.confirm == 0)))),
        ]
        m.d.sync += was_abnormal.eq(self.abnormal)
        with m.If(low):
            m.d.sync += number.eq(number + 1)
        with m.Else():
            m.d.sync += number.eq(1)

        # What the last clock said.
        valid = Signal()
        short = Signal()
        arc = Signal()
        m.d.sync += [
            valid.eq(past),
            short.eq(self.shorted_now),
            arc.eq(Mux(charges, weak, settled & self.arc)),
        ]

        main = before[0]
        suspect = Signal()
        m.d.comb += [
            self.sample.eq(valid & ~same),
            self.sample_sensing.eq(before[1]),
            self.sample_shorted.eq(short),
            suspect.eq((self.use_delay | self.use_noise) & (early | ~self.use_delay)
                       & ~(heard & self.use_noise)),
        ]
        with m.If(short):
            m.d.comb += self.kind.eq(PulseClass.SHORT)
        with m.Elif(~lit):
            m.d.comb += self.kind.eq(PulseClass.OPEN)
        with m.Elif(arc | suspect):
            m.d.comb += self.kind.eq(PulseClass.DAME)
        with m.Else():
            m.d.comb += self.kind.eq(PulseClass.OK)

        with m.If(self.sample & main):
            m.d.sync += self.last.eq(self.kind)
            with m.Switch(self.kind):
                for kind, count in ((PulseClass.OPEN, self.open_count),
                                    (PulseClass.OK, self.ok_count),
                                    (PulseClass.DAME, self.dame_count),
                                    (PulseClass.SHORT, self.short_count)):
                    with m.Case(kind):
                        m.d.sync += count.eq(count + 1)

        return m
