# SPDX-License-Identifier: Apache-2.0
"""The gap oscilloscope on the host: decoding, files, and the way of a record over the link."""

import csv
import ctypes
import re
from binascii import crc_hqx

import numpy as np
import pytest
import pywellen
from typer.testing import CliRunner

from host.cli import app
from host.errors import UsageError, UserError
from host.link.link import Link, LinkError
from host.scope.acquire import DAMAGED, TRIGGERS, Acquisition, Trigger
from host.scope.record import COLUMNS, LEVELS, PULSES, STATES, Record, check, write
from host.scope.record_at import acquire, told
from testbench.firmware import Scope
from testbench.live import serving
from testbench.models import scope as model
from testbench.piped import CLOCK_HZ, Firmware

DEPTH, FULL = 64, 3


def clock_at_random(rng):
    return dict({name: rng.randrange(2) for name in model.LEVELS}, state=rng.randrange(7),
                pulse=rng.randrange(7), voltage=rng.randrange(4096), sampled=rng.randrange(2))


def entries_at_random(rng, count=DEPTH):
    """Entries of the model; the stamp of the oldest counts from one that is gone."""
    return [model.Entry(rng.choice((1, 2, 511, rng.randrange(1, 512))), clock_at_random(rng))
            for _ in range(count)]


@pytest.fixture
def entries(rng):
    return entries_at_random(rng)


@pytest.fixture
def record(entries):
    return Record.of([entry.word() for entry in entries], clock_hz=2_000_000, trigger=20,
                     cycle=12345)


# ---- the record

def test_a_record_is_what_the_entries_of_the_model_say(entries, record):
    clock = [sum(entry.stamp for entry in entries[1:at + 1]) for at in range(DEPTH)]
    assert [*record.clock] == [one - clock[20] for one in clock]
    assert record.time_us[-1] == pytest.approx((clock[-1] - clock[20]) / 2)
    for name in LEVELS:
        assert [*record.levels[name]] == [entry.clock[name] == 1 for entry in entries]
    for name, column in (("pulse", record.pulse), ("state", record.state),
                         ("voltage", record.code)):
        assert [*column] == [entry.clock[name] for entry in entries]
    assert [*record.samples] == [at for at, entry in enumerate(entries) if entry.clock["sampled"]]
    assert record.volts[record.samples] == pytest.approx(
        [entry.clock["voltage"] * 100 / 4096 for entry in entries if entry.clock["sampled"]])


def test_names_are_those_of_the_model():
    assert [word.replace("_", " ") or None for word in PULSES] == list(model.PULSES)


@pytest.mark.parametrize("trigger", [-1, 3])
def test_a_trigger_that_is_no_entry_is_refused(trigger):
    with pytest.raises(ValueError, match="none of 3 entries"):
        Record.of([0, 0, 0], clock_hz=1, trigger=trigger, cycle=0)


def test_a_csv_has_a_row_for_each_entry(tmp_path, entries, record):
    write(record, tmp_path / "new" / "gap.csv")
    with (tmp_path / "new" / "gap.csv").open(newline="") as file:
        head, *rows = csv.reader(file)
    assert tuple(head) == COLUMNS
    assert len(rows) == DEPTH
    for at, (row, entry) in enumerate(zip(rows, entries, strict=True)):
        told_ = dict(zip(head, row, strict=True))
        assert int(told_["clock"]) == record.clock[at]
        assert float(told_["time_us"]) == pytest.approx(record.clock[at] / 2, abs=1e-3)
        assert (told_["volts"] == "") == (not entry.clock["sampled"])
        assert told_["pulse"] == PULSES[entry.clock["pulse"]]
        assert told_["state"] == STATES[entry.clock["state"]]
        assert [int(told_[name]) for name in LEVELS] == [entry.clock[name] for name in LEVELS]


@pytest.mark.parametrize(("clock_hz", "step"), [(50_000_000, 20), (2_000_000, 500)])
def test_a_waveform_has_the_values_at_their_times(tmp_path, entries, clock_hz, step):
    record = Record.of([entry.word() for entry in entries], clock_hz=clock_hz, trigger=20, cycle=0)
    path = tmp_path / "gap.fst"
    write(record, path)
    again = tmp_path / "again.fst"
    write(record, again)
    assert path.read_bytes() == again.read_bytes()
    wave = pywellen.Waveform(str(path))
    signals = {one.full_name.removeprefix("scope."): [*map(one.signal.__getitem__,
                                                           range(len(one.signal)))]
               for one in wave.all_vars()}
    assert set(signals) == {*LEVELS, "volts", "pulse", "state", "trigger"}
    times = (record.clock - record.clock[0]) * step

    def at_time(name, time):
        return [value for then, value in signals[name] if then <= time][-1]

    volts = None
    for at, time in enumerate(map(int, times)):
        for name, column in ((name, record.levels[name]) for name in LEVELS):
            assert at_time(name, time) == column[at]
        assert at_time("trigger", time) == (at == 20)
        assert at_time("pulse", time) == record.pulse[at]
        assert at_time("state", time) == record.state[at]
        if entries[at].clock["sampled"]:
            volts = record.volts[at]
        if volts is not None:
            assert at_time("volts", time) == pytest.approx(volts)
        if at + 1 < DEPTH and times[at + 1] > time + step:      # a class lasts one clock
            assert at_time("pulse", time + step) == 0


