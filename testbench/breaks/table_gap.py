# SPDX-License-Identifier: Apache-2.0
"""Planted breaks of the gap's blocks: counters, feed modes, fluid, converter and references."""

from testbench.breaks.harness import breaks_of

__all__ = ["GAP"]

GAP = (
    *breaks_of(
        "rtl/gap/preset_counter.py", "unit/rtl/test_preset_counter.py",
        ("(number >= self.period)", "(number > self.period)", "a strobe comes in its clock"),
        ("m.If(self.freeze | due |", "m.If(due |", "a freeze restarts the time device"),
        ("\n                                   | (self.kind == PulseClass.SHORT)", "",
         "counter 5 counts shorts too"),
        ("cleared.eq(filled_ok & ~ok_alone)", "cleared.eq(0)", "good pulses clear both counters"),
        ("(moved & ~own_gate)", "moved", "each gate clears its own counter"),
        ("below.eq(less & carried[-1])", "below.eq(0)", "no count goes below 0"),
        ("reached.eq(after >= preset)", "reached.eq(after > preset)", "full at the preset"),
        ("with_this >= self.window", "with_this > self.window", "a window has so many pulses"),
        ("| (consecutive & self.sample & ~pulse)", "", "pulses in a row"),
        ("up.eq(moved & widens)", "up.eq(moved & widens & ~full[1])", "both full widen the gap"),
        ("self.up.eq(up & ~self.freeze)", "self.up.eq(up)", "a freeze stops UP in its clock"),
    ),
    *breaks_of(
        "rtl/gap/feed_mode.py", "unit/rtl/test_feed_mode.py",
        ("Mux(self.known, self.mean - self.reference, 0)", "self.mean - self.reference",
         "without a mean the voltage is the reference"),
        ("below.eq((deviation < 0) & ~removal)", "below.eq(deviation < 0)",
         "a ratio is never negative"),
        ("Mux(product[SCALE + RATE:].any(), (1 << RATE) - 1,\n"
         "                                        product[SCALE:])", "product[SCALE:]",
         "a product too large is the largest rate"),
        ("total < 0, 0,", "total < 0, 1,", "the feed is at least 0"),
        ("self.highest, total)))", "total, total)))", "no feed above the highest"),
        ("(rounds == 2), result", "(rounds != 0), result",
         "until it is computed the feed is the rate"),
        ("due & back & ~self.held", "due & back", "no step while held"),
    ),
    *breaks_of(
        "rtl/gap/fluid.py", "unit/rtl/test_fluid.py",
        ("count == (1 << self.shift) - 1", "count == 0", "an average has so many samples"),
        ("add.eq(below & (low_side == step[0]))", "add.eq(below)",
         "between the edges nothing changes"),
        ("minus.eq(~step[0] & (step != 0))", "minus.eq(0)", "hysteresis on both sides"),
        ("(edge < before)", "(edge <= before)", "each class has a code of its own"),
        ("in_order & ~below & ~above", "in_order & ~below", "a broken wire changes no class"),
        ("Mux(self.manual, self.manual_class, self.measured)", "self.measured",
         "the class by hand is in force"),
        ("self.changed.eq(self.class_ != last)", "self.changed.eq(self.measured != last)",
         "a class by hand is a change"),
    ),
    *breaks_of(
        "rtl/gap/sampler.py", "unit/rtl/test_sampler.py",
        ("asked.eq(frame == self.every - 1)", "asked.eq(frame == 0)",
         "the last frame is the fluid's"),
        ("right.eq(word[12:] == expected)", "right.eq(1)", "an answer of another channel is wrong"),
        ("taken.eq(lasts[-1] & judged)", "taken.eq(lasts[-1])", "the first answer has no command"),
        ("with m.If(rises[-1]):", "with m.If(rise):", "an answer comes after the pads' delay"),
        ("with m.If(wrong[~expected] == 0):", "with m.If(1):",
         "a fault ends when both channels are right"),
        ("with m.If(~self.fault & expected):", "with m.If(expected):", "no result in a fault"),
        ("wrong[expected] == PATIENCE - 1", "wrong[expected] == PATIENCE - 2",
         "the fourth wrong answer is the fault"),
    ),
    *breaks_of(
        "rtl/gap/reference.py", "unit/rtl/test_reference.py",
        ("self.level[index])", "self.level[0])", "each stream has a level of its own"),
        ("m.d.sync += Cat(remainder, self.stream[index])", "m.d.sync += Cat(Signal(self.BITS), "
         "self.stream[index])", "the remainder is kept"),
    ),
    *breaks_of(
        "rtl/gap/gap.py", "unit/rtl/test_gap_rules.py",
        ("by_current.eq(registers.short_current != 0)", "by_current.eq(0)",
         "Ss goes by the current if that is set"),
    ),
    *breaks_of(
        "rtl/gap/conduction.py", "unit/rtl/test_conduction.py",
        ("self.current & (self.last |", "(self.last |", "a current that ends is no short"),
        ("(self.last | ~(same & over))", "(self.last | ~(same & 0))",
         "a discharge after a delay is no short"),
        ("~(same & over)", "~over", "every pulse begins anew"),
        ("(age == self.delay)", "(age == 1)", "the delay is as long as set"),
        ("(gates != 0) & self.current", "self.current", "no conduction without a pulse"),
    ),
)
