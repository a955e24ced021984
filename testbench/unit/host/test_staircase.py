# SPDX-License-Identifier: Apache-2.0
"""The roughing planner: reference cases, neighbours, borders of the data."""

import math
import random
import re
from dataclasses import replace
from itertools import pairwise

import pytest

from host.errors import UserError
from host.roughing.basic import BasicData, read_all
from host.roughing.network import train
from host.roughing.staircase import (
    Job,
    Step,
    cosine,
    current_cell,
    depth_cell,
    plan,
    undersize_cell,
)
from host.roughing.synthetic import undersize_um

DATA = read_all("copper", "steel")
# The answer against the interpolation between the same samples.
CURRENT_STEP = CURRENT_SHARE = 0.1
DEPTH_SHARE, UM = 0.05, 0.001


def basic(area_mm2=50.0, currents=(4, 6, 8), depths=(0, 1, 10, 20), undersize=None):
    """Basic data of a formula."""
    undersize = undersize or undersize_um
    return BasicData(
        name=f"made_{area_mm2:g}", electrode="copper", workpiece="steel", area_mm2=area_mm2,
        source="a test", depth_mm=tuple(map(float, depths)), ip=tuple(map(float, currents)),
        bottom_um=tuple(10.0 + ip for ip in currents), side_um=tuple(20.0 + ip for ip in currents),
        undersize_um=tuple(tuple(undersize(area_mm2, ip, depth) for depth in depths)
                           for ip in currents),
        finish_um=((1.0, 0.0), (5.0, -4.0)))


def pair(job, data=DATA):
    """Files next to a job's area."""
    areas = [one.area_mm2 for one in data]
    at = min(max(sum(area <= job.area_mm2 for area in areas) - 1, 0), len(areas) - 2)
    return data[at:at + 2]


# Domain reference: exact inverse of the formula. X, taper; current before rounding, beta, steps.
REFERENCE = [
    (110, 0, 6.177, 107.89, [(8, 2.23), (7, 7.50), (6, 15)]),
    (110, 10, 6.037, 107.89, [(8, 2.23), (7, 7.50), (6, 15)]),
    (150, 0, None, 143.69, [(12, 1.45), (11, 4.82), (10, 9.28), (9, 15)]),
]


@pytest.mark.parametrize(("undersize", "taper", "ip", "beta", "steps"), REFERENCE)
def test_the_reference_cases_come_out(undersize, taper, ip, beta, steps):
    found = plan(DATA, Job(70, undersize, 15, taper))
    assert [step.ip for step in found.steps] == [ip for ip, _ in steps]
    for step, (_, depth_mm) in zip(found.steps, steps, strict=True):
        assert step.depth_um / 1000 == pytest.approx(depth_mm, rel=0.05)
    assert found.steps[-1].depth_um == 15_000
    assert found.beta_um == pytest.approx(beta, abs=0.3)
    if ip:
        assert found.ip == pytest.approx(ip, abs=0.05)
    assert not found.notes


def test_a_gradient_counts_by_its_cosine():
    assert plan(DATA, Job(70, 110, 15, 10)).undersize_um == pytest.approx(108.33, abs=0.005)
    for degrees in range(0, 61, 3):
        assert cosine(degrees) == pytest.approx(math.cos(math.radians(degrees)), abs=2e-7)


def jobs(seed, count):
    draw = random.Random(seed)
    while count:
        job = Job(round(draw.uniform(20, 400), 2), round(draw.uniform(50, 200), 1),
                  round(draw.uniform(0.2, 40), 3), steps=draw.choice((1, 2, 3, 5, 10)))
        if undersize_um(job.area_mm2, 1, job.depth_mm) + 1 < job.undersize_um:
            count -= 1
            yield job, draw.randrange(2**32)


def interpolated(found, near):
    """Current, undersize and depths of a staircase by the interpolation alone."""
    job, x = found.job, found.undersize_um
    current = min(current_cell(near, job.area_mm2, job.depth_mm, x).between, 15)
    needed = min(undersize_cell(near, job.area_mm2, job.depth_mm, found.alpha).between, x)
    return current, needed, [depth_cell(near, job.area_mm2, step.ip, needed).between
                             for step in found.steps[:-1]]


