# SPDX-License-Identifier: Apache-2.0
"""``rtl.gap.preset_counter`` over many strobes, against the exact probabilities of UP and DOWN."""

import math

import numpy as np
import pytest

from testbench.models.discriminator import DAME, OK, OPEN
from testbench.models.preset_counter import ACCUMULATE, CONSECUTIVE
from testbench.native.preset_counter import INPUTS, by_name, compiled
from testbench.some import some

# The second patent's presets of 5, 6 and 7, from the highest resistance of the fluid to the lowest.
ROWS = [(3, 6, 14), (5, 5, 18), (8, 3, 22), (13, 2, 28)]
PULSES = 50       # a strobe
STROBES = 20_000
CROWDED, STABLE = (0.6, 0.05, 0.35), (0.02, 0.1, 0.88)  # shares of DAME, OPEN and OK


class Race:
    """Exact probabilities at a strobe: the counters as a Markov chain in its steady state.

    ``shares`` are the probabilities of DAME, OPEN and OK; pulses are independent.
    """

    def __init__(self, presets, shares, *, runs):
        states, found = [(0, 0, 0)], {(0, 0, 0): 0}
        targets = [[], [], []]
        for state in states:  # grows
            for kind, reached in enumerate(targets):
                after = self._pulse(state, kind, presets, runs)
                if after not in found:
                    found[after] = len(states)
                    states.append(after)
                reached.append(found[after])
        fives, sixes, _ = np.array(states).T
        self.up = fives == presets[0]
        self.down = (sixes == presets[1]) & ~self.up
        self.cleared = [found[0, 0, state[2]] if moved else found[state]
                        for state, moved in zip(states, self.up | self.down, strict=True)]
        self.moves = list(zip(shares, targets, strict=True))
        self.steady = np.eye(1, len(states))[0]  # at a strobe
        while True:
            before, self.steady = self.steady, self._period(self.steady)
            if abs(self.steady - before).max() < 1e-8:
                break

    @staticmethod
    def _pulse(state, kind, presets, runs):
        counts = [0 if runs and number != kind and (number == 2 or count < preset) else count
                  for number, (count, preset) in enumerate(zip(state, presets, strict=True))]
        counts[kind] = min(counts[kind] + 1, presets[kind])
        return tuple(counts) if counts[2] < presets[2] else (0, 0, 0)

    def _period(self, odds):
        """Probabilities of the states at the next strobe."""
        odds = np.bincount(self.cleared, odds, len(odds))
        for _ in range(PULSES):
            odds = sum(share * np.bincount(target, odds, len(odds))
                       for share, target in self.moves)
        return odds

    def share(self, ends):
        """Share of the strobes in the states ``ends``, and three sigma of it in ``STROBES``.

        Strobes depend on those before them, as counts are carried over: hence the covariances.
        """
        share = self.steady @ ends
        variance = share * (1 - share)
        if share:
            after = self.steady * ends / share
            for _ in range(60):  # they fade by an eighth a strobe, at the slowest
                after = self._period(after)
                variance += 2 * share * (after @ ends - share)
        return share, 3 * math.sqrt(variance / STROBES)


def raced(presets, shares, mode, seed):
    """Shares of UP and DOWN in ``STROBES`` strobes of the compiled block."""
    settled = 100  # strobes to the steady state
    clocks = (settled + STROBES) * PULSES
    pulses = np.random.default_rng(seed).choice([DAME, OPEN, OK], clocks, p=shares)
    inputs = np.empty((clocks, len(INPUTS)), dtype=np.uint32)
    row = dict.fromkeys(INPUTS, 0) | dict(zip(("dame", "open", "ok"), presets, strict=True),
                                          sample=1, mode=mode, period=PULSES)
    inputs[:] = [row[name] for name in INPUTS]
    inputs[:, INPUTS.index("kind")] = pulses
    # The last strobe would be seen a clock after the last.
    up, down, strobe, *_ = by_name(compiled(inputs)[(settled - 1) * PULSES + 1:]).T
    assert strobe.sum() == STROBES
    return up.sum() / STROBES, down.sum() / STROBES


@pytest.mark.parametrize(("shares", "mode", "row", "known"), some([
    # Known figures, UP of the crowded gap and DOWN of the stable one: by a simulation of unknown
    # length, so with an error of their own.
    (CROWDED, ACCUMULATE, 0, 0.87), (CROWDED, ACCUMULATE, 1, 0.83),
    (CROWDED, ACCUMULATE, 2, 0.78), (CROWDED, ACCUMULATE, 3, 0.72),
    (CROWDED, CONSECUTIVE, 0, 0.998), (CROWDED, CONSECUTIVE, 1, 0.84),
    (CROWDED, CONSECUTIVE, 2, 0.30), (CROWDED, CONSECUTIVE, 3, 0.026),
    (STABLE, ACCUMULATE, 0, 0), (STABLE, ACCUMULATE, 1, 0.013),
    (STABLE, ACCUMULATE, 2, 0.19), (STABLE, ACCUMULATE, 3, 0.43),
], (CROWDED, ACCUMULATE, 0, 0.87), (CROWDED, CONSECUTIVE, 3, 0.026), (STABLE, ACCUMULATE, 3, 0.43)))
def test_race(rng, shares, mode, row, known):
    race = Race(ROWS[row], shares, runs=mode == CONSECUTIVE)
    exact = [race.share(ends) for ends in (race.up, race.down)]
    assert exact[shares == STABLE][0] == pytest.approx(known, abs=0.02)
    found = raced(ROWS[row], shares, mode, rng.randrange(1 << 30))
    # For shares so small that single strobes matter, three more are allowed.
    for (share, error), counted in zip(exact, found, strict=True):
        assert counted == pytest.approx(share, abs=max(error, 3 / STROBES))
    if shares == STABLE:
        assert exact[0][0] < 0.002
