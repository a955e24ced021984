# SPDX-License-Identifier: Apache-2.0
"""Statistics of the simulated gap's discharges, compared with closed forms."""

import itertools
import math
import statistics

import pytest

from host.machines.machine import load
from testbench.native.alone import Alone

MACHINE = load("sinker").tables
SIGMAS = 3
POINT_SIGMAS = 4        # of a single point among many
OFF, OPEN, BURNING, ARCING, SHORTED = range(5)      # read.state
ON_US, OFF_US = 250, 50                             # the pulse of JP S60-10852 B
# Of resistivity: the four columns of the second patent's table, and oil. In ohm cm.
FLUIDS = [1e9, 1e6, 1.25e5, 4e4, 1e3]


@pytest.fixture
def plant(rng):
    machine = Alone(machine=MACHINE, seed=rng.getrandbits(32))
    machine.set("debris.bridge_rate_per_s", 0)
    return machine


def tau_us(gap_um, debris=0.0, decades=0.0):
    """Mean delay by sinker.toml and the formulas of domain knowledge."""
    return 60 * math.exp((gap_um - 40) / 12) / (1 + 4 * debris) / 10**(0.3 * decades)


def alone(plant):
    """Allow only sparks and open pulses."""
    plant.set("debris.arc_share", 0)
    plant.set("debris.single_short", 0)


def delays(plant, count, tau):
    """Delays in us, but for pulses that did not ignite in 15 time constants.

    The integral of the hazard is looked at every us: ``b - 1`` us of it at ``b``, from 2 us on.
    """
    found = [plant.pulse(on_us=round(15 * tau) + 10, off_us=20) for _ in range(count)]
    assert found.count(None) <= 2
    return [delay for delay in found if delay is not None]


def laue(found, survival, shares):
    """Largest deviation of ln N(t)/N0 from a distribution's, in its standard deviations.

    It is evaluated where the distribution has these shares left. ``survival`` is a function of the
    time since 1 us after the gate.
    """
    worst = 0.0
    for share in shares:
        after = 1
        while survival(after) > share:
            after += 1
        expected = survival(after)
        left = sum(delay > after + 1 for delay in found) / len(found)
        sigma = math.sqrt((1 - expected) / expected / len(found))
        worst = max(worst, abs(math.log(left / expected)) / sigma)
    return worst


SHARES = (0.9, 0.75, 0.5, 0.3, 0.15, 0.05)


@pytest.mark.parametrize(("gap_um", "debris"), [
    (25, 0), (40, 0), (55, 0), (70, 0), (30, 0.5), (52, 0.5)])
def test_delays_are_exponential(plant, gap_um, debris):
    # Laue plot: ln N(t)/N0 is a line of slope -1/tau. The slope is the likeliest one, of the time
    # after 5 us; its standard deviation is that of 1/n.
    alone(plant)
    plant.hold(gap_um=gap_um, debris=debris)
    tau = tau_us(gap_um, debris)
    found = delays(plant, 3000, tau)
    assert laue(found, lambda after: math.exp(-after / tau), SHARES) < POINT_SIGMAS
    late = [delay - 5 for delay in found if delay > 5]
    slope = -math.log(1 - len(late) / sum(late))
    assert slope * tau == pytest.approx(1, abs=SIGMAS / math.sqrt(len(late)))


def weibull(gap_um, tau):
    """Survival function of the second distribution, of the time in us."""
    wide = 1 / (1 + math.exp((30 - gap_um) / 4))

    def survival(after):
        return sum(share * math.exp(-(after / tau * math.gamma(1 + 1 / shape))**shape)
                   for share, shape in ((wide, 1.6), (1 - wide, 0.8)))
    return survival


@pytest.mark.parametrize("gap_um", [22, 30, 36, 55])
def test_the_second_law_is_a_mixture_of_two_weibull_laws(plant, gap_um):
    # Of shape 0.8 in a narrow gap and 1.6 in a wide one, half each at 30 um; it keeps the mean.
    alone(plant)
    plant.set("gap.ignition_law", 1)
    plant.hold(gap_um=gap_um)
    tau = tau_us(gap_um)
    count = 3000
    found = [plant.pulse(on_us=round(40 * tau), off_us=20) for _ in range(count)]
    assert None not in found
    shares = [share for share in SHARES if weibull(gap_um, tau)(1) > share]
    assert laue(found, weibull(gap_um, tau), shares) < POINT_SIGMAS
    # A delay is rounded up to the next look, by half a microsecond in the mean where they are slow.
    mean = statistics.fmean(found) - 1.5
    assert mean == pytest.approx(tau, abs=SIGMAS * statistics.stdev(found) / math.sqrt(count) + 0.3)


