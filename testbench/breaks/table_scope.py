# SPDX-License-Identifier: Apache-2.0
"""Planted breaks of the gap oscilloscope: what it records, when it triggers, how it is read."""

from testbench.breaks.harness import breaks_of

__all__ = ["SCOPE"]

LINES = "unit/firmware/test_scope.py"
RECORD = "unit/host/test_scope.py"

SCOPE = (
    *breaks_of(
        "rtl/gap/scope.py", "unit/rtl/test_scope.py",
        ("now.sampled | (now.pulse != Pulse.NONE)", "(now.pulse != Pulse.NONE)",
         "a sample makes an entry"),
        ("(now.pulse != Pulse.NONE) | stamp.all()", "stamp.all()", "a class makes an entry"),
        (" | stamp.all())", ")", "no stamp overflows"),
        ("Mux(taken, 1, stamp + 1)", "Mux(taken, 0, stamp + 1)", "stamps count every clock"),
        ("left.eq(self.after), self.time", "left.eq(self.after - 1), self.time",
         "the record ends with the right entry"),
        ("whole.eq(whole | newest.all())", "whole.eq(newest.all())",
         "a ring that was full stays full"),
        ("place.eq(Mux(whole, newest, 0) + self.place)", "place.eq(self.place)",
         "the oldest entry is read first"),
        ("now.shorted & ~was.shorted & ~first", "now.shorted & ~was.shorted",
         "Ss that was there when it was armed is no trigger"),
        ("crosses.eq(now.sampled & known & (low != below))",
         "crosses.eq(now.sampled & (low != below))", "the first sample crosses no level"),
        ("with m.Elif(now.sampled):\n            m.d.sync += [known", "with m.Else():\n"
         "            m.d.sync += [known", "only samples are compared with the level"),
        ("looked.eq(0), stamp.eq(0)]", "looked.eq(0)]", "the first stamp is 0"),
        ("        with m.If(runs):\n            m.d.sync += [\n                now.high",
         "        with m.If(1):\n            m.d.sync += [\n                now.high",
         "what is before the arming counts for nothing"),
        ("        with m.If(self.arm):\n            m.d.sync += [self.recording",
         "        with m.If(self.arm & ~self.stop):\n            m.d.sync += [self.recording",
         "arming wins over a stop"),
    ),
    *breaks_of(
        "softcore/firmware/app/scope.c", LINES,
        ("length == BEGIN - 1", "length <= BEGIN", "an empty order is refused"),
        ("depth - 1 - depth * before / 100", "depth - depth * before / 100",
         "the share before the trigger"),
        ("count > now.count - *first", "count > now.count", "only entries of the record are read"),
        ("now.recording != HAL_SCOPE_FULL", "now.recording == HAL_SCOPE_IDLE",
         "only a full record is read"),
        ("crosses != (at < length) ||", "false ||", "only RISE and FALL have a level"),
    ),
    *breaks_of(
        "host/scope/acquire.py", RECORD,
        ('if checked is None or f"{crc(checked[1].encode()):04X}" != checked[2]:',
         "if checked is None:", "a damaged line is not taken"),
        ("elif self._first_missing() < min(first + CHUNK, self.count):", "elif False:",
         "a record that is damaged for ever is given up"),
    ),
    *breaks_of(
        "host/scope/record.py", RECORD,
        ("return cls(clock_hz, trigger, cycle, clock - clock[trigger],",
         "return cls(clock_hz, trigger, cycle, clock,", "time counts from the trigger"),
        ("if at + 1 == len(self) or clocks[at + 1] > clock + 1:", "if False:",
         "a class lasts one clock in the waveform"),
    ),
)