def test_the_answer_stays_by_the_interpolation():
    """Complete plans over random jobs and seeds; every staircase is monotone, with proof."""
    compared = stood_in = 0
    for job, seed in jobs(1, 60):
        found = plan(DATA, job, seed)
        current, needed, depths = interpolated(found, pair(job))
        assert abs(found.ip - current) * job.steps <= CURRENT_SHARE * (1 + 1e-6)
        assert found.beta_um == pytest.approx(needed, abs=0.3)
        for step, depth in zip(found.steps, depths, strict=False):
            assert -UM - DEPTH_SHARE * depth <= step.depth_um / 1000 - depth <= DEPTH_SHARE * depth
            compared += 1
        assert all(one.ip > two.ip and one.depth_um < two.depth_um
                   for one, two in pairwise(found.steps))
        assert found.steps[-1].depth_um == round(job.depth_mm * 1000)
        assert not any("proved" in note or "learn" in note for note in found.notes)
        stood_in += sum("interpolated" in note for note in found.notes)
    assert compared > 100
    assert 0 < stood_in < compared // 20


def test_a_depth_by_a_beta_that_departs_is_interpolated_and_told():
    """The network gave 22 um where the interpolation gives 9."""
    job = Job(338.98, 156.2, 11.244, steps=10)
    seed = next(seed for one, seed in jobs(4, 300) if one == job)
    found = plan(DATA, job, seed)
    current, needed, depths = interpolated(found, pair(job))
    assert found.beta_um - needed > 0.08
    assert found.ip != current
    told = [re.match(r"depth at IP (\S+): interpolated, since its network departs from that$", note)
            for note in found.notes]
    shares = {f"{step.ip:g}": depth for step, depth in zip(found.steps, depths, strict=False)}
    assert [one[1] for one in told if one] == ["13.8", "13.9", "14"]
    for step in found.steps[:3]:
        assert step.depth_um == int(shares[f"{step.ip:g}"] * 1000 + 2**-10)


def test_a_current_of_fine_steps_that_departs_is_interpolated_and_told():
    departed = 0
    for job, seed in jobs(4, 150):
        if job.steps != 10:
            continue
        found = plan(DATA, job, seed)
        current, _, _ = interpolated(found, pair(job))
        told = "current: interpolated, since its network departs from that" in found.notes
        assert told == (found.ip == current != 15)
        departed += told
    assert departed > 2


def test_no_step_needs_more_than_the_last():
    """The third patent's aim: no step makes the cavity wider than the last step does."""
    for job, seed in jobs(2, 30):
        found, near = plan(DATA, job, seed), pair(job)
        for step in found.steps:
            needed = undersize_cell(near, job.area_mm2, step.depth_um / 1000, step.ip).between
            assert needed <= found.beta_um + 0.3
        assert found.beta_um <= found.undersize_um


def test_a_staircase_can_be_repeated_and_a_seed_changes_little():
    job = Job(70, 110, 15)
    assert plan(DATA, job, 5) == plan(DATA, job, 5)
    one, two = (plan(DATA, job, seed) for seed in (5, 6))
    assert one.ip != two.ip
    assert [step.ip for step in one.steps] == [step.ip for step in two.steps]


def test_a_current_that_would_reach_no_less_deep_is_left_out():
    """With fine steps, of which two have networks that learn from other rows of the data."""
    data = [basic(area, (2, 6, 10, 14)) for area in (50.0, 100.0)]
    found = plan(data, Job(70, 110, 15, steps=20))
    levels = [round(step.ip * 20) for step in reversed(found.steps)]
    assert set(range(levels[0], levels[-1])) - set(levels)
    assert all(one.ip > two.ip and one.depth_um < two.depth_um
               for one, two in pairwise(found.steps))


def test_neighbours_are_eight_samples_on_either_side():
    cell = current_cell(DATA[1:3], 70, 14, 110)
    assert len(set(cell.samples)) == 8
    assert {row[0] for row in cell.samples} == {50, 100}
    assert {row[1] for row in cell.samples} == {10, 15}
    for area in (50, 100):
        for depth in (10, 15):
            column = sorted(row[2] for row in cell.samples if row[:2] == (area, depth))
            assert column[0] <= 110 < column[1]


def test_currents_are_chosen_depth_by_depth():
    """If the cavity widens much with the depth, the two depths have no common current."""
    steep = [basic(area, range(1, 16), (0, 5, 30), lambda area, ip, depth:
                   20 + 5 * ip + (0.2 + 0.3 * ip) * depth) for area in (50.0, 100.0)]
    cell = current_cell(steep, 70, 10, 90)
    shallow, deep = ({row[3] for row in cell.samples if row[1] == depth} for depth in (5, 30))
    assert min(shallow) > max(deep)
    found = plan(steep, Job(70, 90, 10))
    assert abs(found.ip - cell.between) <= CURRENT_STEP