@pytest.mark.parametrize("name", ["gap", "gap.txt", "gap.vcd"])
def test_a_file_of_another_kind_is_refused(tmp_path, name):
    with pytest.raises(UsageError, match="is no name for a record"):
        check(tmp_path / name)


@pytest.mark.parametrize("suffix", [".csv", ".fst"])
def test_a_file_that_cannot_be_written_is_told(tmp_path, record, suffix):
    path = tmp_path / f"gap{suffix}"
    path.mkdir()
    with pytest.raises(UserError, match="cannot be written"):
        write(record, path)


# ---- triggers

@pytest.mark.parametrize(("text", "line"), [
    ("now", "$SCOPE=NOW,50"), ("Short", "$SCOPE=SHORT,50"), ("rise=50", "$SCOPE=RISE,50,2048"),
    ("fall=0", "$SCOPE=FALL,50,0"), ("rise=99.9", "$SCOPE=RISE,50,4091")])
def test_a_trigger_makes_its_line(text, line):
    assert Trigger.of(text).line == line


@pytest.mark.parametrize(("text", "before", "says"), [
    ("shorts", 50, '"shorts" is no trigger: now, short'), ("", 50, "is no trigger"),
    ("rise", 50, "need a level in V"), ("short=5", 50, "need a level in V"),
    ("rise=high", 50, '"high" is no level'), ("rise=100", 50, "to below 100 V"),
    ("fall=-1", 50, "to below 100 V"), ("fall=nan", 50, "to below 100 V"),
    ("now", 100, "0 to 99 %")])
def test_a_wrong_trigger_is_refused(text, before, says):
    with pytest.raises(UsageError, match=re.escape(says)):
        Trigger.of(text, before)


# ---- the way over the link

class Scoped(Firmware):
    """The firmware; its oscilloscope is full with random entries once it has been armed.

    Of the bytes that come, ``damages`` of a thousand are damaged while entries are read.
    """

    def __init__(self, rng, damages=0, waits=0):
        super().__init__()
        self.rng, self.damages, self.waits = rng, damages, waits
        self.words = []
        self.forced = False

    def scope(self):
        words = Scope()
        self.library.gk_scope_read(ctypes.byref(words))
        return words

    def write(self, data):
        self.forced |= b"$SCOPE=FORCE" in data
        super().write(data)

    def read(self, timeout_s):
        words = self.scope()
        self.waits -= words.recording == 1
        if words.recording in (1, 2) and (self.waits < 0 or self.forced):
            self.words = [entry.word() for entry in entries_at_random(self.rng)]
            words.entries[:] = self.words
            words.recording, words.count, words.time = FULL, DEPTH, 77
            self.library.gk_scope_write(ctypes.byref(words))
        said = bytearray(super().read(timeout_s))
        if b"SCOPE@" in said or self.words:
            for at in range(len(said)):
                if self.rng.randrange(1000) < self.damages and said[at] >= 0x20:
                    said[at] ^= 1 << self.rng.randrange(5)
        return bytes(said)


def checked(record, wire):
    assert [*record.code] == [word >> 9 & 0xFFF for word in wire.words]
    assert record.cycle == 77
    assert record.clock_hz == CLOCK_HZ


@pytest.mark.parametrize("word", TRIGGERS)
def test_plain_lines_bring_a_record(rng, word):
    wire = Scoped(rng)
    level = 40.0 if word in ("rise", "fall") else None
    record = acquire(wire, Acquisition(Trigger(word, level, 25)))
    checked(record, wire)
    assert record.trigger == DEPTH - 1 - wire.scope().after == DEPTH // 4
    assert "64 entries from" in told(record)
    assert "entrys" not in told(record)


def test_it_triggers_by_itself_after_a_while(rng):
    wire = Scoped(rng, waits=10**9)
    record = acquire(wire, Acquisition(Trigger("short")), auto_s=0.5)
    checked(record, wire)
    assert 0.5 < wire.time_s() < 2


def test_numbered_lines_bring_a_record_over_a_link_that_damages_bytes(rng):
    """Whatever is damaged comes again; nothing wrong is taken for an entry."""
    wire = Scoped(rng, damages=2)
    wanted = Acquisition(Trigger("now"))
    link = Link(wire, wanted.hear)
    link.await_greeting()
    sent = None
    while wanted.record is None:
        if sent is not None and sent.answer is not None:
            wanted.answered(sent.answer)
            sent = None
        line = None if sent else wanted.line(wire.time_s())
        if line is not None:
            sent = link.send_line(line)
        link.poll(0.01)
        assert wire.time_s() < 60
    checked(wanted.record, wire)