@pytest.mark.parametrize("gap_um", [22, 55])
def test_the_laue_plot_tells_the_laws_apart(plant, gap_um):
    alone(plant)
    plant.set("gap.ignition_law", 1)
    plant.hold(gap_um=gap_um)
    tau = tau_us(gap_um)
    found = [plant.pulse(on_us=round(40 * tau), off_us=20) for _ in range(3000)]
    assert laue(found, lambda after: math.exp(-after / tau), SHARES) > 2 * POINT_SIGMAS


# ---- classes

def states(plant, count):
    """State of the gap at the end of each main pulse."""
    found = []
    for _ in range(count):
        plant.drive(gap_on=1, gap_level=6)
        plant.run(ON_US * 2)
        found.append(round(plant.get("read.state")))
        plant.drive(gap_on=0)
        plant.run(OFF_US * 2)
    return found


def shares(*, gap_um, debris, decades=0.0, single=0.02, voltage=1.0):
    """Closed form of the shares of pulses, by state.

    A pulse is a short by its own chance; else an arc, by the pause since the last discharge; else
    a spark, if it ignites in time. The pause counts the pulses since a discharge: a Markov chain.
    """
    short = single * debris * math.exp(-gap_um / 25)
    tau = tau_us(gap_um, debris, decades) / voltage**4
    left = math.exp(-(ON_US - 1) / tau)
    memory = 15 * (1 + 0.3 * decades)
    arcs = [(1 - short) * debris * math.exp(-(OFF_US + n * (ON_US + OFF_US)) / memory)
            for n in range(400)]
    quiet = [short + (1 - short - arc) * left for arc in arcs]
    weights = [1.0]                     # of n pulses without a discharge before this one
    for chance in quiet:
        weights.append(weights[-1] * chance)
    weights = weights[:-1]
    total = sum(weights)
    arc = sum(weight * one for weight, one in zip(weights, arcs, strict=True)) / total
    return {SHORTED: short, ARCING: arc, OPEN: (1 - short - arc) * left,
            BURNING: (1 - short - arc) * (1 - left)}


def counted(found, state):
    """Share of a state and its standard deviation, from a hundred runs of pulses.

    A state depends on the pulse before: one pulse alone does not give the spread.
    """
    size = len(found) // 100
    runs = [statistics.fmean(one == state for one in found[at:at + size])
            for at in range(0, size * 100, size)]
    return statistics.fmean(runs), statistics.stdev(runs) / 10


def compare(found, expected):
    for state, share in expected.items():
        measured, sigma = counted(found, state)
        sigma = max(sigma, math.sqrt(share * (1 - share) / len(found)))
        assert abs(measured - share) < SIGMAS * sigma, (state, measured, share)


def test_class_shares_against_the_width(plant):
    # The wider the gap, the more pulses stay open, and the fewer are shorts and arcs.
    plant.set("debris.single_short", 0.2)
    measured = []
    for gap_um in (15, 30, 45, 60, 75, 110):
        plant.hold(gap_um=gap_um, debris=0.5)
        found = states(plant, 4000)
        compare(found, shares(gap_um=gap_um, debris=0.5, single=0.2))
        measured.append({state: counted(found, state) for state in (OPEN, ARCING, SHORTED)})
    for narrow, wide in itertools.pairwise(measured):
        for state, sign in ((OPEN, 1), (ARCING, -1), (SHORTED, -1)):
            step = sign * (wide[state][0] - narrow[state][0])
            assert step >= -SIGMAS * math.hypot(wide[state][1], narrow[state][1])
    first, last = measured[0], measured[-1]
    assert last[OPEN][0] > 0.9
    assert first[OPEN][0] == 0
    assert first[ARCING][0] > 3 * last[ARCING][0]
    assert first[SHORTED][0] > 3 * last[SHORTED][0]


def test_class_shares_against_the_fluid(plant):
    # Low resistance: abnormal discharges are likely, discharges start easily (JP S60-10852 B); on
    # 10 mm2 in spite of the leak, which lowers the open voltage.
    plant.set("gap.area_mm2", 10)
    gap_um, debris = 75, 0.3
    plant.hold(gap_um=gap_um, debris=debris)
    measured = []
    for fluid in FLUIDS:
        plant.set("force.fluid_ohm_cm", fluid)
        leak = fluid * gap_um * 1e-4 / 0.1
        found = states(plant, 4000)
        compare(found, shares(gap_um=gap_um, debris=debris, voltage=leak / (leak + 10),
                              decades=max(0.0, math.log10(1e6 / fluid))))
        measured.append({state: counted(found, state) for state in (OPEN, ARCING)})
    for state, sign in ((OPEN, -1), (ARCING, 1)):
        for high, low in [*itertools.pairwise(measured), (measured[0], measured[-1])]:
            step = sign * (low[state][0] - high[state][0])
            assert step > -SIGMAS * math.hypot(low[state][1], high[state][1])
        assert step > 2 * SIGMAS * math.hypot(low[state][1], high[state][1])