def test_a_value_that_the_data_hold_is_given_back():
    """Area, depth and undersize of a row give its current, not a step less by rounding."""
    for one in DATA[1:4]:
        for row in (3, 7, 11):
            job = Job(one.area_mm2, one.undersize_um[row][8], one.depth_mm[8])
            found = plan(DATA, job)
            assert found.ip == pytest.approx(one.ip[row], abs=1e-4)
            assert found.alpha == one.ip[row]
            assert found.beta_um == pytest.approx(one.undersize_um[row][8], abs=1e-3)


@pytest.mark.parametrize("area", [20, 400])
@pytest.mark.parametrize("depth", [0.5, 40])
def test_borders_of_the_data_belong_to_them(area, depth):
    found = plan(DATA, Job(area, 110, depth))
    assert found.steps[-1].depth_um == depth * 1000
    assert found.alpha >= 1


@pytest.mark.parametrize(("job", "why"), [
    (Job(19.9, 110, 15), "the area of 19.9 mm2 is outside of the basic data (20 to 400 mm2)."),
    (Job(401, 110, 15), "the area of 401 mm2 is outside of the basic data (20 to 400 mm2)."),
    (Job(70, 110, 41), "the depth of 41 mm is outside of the basic data (0 to 40 mm)."),
    (Job(70, 110, 15.0005), "the depth of 15.0005 mm has more than 3 digits behind the point."),
    (Job(70, 47, 15), "an undersize of 47 um is too small: the least current, IP 1, needs 48.2 um "
                      "at 15 mm."),
    (Job(70, 48.0001, 15), "an undersize of 48.0001 um is too small: the least current, IP 1, "
                           "needs 48.2 um at 15 mm."),
    (Job(70, 49, 15, 12.3456789), "an undersize of 49 um, which a gradient of 12.3456789 degrees "
                                  "makes 47.867 um, is too small: the least current, IP 1, needs "
                                  "48.2 um at 15 mm."),
    (Job(400.0001, 110, 15),
     "the area of 400.0001 mm2 is outside of the basic data (20 to 400 mm2)."),
    (Job(70, 110, 40.00001), "the depth of 40.00001 mm is outside of the basic data (0 to 40 mm)."),
    (Job(70, 110, 15, rmax_um=10.000001),
     "a finish of 10.000001 um Rmax is outside of the basic data (1 to 10 um)."),
    (Job(70, 110, 15, rmax_um=20),
     "a finish of 20 um Rmax is outside of the basic data (1 to 10 um)."),
])
def test_jobs_outside_of_the_data_are_refused(job, why):
    with pytest.raises(UserError, match="^" + re.escape(why) + "$"):
        plan(DATA, job)


def test_the_last_step_ends_at_the_programmed_depth():
    """The depth is exact to 1 um, whatever rounding single or double precision cause in mm."""
    draw = random.Random(9)
    for depth_um in (1, 500, 2203, 4_035, 39_999, *(draw.randrange(1, 40_000) for _ in range(12))):
        found = plan(DATA, Job(70, 160, depth_um / 1000))
        assert found.steps[-1] == Step(found.alpha, depth_um)


def test_an_undersize_for_more_than_the_greatest_current_is_told():
    found = plan(DATA, Job(70, 400, 15))
    assert found.alpha == 15
    assert [step.depth_um for step in found.steps] == [15_000]
    assert found.notes == (
        "the undersize allows the greatest current of the basic data, IP 15, at 15 mm; whether it "
        "allows more is not known", "currents above IP 15 are not in the basic data")


def test_a_depth_above_the_shallowest_of_the_data_is_told():
    deep = [basic(area, range(1, 16), (2, 5, 10, 20)) for area in (50.0, 100.0)]
    found = plan(deep, Job(70, 150, 15))
    shallow = [step for step in found.steps if step.depth_um < 2000]
    assert shallow
    assert found.notes == tuple(f"the depth of IP {step.ip:g} is inferred beyond the basic data, "
                                "which begin at 2 mm" for step in reversed(shallow))


def test_one_file_serves_its_own_area():
    found = plan([basic(currents=range(4, 15))], Job(50, 110, 15))
    assert len(found.steps) > 1
    with pytest.raises(UserError, match=r"is outside of the basic data \(50 mm2 only\)\.$"):
        plan([basic()], Job(51, 110, 15))


