# SPDX-License-Identifier: Apache-2.0
"""Bits that turn over anywhere: what came of them, by the part of the controller they are in."""

import random
from collections import Counter
from dataclasses import dataclass

from testbench.cosim.job import Job
from testbench.faults.outcome import Found, Outcome
from testbench.faults.trials import Trial, run_trials

__all__ = ["BORNE", "SHARE", "Flips", "measure", "turn_over"]

BORNE = (Outcome.NO_EFFECT, Outcome.SAFE_TOLD, Outcome.SAFE_UNTOLD)
SHARE = 0.005       # of all that may end wrong, each listed
PROCESSOR = "soc.cpu."


def turn_over(job: Job, rng: random.Random) -> str:
    """Turn any bit of any register over; its name. The processor's are among them."""
    state = job.session.state()
    inside = [index for index, (name, _) in enumerate(state) if name.startswith("soc.")]
    weights = [state[index][1] for index in inside]
    while True:
        index, = rng.choices(inside, weights)
        name, bits = state[index]
        bit = rng.randrange(bits)
        if job.session.turn_over(index, bit):
            return f"{name} bit {bit}"


@dataclass(frozen=True)
class Flips:
    """What came of bits, by the part that they are in."""

    found: tuple[Found, ...]

    @property
    def parts(self) -> dict[str, Counter]:
        """Outcomes by part."""
        parts = {}
        for one in self.found:
            part = "processor" if one.why.startswith(PROCESSOR) else "gateware"
            parts.setdefault(part, Counter())[one.outcome] += 1
        return dict(sorted(parts.items()))

    @property
    def wrong(self) -> list[str]:
        """Each that ended wrong."""
        return [one.why for one in self.found if one.outcome is Outcome.WRONG]

    @property
    def good(self) -> bool:
        """No more than the share that may end wrong."""
        return len(self.wrong) <= SHARE * len(self.found)


def measure(count: int, seed: int) -> Flips:
    """Turn so many bits over, each in a cut of its own.

    Raises
    ------
    testbench.native.branch.BranchError
        If it cannot be tried.
    """
    (_, found), = run_trials([Trial("any bit", turn_over, None, BORNE, count=count)], seed)
    return Flips(tuple(found))
