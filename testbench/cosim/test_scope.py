# SPDX-License-Identifier: Apache-2.0
"""The gap oscilloscope in the whole controller: its record against pins and plant, by the link."""

import numpy as np
import pytest

from host.link.link import POLL_S, Link
from host.machines.machine import load
from host.run.simulation import Simulation as Piped
from host.scope.acquire import Acquisition, Trigger
from host.scope.record import PULSES
from softcore.top import Top
from testbench.cosim.record import WATCHDOG, Record
from testbench.native.simulation import Simulation

MACHINE = load("sinker")
COMPARATORS = ("high", "arc", "short", "current", "noise")
RESET = Top.RESET_CLOCKS + 1    # clocks of the simulation before the controller counts its own
SYNC = 3            # clocks from a comparator's pin to the gap's blocks
SAMPLE = 4          # clocks from the converter's last bit at the pins to the sample
CONVERTER = ("adc_select", "adc_clock", "adc_data")
PINS = (*(f"gap_{name}" for name in COMPARATORS), "gap_on", "gap_sense", *CONVERTER,
        "gap_status_shorted", "path_status_state", "gap_mv",
        *(f"gap_{name}_count" for name in ("open", "ok", "dame", "short")))
CUT = ("$X", "$POSITION=HERE", "G92 X0 Y0 Z0.1", "G36 R300 L1 H600 E60 Q0.05", "C130", "M03",
       "G94 F12", "G01 Z-0.2")


class Bench:
    """A machine under its link, watched clock by clock."""

    def __init__(self, session):
        self.session = session
        self.wanted = None
        self.link = Link(Piped(session), self.hear)

    def hear(self, line):
        if self.wanted is not None:
            self.wanted.hear(line)

    def cut(self):
        """Cut until there have been some discharges."""
        self.link.await_greeting()
        for line in CUT[:2]:
            self.link.command(line)
        self.session.press_arm()
        for line in CUT[2:]:
            self.link.command(line)
        while self.session.discharges()["ok"] < 20:
            self.session.run(2000)

    def record(self, trigger, longest_s=3.0, meanwhile=lambda state: None):
        """A record; the machine goes on until it is read."""
        self.wanted, end, sent = Acquisition(trigger), self.session.cycle, None
        end += round(longest_s * self.session.clock_hz)
        while self.wanted.record is None:
            assert self.session.cycle < end, self.wanted.state
            if sent is not None and sent.answer is not None:
                self.wanted.answered(sent.answer)
                sent = None
            line = None if sent else self.wanted.line(self.session.cycle / self.session.clock_hz)
            if line is not None:
                sent = self.link.send_line(line)
            meanwhile(self.wanted.state)
            self.link.poll(POLL_S / 10)
        return self.wanted.record


class Seen:
    """What was at the pins, a value for every clock of the record, by its own clocks."""

    def __init__(self, session, record):
        self.first = record.cycle + RESET + int(record.clock[0])
        self.clocks = int(record.clock[-1] - record.clock[0]) + 1
        self.room = 700     # clocks before the record, for what a sample comes from
        self.columns = {}
        rows = {}
        for clock, name, value in session.changes():
            rows.setdefault(name, []).append((clock, value))
        for name, changes in rows.items():
            at, values = np.array(changes).T
            wanted = np.arange(self.first - self.room, self.first + self.clocks)
            self.columns[name] = values[np.searchsorted(at, wanted, side="right") - 1]

    def of(self, name, delay=0):
        """Values in the record's clocks, ``delay`` clocks before."""
        return self.columns[name][self.room - delay:self.room - delay + self.clocks]

    def samples(self):
        """Clock in the record, code, and true voltage, of each answer of the voltage channel."""
        select, clock, data, mv = (self.columns[name] for name in (*CONVERTER, "gap_mv"))
        found, bits, truth = [], None, 0
        for at in range(1, len(select) - 1):
            if select[at] and not select[at - 1]:
                bits, truth = [], mv[at + 1]    # the plant answers at the clock's edge
            elif bits is not None and select[at] and clock[at] and not clock[at - 1]:
                bits.append(int(data[at]))
                if len(bits) == 16:
                    word = int("".join(map(str, bits)), 2)
                    place = at + SAMPLE - self.room
                    if not word >> 12 and 0 <= place < self.clocks:
                        found.append((place, word & 0xFFF, truth / 1000))
        return found


