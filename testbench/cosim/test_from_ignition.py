# SPDX-License-Identifier: Apache-2.0
"""Tapes with on-times from the gate and from the ignition: what each spark burns, in the plant."""

import pytest

from testbench.cosim.sparks import UNSEEN, cut

LATE = 1    # clocks by which the simulated machine answers a gate; on a real one setting 480


@pytest.mark.parametrize(("place", "on_us", "wait", "seconds", "fewest"), [
    pytest.param("wire", 5, "B20", 2.6, 300, marks=pytest.mark.soak),
    ("sinker", 15, "", 1.6, 2000)], ids=["wire", "sinker"])
def test_every_spark_that_is_not_cut_off_burns_for_the_on_time(place, on_us, wait, seconds, fewest):
    """To the clock from the ignition; from the gate the burning time varies by a third and more."""
    gate = cut(place, "A0", seconds=seconds)
    lit = cut(place, f"A1 {wait}", seconds=seconds)
    assert (gate.outcome, lit.outcome) == ("stopped", "stopped")
    clocks = {spark.clocks for spark in lit.sparks if spark.ended == "time"}
    assert clocks == {on_us * lit.clock_hz // 10**6 + LATE}
    assert len(lit.times_us("time")) >= fewest
    assert gate.spread("time")[1] > 0.33
    assert gate.spread("time")[0] < on_us
    # What the end of the wait cuts off was not seen yet: pads, comparators and the clock of LATE.
    unseen = lit.times_us("wait")
    assert unseen
    assert max(unseen) * lit.clock_hz / 1e6 <= UNSEEN + LATE
    assert lit.removed_mm3 > gate.removed_mm3
    # No pulse is lost: each has a class, but for the one under way at the end.
    for done in (gate, lit):
        assert done.pulses - sum(done.classes) in (0, 1)