def test_a_damaged_state_is_not_taken():
    wanted = Acquisition(Trigger("now"))
    wanted.line(0.0)
    wanted.answered("ok")
    assert wanted.hear("[SCOPE:full,64,64,3,1,2000000*0000]")
    assert wanted.state == "armed"
    assert not wanted.hear("[MSG:something]")


def test_a_record_that_keeps_arriving_damaged_is_given_up(rng):
    wire = Scoped(rng, damages=400)
    with pytest.raises((LinkError, UserError)):
        acquire(wire, Acquisition(Trigger("now")))


def test_a_part_that_never_comes_whole_is_given_up():
    wanted = Acquisition(Trigger("now"))
    wanted.line(0.0)
    wanted.answered("ok")
    wanted.line(1.0)
    text = "SCOPE:full,64,64,3,1,2000000"
    assert wanted.hear(f"[{text}*{crc_hqx(text.encode(), 0xFFFF):04X}]")
    wanted.answered("ok")
    for _ in range(DAMAGED - 1):
        assert wanted.line(2.0) == "$SCOPE=READ,0,64"
        wanted.answered("ok")
    wanted.line(3.0)
    with pytest.raises(LinkError, match=r"^the record of the oscilloscope arrives damaged again "):
        wanted.answered("ok")


def test_a_stop_by_another_hand_is_told(rng):
    wire = Scoped(rng, waits=10**9)
    wanted = Acquisition(Trigger("short"))
    link = Link(wire, wanted.hear)
    link.await_greeting()
    for line in (wanted.line(0.0), "$SCOPE=STOP"):
        link.command(line)
    wanted.answered("ok")
    link.command(wanted.line(1.0))
    with pytest.raises(UserError, match="was stopped before its record was full"):
        wanted.answered("ok")


def test_a_build_without_it_says_so(rng):
    wire = Scoped(rng)
    words = wire.scope()
    words.depth = 0
    wire.library.gk_scope_write(ctypes.byref(words))
    with pytest.raises(UserError, match="built without the oscilloscope"):
        acquire(wire, Acquisition(Trigger("now")))


def test_a_guarded_link_refuses_plain_lines_with_its_reason(rng):
    wire = Scoped(rng)
    link = Link(wire, lambda line: None)
    link.await_greeting()
    link.command("$G")
    with pytest.raises(UserError, match="until a reset it needs a number"):
        acquire(wire, Acquisition(Trigger("now")))


def test_silence_is_told():
    class Silent:
        now = 0.0

        def write(self, data):
            pass

        def read(self, timeout_s):
            self.now += timeout_s
            return b""

        def time_s(self):
            return self.now

    with pytest.raises(LinkError, match="nobody answers: the controller is off"):
        acquire(Silent(), Acquisition(Trigger("now")))


class Board(Scoped):
    """The same as a machine that clients connect to."""

    byte_s = 1e-5

    def armed(self):
        return True

    def button_arm(self, down):
        pass


def gapkeeper(*arguments):
    return CliRunner().invoke(app, ["scope", *map(str, arguments)])


def test_the_command_writes_its_files_and_tells_what_is_in_them(tmp_path, rng):
    wire = Board(rng)
    files = tmp_path / "one.csv", tmp_path / "two.fst"
    with serving(wire) as (url, _):
        done = gapkeeper("--port", url, "--trigger", "rise=40", "--before", 25, "-o", files[0],
                         "-o", files[1])
    assert done.exit_code == 0, done.exception
    told_, *names = done.output.splitlines()
    assert told_.startswith("64 entries from")
    assert names == [str(name) for name in files]
    assert len(files[0].read_text().splitlines()) == DEPTH + 1
    assert files[1].stat().st_size > 100
    assert (wire.scope().source, wire.scope().level) == (4, 40 * 4096 // 100)


def test_help_names_every_option():
    told_ = CliRunner().invoke(app, ["scope", "--help"], env={"COLUMNS": "100"}).output
    for word in ("--port", "--trigger", "retraction", "rise=V", "--before", "--auto", "-o", ".fst",
                 "--baud", "not reset"):
        assert word in told_, word


@pytest.mark.parametrize(("words", "says"), [
    (["--trigger", "sparks"], '"sparks" is no trigger'),
    (["-o", "gap.txt"], "no name for a record"),
    (["--port", "nowhere://"], "names no port")])
def test_a_wrong_word_is_one_sentence(words, says):
    done = gapkeeper(*words)
    assert isinstance(done.exception, UsageError)
    assert says in str(done.exception)


def test_an_array_of_a_record_is_of_whole_clocks(record):
    assert record.clock.dtype == np.int64