@pytest.fixture(scope="module")
def recorded():
    """A record around an arc in a cut, and what was at the pins in its clocks."""
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=3,
                    trace=False) as session:
        bench = Bench(session)
        bench.cut()
        session.watch(PINS)
        record = bench.record(Trigger("ok", before=40))
        yield record, Seen(session, record)


def filled(record, values):
    """A value of each entry, for every clock until the next entry."""
    clocks = record.clock - record.clock[0]
    return np.repeat(values, np.diff(clocks, append=clocks[-1] + 1))


def test_levels_are_those_at_the_pins_in_the_same_clocks(recorded):
    record, seen = recorded
    # The trigger came before the ring was full.
    before = 4096 * 40 // 100
    assert 0 < record.trigger <= before
    assert len(record) == record.trigger + 4096 - before
    for name in COMPARATORS:
        pins = seen.of(f"gap_{name}", SYNC)
        assert (filled(record, record.levels[name]) == pins).all(), name
        assert pins.any(), name
    for name in ("on", "sense"):
        assert (filled(record, record.levels[name]) == seen.of(f"gap_{name}")).all(), name
    assert (filled(record, record.levels["shorted"]) == seen.of("gap_status_shorted")).all()
    assert (filled(record, record.state) == seen.of("path_status_state")).all()
    assert seen.of("gap_on").any()


def test_samples_are_those_of_the_plant(recorded):
    """Clock and code of every sample are those at the converter's pins, and the true voltage's."""
    record, seen = recorded
    clocks = record.clock - record.clock[0]
    entries = [(int(clocks[at]), int(record.code[at])) for at in record.samples]
    at_pins = seen.samples()[1:]    # the answer to the converter's first frame is not looked at
    assert entries == [(clock, code) for clock, code, _ in at_pins]
    assert len(entries) > 500
    full = MACHINE.tables["comparator"]["reference_full_v"]
    for _, code, volts in at_pins:
        assert abs(code - 4095 * min(max(volts / full, 0), 1)) <= 0.6
    assert len({code for _, code in entries}) > 10


def test_classes_are_those_counted(recorded):
    """A main pulse's class is in the entry of the clock before its count rises."""
    record, seen = recorded
    clocks = record.clock - record.clock[0]
    for number in range(1, 5):
        name = PULSES[number]
        counts = seen.of(f"gap_{name}_count")
        rises = np.flatnonzero(np.diff(counts))
        told = [int(clock) for clock in clocks[record.pulse == number] if clock < seen.clocks - 1]
        assert list(rises) == told, name
    assert (record.pulse == PULSES.index("ok")).sum() > 10
    assert record.pulse[record.trigger] == PULSES.index("ok")


def test_the_trigger_of_a_short_is_the_rise_of_ss_and_the_cut_goes_on():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=3,
                    trace=False) as session:
        bench = Bench(session)
        bench.cut()
        session.watch(("gap_status_shorted", "path_status_state", *WATCHDOG))

        def short(state):
            session.set("force.short", 1 if state == "armed" else -1)

        record = bench.record(Trigger("short", before=25), meanwhile=short)
        at = record.trigger
        seen = Record()
        seen.extend(session.changes())
        rises = seen.rises("gap_status_shorted")
        seen.watched_well(session.clock_hz)     # the record's lines are the longest that are sent
        assert record.cycle + RESET in rises
        assert record.levels["shorted"][at]
        assert not record.levels["shorted"][at - 1]
        # The retraction starts, and the machine cuts on when the short has gone.
        assert (record.state[at:] == 1).any()
        before = session.discharges()["ok"]
        session.run(MACHINE.clock_hz // 2)
        assert session.discharges()["ok"] > before
