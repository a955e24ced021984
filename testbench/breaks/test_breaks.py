# SPDX-License-Identifier: Apache-2.0
"""Planted breaks: the tests that must see a break do see it.

Always: the table fits the present sources, and three breaks are planted. In the soak: all of them
are planted, one after the other, and the same tests also run with nothing broken. Of each block of
the gateware at least one break is seen by a test that runs its Verilog under cocotb.
"""

import ast
from pathlib import Path

import pytest

from host.link.link import RefusedError
from testbench.breaks.harness import (
    IN_VERILOG,
    ROOT,
    Break,
    Verdict,
    applied,
    run_whole,
    try_break,
)
from testbench.breaks.table import EQUIVALENT, SHORT, TABLE
from testbench.breaks.witness import SAW, judge
from testbench.quick import is_quick
from testbench.simulators.blocks import blocks
from testbench.some import some

ALL = [*TABLE, *(one.what for one in EQUIVALENT)]
FEWEST = 100
SEEN_AT_LEAST = 0.95    # share of all planted breaks; each of the others has a reason
QUICKLY_AT_LEAST = 0.7  # share that quick tests alone must see

LIMITER = "rtl/power/limiter.py"
LEVEL = "eq(Mux(self.level > level_max, level_max, self.level))"
LIMITS = ("testbench/unit/rtl/test_pulse_generator.py::test_limits_follow_the_model",)


def test_the_table_is_long_enough_and_each_break_is_another():
    assert len(TABLE) >= FEWEST
    assert len({str(one) for one in ALL}) == len(ALL)
    assert len({(one.file, applied(one)) for one in ALL}) == len(ALL)
    assert len(TABLE) >= SEEN_AT_LEAST * len(ALL)
    assert all(len(one.argument) > 40 for one in EQUIVALENT)


@pytest.mark.parametrize("file", sorted({one.file for one in ALL}))
def test_breaks_fit_their_file(file):
    """The text to change occurs exactly once; else the break must be adapted to the source."""
    for one in ALL:
        if one.file == file:
            applied(one)


def test_tests_that_must_see_them_are_there():
    for test in {test for one in ALL for test in one.tests}:
        path, _, name = test.partition("::")
        tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
        tests = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        assert name in tests if name else any(test.startswith("test_") for test in tests), test


def within(block: str) -> list[Break]:
    """Breaks of the table in the source of a block, as ``motion.arc.ArcDistributor``."""
    module, _, name = block.rpartition(".")
    folder = "" if module.startswith("softcore.") else "rtl/"
    file = f"{folder}{module.replace('.', '/')}.py"
    source = (ROOT / file).read_text(encoding="utf-8")
    (kind,) = (node for node in ast.parse(source).body
               if isinstance(node, ast.ClassDef) and node.name == name)
    return [one for one in TABLE if one.file == file and
            kind.lineno <= source[:source.index(one.old)].count("\n") + 1 <= kind.end_lineno]


def test_every_block_has_a_break():
    assert not [block for block in blocks() if not within(block)]


def test_most_are_seen_by_quick_tests():
    """``make check`` runs every test that must see them."""
    quickly = [one for one in TABLE
               if all(is_quick(test.partition("::")[0]) for test in one.tests)]
    assert len(quickly) >= QUICKLY_AT_LEAST * len(ALL)


@pytest.mark.parametrize("name", some(SHORT, *SHORT[1:]))
def test_a_few_are_seen(name):
    (one,) = (one for one in TABLE if str(one) == name)
    verdict, said = try_break(one)
    assert verdict is Verdict.SEEN, said


@pytest.mark.parametrize(("error", "place", "saw"), [
    (AssertionError("3 is not 4"), "testbench/unit/rtl/test_feed.py", True),
    (AssertionError("no such width"), "hdl/_ir.py", False),
    (TimeoutError("still waiting"), "host/link/link.py", True),
    (RefusedError("$X", "the interlock stays open"), "host/link/link.py", True),
    (IndexError("list index out of range"), "testbench/firmware.py", True),
    (IndexError("list index out of range"), "rtl/motion/feed.py", False),
    (NameError("name 'spacing' is not defined"), "rtl/motion/feed.py", False),
    (AttributeError("no attribute 'room'"), "testbench/unit/rtl/test_feed.py", False),
    (RuntimeError("does not compile"), "softcore/image.py", False),
])
def test_only_what_was_looked_at_is_a_sight(error, place, saw):
    assert (judge(error, ROOT / place) == SAW) == saw


def test_a_test_that_fails_by_its_own_word_is_a_sight():
    with pytest.raises(pytest.fail.Exception) as caught:
        pytest.fail("DID NOT RAISE")
    assert judge(caught.value, Path("_pytest/outcomes.py")) == SAW


@pytest.mark.soak
@pytest.mark.parametrize(("old", "new", "tests", "verdict"), [
    (LEVEL, "eq(self.level)", LIMITS, Verdict.SEEN),
    ("raise ValueError(f\"on_max", "raise OSError(f\"on_max", LIMITS, Verdict.SURVIVED),
    (LEVEL, "eq(self.lebel)", LIMITS, Verdict.ERROR),
    (LEVEL, "eq(lebel)", LIMITS, Verdict.ERROR),
    (LEVEL, "eq(self.level)", (f"{LIMITS[0]}_of_the_sky",), Verdict.ERROR),
])
def test_verdicts(old, new, tests, verdict):
    assert try_break(Break(LIMITER, old, new, tests, "to try the harness"))[0] is verdict


@pytest.mark.soak
def test_firmware_that_does_not_compile_is_no_sight():
    one = Break("softcore/firmware/base/alarm.c", "    hal_disarm();\n", "    hal_disarm()\n",
                ("testbench/unit/firmware/test_machine.py",), "to try the harness")
    assert try_break(one)[0] is Verdict.ERROR


@pytest.mark.soak
@pytest.mark.parametrize("test", sorted({test for one in ALL for test in one.tests}))
def test_the_same_tests_pass_with_nothing_broken(test):
    passed, said = run_whole([test])
    assert passed, said


@pytest.mark.soak
@pytest.mark.parametrize("one", TABLE, ids=str)
def test_every_break_is_seen(one):
    verdict, said = try_break(one)
    assert verdict is Verdict.SEEN, said


@pytest.mark.soak
@pytest.mark.parametrize("block", blocks())
def test_every_block_has_a_break_that_is_seen_under_cocotb(block):
    said = ""
    for one in within(block):
        verdict, said = try_break(one, IN_VERILOG)
        if verdict is Verdict.SEEN:
            return
    pytest.fail(f"no break of {block} is seen in its Verilog; the last test said:\n{said}")


@pytest.mark.soak
@pytest.mark.parametrize("one", EQUIVALENT, ids=str)
def test_what_is_equivalent_changes_nothing(one):
    verdict, said = try_break(one.what)
    assert verdict is Verdict.SURVIVED, said
