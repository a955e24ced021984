# SPDX-License-Identifier: Apache-2.0
"""Reaction times to a short, measured at the speeds that are hardest for the controller."""

from testbench.cosim.checks import check_returns
from testbench.cosim.job import Data, Job, program
from testbench.cosim.retractions import clear_after, figures, pace
from testbench.native.station import Session

__all__ = ["SPEEDS", "at_speed", "summary"]

# mm/min, and how many shorts. Pulses come closest just below the start/stop speed (600), and at no
# fixed phase to anything else; above it the machine must slow down first.
SPEEDS = ((593, 24), (1200, 6))
MOST = 0xFFFF           # of the gateware's count
SLOW_HZ = 2_000_000     # at this clock, no short takes as many


def at_speed(session: Session, speed: float, shorts: int) -> dict:
    """Shorts at a feed in mm/min, each at another phase of the path and gap pulses."""
    data = Data(limit=0.2, changeover=0.01, high=600, low=600)
    job = Job(session)
    job.start(program(data, f"G01 Z-5 F{speed:g}"))
    for number in range(shorts):
        job.reach(2000 + 1200 * number, pace(session, speed))
        job.run(1 + 7 * number)
        job.short(True)
        clear_after(job, 100, data.speed)
        job.wait("resume", number + 1)
    job.finish()
    assert len(check_returns(job, data)) == shorts
    found = figures(job)
    assert len(found["reactions"]) == shorts
    # The two counts of the same clocks agree: that of the gateware, which has 16 bits, and that of
    # the probes. Only a slowing down at a board's clock takes longer than the gateware counts.
    counts = [one["last_forward"] for one in found["reactions"]]
    full = [one for one in found["reactions"] if one["last_forward"] >= MOST]
    assert not full or session.clock_hz > SLOW_HZ, "the gateware's count is full"
    assert all(one["slowed"] for one in full), "the gateware's count is full"
    assert [event["latency_cycles"] for event in job.told("retraction_start")] == [
        min(count, MOST) for count in counts]
    return found


def summary(reactions: list[dict]) -> dict[str, tuple[float, int]]:
    """Mean and worst of each figure that applies, in clocks, by its description."""
    fast = any(one["slowed"] for one in reactions)
    figures_of = {
        "completing sample to begin of deceleration": "slowed",
        "last forward pulse to reversed command": "reversed",
        "event to its being taken by firmware": "taken",
    } if fast else {
        "completing sample to last forward pulse": "last_forward",
        "completing sample to reversed command": "reversed",
        "completing sample to firmware taking the event": "taken",
    }
    found = {}
    for title, name in figures_of.items():
        clocks = [one[name] for one in reactions]
        found[title] = sum(clocks) / len(clocks), max(clocks)
    return found