def test_two_sets_of_data_are_enough():
    """One file, one depth, two currents: the current of that depth, and no staircase."""
    smallest = basic(currents=(4, 8), depths=(15,))
    found = plan([smallest], Job(50, 110, 15))
    exact = (110 - 30 - 0.6 * 15**0.85) / (9 + 0.28 * 15**0.85)
    assert found.ip == pytest.approx(exact, abs=0.1)
    assert [(step.ip, step.depth_um) for step in found.steps] == [(6, 15_000)]
    assert found.notes == ("the basic data have one depth only, from which no other can be "
                           "inferred",)


def test_files_without_a_common_current_are_refused():
    data = [basic(50.0, (1, 2)), basic(100.0, (4, 6))]
    with pytest.raises(UserError, match=r"^made_50 and made_100 have no current in common\.$"):
        plan(data, Job(70, 200, 15))


def test_files_with_different_currents_are_used_where_both_have_data():
    data = [basic(50.0, (2, 4, 6, 8, 10)), basic(100.0, (3, 5, 7, 9, 11, 13))]
    found = plan(data, Job(70, 110, 15))
    assert found.ip == pytest.approx(6.19, abs=0.1)
    assert found.alpha == 6
    assert plan(data, Job(70, 400, 15)).alpha == 10


def test_a_supply_without_a_fitting_step_is_told():
    data = [basic(area, (4.5, 4.9)) for area in (50.0, 100.0)]
    with pytest.raises(UserError, match=r"no step between the least current of the basic data, "
                                        r"IP 4\.5, and what the undersize allows, IP 4\.9"):
        plan(data, Job(70, 110, 15))
    assert plan(data, Job(70, 110, 15, steps=2)).alpha == 4.5


def test_data_that_no_network_is_trusted_with_are_interpolated():
    """Rising, but with a bend that a monotone network of this size does not learn."""
    def bent(area, ip, depth):
        return 30 + ip + 0.01 * depth + (400 if ip > 6 and depth > 5 and area > 60 else 0)

    data = [basic(area, range(4, 9), (0, 1, 10, 20), bent) for area in (50.0, 100.0)]
    job = Job(70, 150, 15)
    found = plan(data, job)
    words = ": interpolated, since its network was not proved monotone"
    assert any(note.endswith(words) for note in found.notes)
    assert all(one.depth_um < two.depth_um for one, two in pairwise(found.steps))


def test_a_network_that_did_not_learn_is_not_trusted_though_it_is_monotone():
    def bent(area, ip, depth):
        return 30 + ip + 0.01 * depth + (231 if ip > 7 and depth > 0.5 else 0)

    data = [basic(area, range(4, 9), (0, 1, 10, 20), bent) for area in (50.0, 100.0)]
    job = Job(75.1, 197.1, 15.64)
    found = plan(data, job)
    cell = depth_cell(data, job.area_mm2, 8, found.beta_um)
    network = train(cell.samples, 1)
    assert network.rises(cell.signs, cell.inputs)
    assert not network.converged
    assert found.notes[-1] == ("depth at IP 8: interpolated, since its network did not learn all "
                               "samples")


def test_the_least_current_is_used_where_its_undersize_is_just_enough():
    """The network has a little less than the least current there."""
    job = Job(76.64, 53, 24.437)
    assert train(current_cell(DATA[1:3], 76.64, 24.437, 53).samples, 1).infer(
        (76.64, 24.437, 53)) < 0.995
    found = plan(DATA, job)
    assert (found.ip, found.alpha) == (1, 1)


def test_depths_are_rounded_down():
    """Depths are rounded down to 1 um, with a tolerance of a thousandth."""
    rests = []
    for job, seed in jobs(3, 10):
        found = plan(DATA, job, seed)
        for step in found.steps[:-1]:
            if not any(note.startswith(f"depth at IP {step.ip:g}: inter") for note in found.notes):
                cell = depth_cell(pair(job), job.area_mm2, step.ip, found.beta_um)
                gamma = train(cell.samples, seed).infer(cell.inputs)
                rests.append(gamma * 1000 + 2**-10 - step.depth_um)
    assert len(rests) > 50
    assert min(rests) >= 0
    assert 0.9 < max(rests) < 1


def test_a_coarser_finish_leaves_less_on_the_side():
    fine, coarse = (plan(DATA, Job(70, 110, 15, rmax_um=rmax)) for rmax in (1, 5))
    assert (fine.side_um, fine.bottom_um) == (25, 30)
    assert (coarse.side_um, coarse.bottom_um) == (21, 30)
    assert plan(DATA, Job(70, 110, 15, rmax_um=4)).side_um == pytest.approx(25 - 3.25)
    assert replace(coarse, job=fine.job, side_um=25) == fine
