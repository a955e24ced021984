# SPDX-License-Identifier: Apache-2.0
"""The table of blocks is made from what ran, and shows a block that no test has run."""

from amaranth.hdl import Fragment

from rtl.gap.reference import References
from rtl.safety.arming import Arming
from testbench.simulators import blocks


def ran(*reached):
    """What tests have reached: how, block, whether it was the design itself."""
    return [[one] for one in reached]


def test_every_component_of_the_gateware_is_a_block():
    names = blocks.blocks()
    assert {"controller.Controller", "gap.short.ShortDetector", "motion.axis.Axis",
            "safety.interlock.Interlock", "pads.Pads"} <= set(names)
    assert len(names) == len(set(names)) > 40


def test_a_design_is_noted_with_its_parts():
    assert blocks.parts_of(Fragment.get(Arming(clock_hz=1000), None)) == [
        ("lib.debounce.Debounce", False), ("safety.arming.Arming", True)]


def test_what_is_noted_is_taken_once():
    before = blocks.taken()
    try:
        blocks.note(blocks.PROOF, Fragment.get(References(), None))
        assert blocks.taken() == [(blocks.PROOF, "gap.reference.References", True)]
        assert blocks.taken() == []
    finally:
        blocks.add(before)


def test_a_block_that_did_not_run_under_cocotb_is_a_gap():
    everywhere = [(blocks.COCOTB, name, True) for name in blocks.blocks()]
    assert blocks.gaps(ran(*everywhere)) == []
    without = [one for one in everywhere if one[1] != "motion.ramp.Ramp"]
    elsewhere = [(how, "motion.ramp.Ramp", True) for how in (blocks.AMARANTH, blocks.PROOF)]
    assert blocks.gaps(ran(*without, *elsewhere)) == ["motion.ramp.Ramp"]


def test_a_block_that_ran_within_another_only_is_a_gap():
    everywhere = [(blocks.COCOTB, name, name not in blocks.WITHIN) for name in blocks.blocks()]
    assert set(blocks.WITHIN) <= set(blocks.blocks())
    assert blocks.gaps(ran(*everywhere)) == []
    within = [(how, name, itself and name != "motion.ramp.Ramp")
              for how, name, itself in everywhere]
    assert blocks.gaps(ran(*within)) == ["motion.ramp.Ramp"]


def test_the_table_counts_tests():
    lines = blocks.table(ran(*[(blocks.COCOTB, "motion.ramp.Ramp", True)] * 3,
                             *[(blocks.COCOTB, "motion.ramp.Ramp", False)] * 2,
                             (blocks.PROOF, "motion.ramp.Ramp", False)))
    assert len(lines) == len(blocks.blocks()) + 1
    (row,) = (line for line in lines if line.startswith("motion.ramp.Ramp"))
    assert row.split() == ["motion.ramp.Ramp", "3", "+2", "-", "+1"]


def test_blocks_that_join_others_are_noted_when_the_whole_controller_has_run():
    assert set(blocks.JOINING) <= set(blocks.blocks())
    before = blocks.taken()
    try:
        blocks.joined()
        assert [name for _, name, _ in blocks.taken()] == sorted(blocks.JOINING)
    finally:
        blocks.add(before)
