# SPDX-License-Identifier: Apache-2.0
"""The firmware's roughing planner against the host's: equal bits and an equal staircase."""

import random
from dataclasses import replace
from itertools import chain

import pytest

from host.errors import UserError
from host.roughing.basic import BasicData, read_all
from host.roughing.load import lines
from host.roughing.network import train
from host.roughing.staircase import Job, plan
from softcore.tables.faults import error_line
from testbench.firmware import Controller
from testbench.planner import RUNS, Planner

DATA = read_all("copper", "steel")


@pytest.fixture(scope="module")
def planner():
    return Planner()


def test_the_network_comes_to_the_same_bits(planner):
    """Two to eight random samples, plausible and not, some with equal inputs."""
    draw = random.Random(3)
    trusted = 0
    for turn in range(300):
        count = draw.randrange(2, 9)
        values = [[draw.choice((50, 100)), draw.choice((5, 10)), draw.uniform(3, 4)]
                  if turn % 2 else [draw.uniform(1, 100), 7.5, draw.uniform(0, 9)]
                  for _ in range(count)]
        samples = [(*one, 20 + one[0] / 50 - one[1] + 3 * one[2] + (turn % 5) * draw.gauss(0, 1))
                   for one in values]
        inputs = [draw.uniform(1, 100), draw.uniform(4, 11), draw.uniform(-1, 10)]
        signs = [draw.choice((-1, 0, 1)) for _ in range(3)]
        seed = draw.randrange(2**32)
        network = train(samples, seed)
        believed = network.converged and network.rises(signs, inputs)
        assert planner.learn(samples, seed, inputs, signs) == (network.infer(inputs), believed,
                                                               network.iterations)
        trusted += believed
    assert 50 < trusted < 250


def random_data(draw):
    """Basic data that rise as they must, to the last digits that a file may have."""
    depths = sorted(draw.sample(range(0, 40_000), draw.randrange(2, 9)))
    areas = sorted(draw.sample(range(100, 60_000), draw.randrange(1, 5)))
    step = draw.choice((100, 100, 50, 150))
    data = []
    for area in areas:
        currents = [step * n for n in range(draw.randrange(1, 4), draw.randrange(7, 14))]
        spread, base = draw.uniform(2, 40), draw.randrange(100, 500)
        rows = [tuple((base + round(ip * 0.9) + round((6 + 0.02 * ip * spread / 10)
                                                      * (depth / 1000)**0.85) + column) / 10
                      for column, depth in enumerate(depths)) for ip in currents]
        data.append(BasicData(
            name=f"made_{area}", electrode="copper", workpiece="steel", area_mm2=area / 100,
            source="a test", depth_mm=tuple(depth / 1000 for depth in depths),
            ip=tuple(ip / 100 for ip in currents),
            bottom_um=random_stock(draw, len(currents)), side_um=random_stock(draw, len(currents)),
            undersize_um=tuple(rows), finish_um=((1.0, 0.0),)))
    finish = random_finish(draw)
    return [replace(one, finish_um=finish) for one in data]


def random_stock(draw, count):
    """Stock of currents, in um, which does not fall; often with equal values."""
    return tuple(sorted(draw.choice((0, 12, draw.randrange(700))) / 10 for _ in range(count)))


def random_finish(draw):
    """Finishes, that of 1 um among them."""
    rough = sorted({10, *draw.sample(range(1, 200), draw.randrange(6))})
    at = rough.index(10)
    less = sorted((draw.randrange(120) / 10 for _ in rough[:at]), reverse=True)
    more = sorted((-draw.randrange(120) / 10 for _ in rough[at + 1:]), reverse=True)
    return tuple(zip((value / 10 for value in rough), (*less, 0.0, *more), strict=True))


def random_job(draw, data):
    low, high = data[0].area_mm2, data[-1].area_mm2
    area = draw.choice((low, high, draw.choice(data).area_mm2, *(draw.uniform(low, high),) * 5))
    depths = data[0].depth_mm
    depth = draw.choice((*depths, *(draw.uniform(depths[0], depths[-1]),) * 10))
    inside = [value for one in data for row in one.undersize_um for value in row]
    undersize = draw.choice((*draw.sample(inside, 2),
                             *(draw.uniform(min(inside), max(inside)),) * 4))
    return Job(round(area, 2), round(undersize, 1), round(depth, 3),
               draw.choice((0, 0, round(draw.uniform(0, 20), 2))), draw.choice((1, 1, 2, 3)),
               draw.choice((1.0, *(one for one, _ in data[0].finish_um),
                            round(draw.uniform(*(data[0].finish_um[at][0] for at in (0, -1))), 1))))


def compare(planner, data, job, seed):
    """Run both planners; return the firmware's result."""
    there = planner.plan(job, seed)
    try:
        here = plan(data, job, seed)
    except UserError:
        assert isinstance(there, str)
        return "refused"
    if len(here.steps) > RUNS:
        assert there == "the staircase has more steps than a series takes"
        return "too long"
    assert not isinstance(there, str), there
    assert (there.undersize_um, there.ip, there.beta_um) == (here.undersize_um, here.ip,
                                                             here.beta_um)
    assert (there.bottom_um, there.side_um) == (here.bottom_um, here.side_um)
    assert there.steps(job.steps) == here.steps
    assert there.untrusted == sum("interpolated" in note for note in here.notes)
    assert there.beyond == sum("inferred beyond" in note for note in here.notes)
    assert there.greatest == any("allows the greatest" in note for note in here.notes)
    assert there.ended == any("are not in the basic data" in note for note in here.notes)
    assert there.single == any("one depth only" in note for note in here.notes)
    return "interpolated" if there.untrusted else "planned"


def test_the_shipped_data_give_the_same_staircase(planner):
    data = DATA[1:]     # the memory holds four of these five areas
    assert planner.enter(data) == ""
    draw, outcomes = random.Random(5), []
    for job in (Job(70, 110, 15), Job(70, 110, 15, 10), Job(70, 150, 15)):
        assert compare(planner, data, job, 1) == "planned"
    for _ in range(40):
        outcomes.append(compare(planner, data, random_job(draw, data), draw.randrange(2**32)))
    assert outcomes.count("planned") > 20


def test_random_data_give_the_same_staircase(planner):
    draw, outcomes = random.Random(6), []
    for _ in range(120):
        data = random_data(draw)
        if any(len(one.ip) < 2 for one in data) or planner.enter(data):
            continue
        outcomes.append(compare(planner, data, random_job(draw, data), draw.randrange(2**32)))
    assert min(outcomes.count(one) for one in ("planned", "interpolated", "refused")) > 3
    assert len(outcomes) > 80


def test_the_smallest_data_do(planner):
    smallest = replace(DATA[1], ip=(4.0, 8.0), depth_mm=(15.0,), undersize_um=((80.0,), (120.0,)),
                       bottom_um=(20.0, 30.0), side_um=(9.9, 9.9))
    assert planner.enter([smallest]) == ""
    for undersize in (79.9, 80, 100, 110.5, 120, 130):
        compare(planner, [smallest], Job(50, undersize, 15), 1)


def test_a_staircase_without_end_is_refused(planner):
    flat = [replace(one, undersize_um=tuple(tuple(round(40 + ip + 0.1 * column + column * ip, 1)
                                                  for column in range(len(one.depth_mm)))
                                            for ip in one.ip)) for one in DATA[:2]]
    assert planner.enter(flat) == ""
    assert compare(planner, flat, Job(30, 60, 40, steps=20), 1) == "too long"


def test_nothing_is_planned_without_data(planner):
    planner.depths([0, 1000])
    assert planner.plan(Job(50, 100, 1), 1) == "basic data: none have been entered"
    planner.area(5000)
    planner.current(100, [400, 410])
    assert planner.plan(Job(50, 100, 1), 1) == (
        "basic data: the area of 50 mm2 has 1 of at least 2 currents")


def test_data_that_do_not_rise_are_refused(planner):
    assert planner.depths([0, 1000, 1000]) == (
        "basic data: the depths must rise, to 1000 mm at most (number 3)")
    assert planner.depths([]) == planner.depths(list(range(13))) == (
        "basic data: 1 to 12 depths are needed")
    assert planner.depths([0, 1000]) == ""
    assert planner.current(100, [400, 410]) == "basic data: an area comes before its currents"
    assert planner.area(0) == "basic data: the areas must rise, to 100000 mm2 at most"
    assert planner.area(5000) == ""
    assert planner.area(6000) == "basic data: the area of 50 mm2 has 0 of at least 2 currents"
    order = "basic data: the currents must rise, to IP 63 at most"
    assert planner.current(0, [400, 410]) == order
    assert planner.current(100, [400]) == (
        "basic data: 1 undersizes for 2 depths; bottom and side stock may follow")
    rise = "basic data: the undersize must rise with depth and current, to 6000 um at most (number "
    assert planner.current(100, [400, 400]) == rise + "2)"
    assert planner.current(100, [400, 60_001]) == rise + "2)"
    assert planner.current(100, [400, 410]) == ""
    assert planner.current(100, [500, 510]) == order
    assert planner.current(200, [400, 510]) == rise + "1)"
    assert planner.current(200, [401, 411]) == ""
    assert planner.area(5000) == "basic data: the areas must rise, to 100000 mm2 at most"
    assert planner.current(300, [500, 510, 100, 60_001]) == (
        "basic data: the stock is at most 6000 um")
    assert planner.current(300, [500, 510, 100, 90]) == ""
    fall = "basic data: the stock must not fall with the current"
    assert planner.current(400, [600, 610, 99, 90]) == fall
    assert planner.current(400, [600, 610, 100, 89]) == fall
    assert planner.current(400, [600, 610]) == fall
    assert planner.current(400, [600, 610, 100, 90]) == ""


def test_finishes_that_make_no_sense_are_refused(planner):
    planner.forget()
    planner.select("FIRST")
    assert planner.finish([10, 0]) == "basic data: the depths come first"
    assert planner.depths([0, 1000]) == ""
    count = ("basic data: at most 6 finishes, each a roughness and a difference of the stock")
    assert planner.finish([10]) == planner.finish([10, 0] * 7) == count
    least = "basic data: a roughness of 1 um with a difference of 0 is needed"
    assert planner.finish([]) == planner.finish([10, -1]) == planner.finish([0, 0]) == least
    rise = ("basic data: the roughness must rise, to 100 um at most, and the stock not rise with "
            "it (number ")
    assert planner.finish([10, 30_001]) == planner.finish([10, -30_001]) == rise + "1)"
    assert planner.finish([10, 0, 10, 0]) == planner.finish([10, 0, 20, 1]) == rise + "3)"
    assert planner.finish([10, 0, 1001, 0]) == rise + "3)"
    assert planner.finish([0, 30_000, 10, 0, 1000, -30_000]) == ""
    planner.select("SECOND")
    assert planner.depths([0, 1000]) == ""
    planner.select("FIRST")
    assert planner.finish([10, 0]) == (
        "basic data: another pair follows; begin this one with $BD")
    planner.forget()
    planner.select("")


def test_a_full_memory_is_told(planner):
    planner.forget()
    for pair, sizes in enumerate(((16, 16, 16, 16, 16), (16, 16, 16, 16, 15), (1,))):
        planner.select(f"PAIR{pair}")
        assert planner.depths([0, 1000]) == ""
        for area, count in enumerate(sizes):
            assert planner.area(100 + area) == ""
            for ip in range(count):
                assert planner.current(100 + ip, [400 + 2 * ip, 401 + 2 * ip]) == ""
    full = "basic data: no more than 16 currents of an area and 160 of all can be entered"
    assert planner.current(200, [900, 901]) == full
    planner.select("PAIR3")
    assert planner.depths([0]) == ""
    planner.select("PAIR4")
    assert planner.depths([0]) == "basic data: no more than 4 pairs of materials can be entered"
    planner.select("PAIR0")
    assert planner.area(200) == "basic data: another pair follows; begin this one with $BD"
    assert planner.depths([0]) == "", "its own data make room for it"
    for area in range(10):
        assert planner.area(100 + area) == ""
        for ip in range(2):
            assert planner.current(100 + ip, [400 + ip]) == ""
    assert planner.area(200) == "basic data: no more than 16 areas can be entered"
    planner.forget()


# The lines that a host sends.

def entered(machine, data):
    """Send basic data; every line is answered at once."""
    for line in lines(data):
        assert machine.line(line, 100) == ["ok"]


@pytest.fixture(scope="module")
def machine():
    ready = Controller()
    entered(ready, DATA[1:3])
    return ready


def test_a_line_plans_and_is_answered_from_the_surface_down(machine):
    assert machine.line("$BP70,110,15", 60_000) == [
        "[MSG:The last step needs an undersize of 107.8 um, of 110.0 um allowed]",
        "[MSG:IP 8 to 2.2030 mm]", "[MSG:IP 7 to 7.4990 mm]", "[MSG:IP 6 to 15.0000 mm]",
        "[MSG:The last step leaves 30.0 um on the bottom and 25.0 um on the side]", "ok"]


def test_gradient_and_seed_may_follow(machine):
    found = plan(DATA, Job(70, 110, 15, 12.5), 77)
    assert machine.line("$BP70,110,15,12.5,77", 60_000)[1:-2] == [
        f"[MSG:IP {step.ip:g} to {step.depth_um / 1000:.4f} mm]" for step in found.steps]


def test_the_stock_on_the_side_is_that_of_the_roughness(machine):
    for roughness, side in (("1", "25.0"), ("2", "23.5"), ("4", "21.8"), ("10", "18.0")):
        found = plan(DATA, Job(70, 110, 15, rmax_um=float(roughness)), 1)
        assert f"{found.side_um + 1e-9:.1f}" == side
        assert machine.line(f"$BP70,110,15,0,1,{roughness}", 60_000)[-2] == (
            f"[MSG:The last step leaves 30.0 um on the bottom and {side} um on the side]")


def test_a_seed_may_be_as_large_as_the_host_s(machine):
    for seed in (1_234_567_890, 2**32 - 1):
        found = plan(DATA, Job(70, 110, 15), seed)
        needs = round(float(found.beta_um), 1)
        assert machine.line(f"$BP70,110,15,0,{seed:013}", 60_000) == [
            f"[MSG:The last step needs an undersize of {needs} um, of 110.0 um allowed]",
            *(f"[MSG:IP {step.ip:g} to {step.depth_um / 1000:.4f} mm]" for step in found.steps),
            "[MSG:The last step leaves 30.0 um on the bottom and 25.0 um on the side]", "ok"]


def test_what_is_to_be_known_is_said(machine):
    assert machine.line("$BP70,400,15", 60_000)[3:] == [
        "[MSG:The undersize allows the greatest current of the basic data, or more]",
        "[MSG:The basic data have no greater current]", "ok"]


def test_lines_wait_for_the_planning_and_the_status_does_not(machine):
    machine.unlock()
    machine.send(b"$BP70,110,15\n$I\n")
    assert machine.run(50) == []
    machine.send(b"?")
    said = machine.run(60_000)
    assert said[0].startswith("<Run|"), "a host that waits for the answer asks"
    assert said[-3].startswith("[OPT:")
    assert said[-2].startswith("[FIRMWARE:")
    assert said.count("ok") == 2


def test_the_data_are_listed_as_they_were_entered(machine):
    assert machine.line("$BL", 2000) == [*(f"[MSG:{line}]" for line in lines(DATA[1:3])), "ok"]
    fine = ["$BD0.001,999.999,1000", "$BR0.1,3000,1,0,1.1,-0.1,9.9,-12,10,-12,100,-3000",
            "$BA0.05", "$BI0.25,0.1,5999.8,5999.9", "$BI63,0.2,5999.9,6000,0,6000"]
    for line in fine:
        assert machine.line(line, 100) == ["ok"]
    assert machine.line("$BL", 500) == [*(f"[MSG:{line}]" for line in fine), "ok"]
    longest = ["$BD" + ",".join(f"{900 + n}.123" for n in range(12)), "$BA99999.99",
               "$BI62.75," + ",".join(f"{5980 + n}.1" for n in range(12)) + ",5999.9,5999.9"]
    for line in longest:
        assert machine.line(line, 100) == ["ok"]
    assert machine.line("$BL", 500) == [*(f"[MSG:{line}]" for line in longest), "ok"]
    assert machine.line("$BF", 100) == machine.line("$BL", 100) == ["ok"]
    entered(machine, DATA[1:3])


def test_an_area_is_taken_out_and_the_others_stay(machine):
    assert machine.line("$BF", 100) == ["ok"]
    entered(machine, DATA)      # all of the shipped ones
    for out, left in (("100", [0, 1, 3, 4]), ("20", [1, 3, 4]), ("400", [1, 3])):
        assert machine.line(f"$BF{out}", 100) == ["ok"]
        assert machine.line("$BL", 3000) == [
            *(f"[MSG:{line}]" for line in lines([DATA[at] for at in left])), "ok"]
    assert machine.line("$BP70,110,15", 60_000)[-1] == "ok"
    assert machine.line("$BF", 100) == ["ok"]
    entered(machine, DATA[1:3])


def other(data):
    """Data of another pair: each current needs 10 um less."""
    return [replace(one, undersize_um=tuple(tuple(round(value - 10, 1) for value in row)
                                            for row in one.undersize_um)) for one in data]


def test_several_pairs_are_held_and_each_plans_with_its_own_data(machine):
    usual = machine.line("$BP70,110,15", 60_000)
    assert machine.line("$BF", 100) == ["ok"]
    pairs = {"COPPER_STEEL": DATA[1:3], "GRAPHITE_STEEL": other(DATA[1:4]),
             "A-1": DATA[:2]}
    assert machine.line("$BP70,110,15") == ["[MSG:basic data: none have been entered.]",
                                            error_line("table")]
    for name, data in pairs.items():
        assert machine.line(f"$BM{name.lower()}", 100) == ["ok"]
        entered(machine, data)
    held = {name: [f"[MSG:{line}]" for line in (f"$BM{name}", *lines(data))]
            for name, data in pairs.items()}
    assert machine.line("$BL", 5000) == [*chain(*held.values()), "ok"]
    said = {}
    for name in ("GRAPHITE_STEEL", "COPPER_STEEL"):
        assert machine.line(f"$BM{name}", 100) == ["ok"]
        assert machine.line("$BM", 100) == [f"[MSG:$BM{name}]", "ok"]
        said[name] = machine.line("$BP70,110,15", 60_000)
    assert said["COPPER_STEEL"] == usual
    assert said["GRAPHITE_STEEL"] != usual
    # An area of the pair in the middle; then the first pair, while the middle one is in force.
    assert machine.line("$BMGRAPHITE_STEEL", 100) == machine.line("$BF200", 100) == ["ok"]
    held["GRAPHITE_STEEL"] = [f"[MSG:{line}]" for line in (
        "$BMGRAPHITE_STEEL", *lines(pairs["GRAPHITE_STEEL"][:2]))]
    assert machine.line("$BFcopper_steel", 100) == ["ok"]
    assert machine.line("$BL", 5000) == [*held["GRAPHITE_STEEL"], *held["A-1"], "ok"]
    assert machine.line("$BM", 100) == ["[MSG:$BMGRAPHITE_STEEL]", "ok"]
    assert machine.line("$BP70,110,15", 60_000) == said["GRAPHITE_STEEL"]
    # One that is not held has no data, and those of the others do not stand in for it.
    assert machine.line("$BMCOPPER_STEEL", 100) == ["ok"]
    assert machine.line("$BP70,110,15") == [
        "[MSG:basic data: none of COPPER_STEEL have been entered.]", error_line("table")]
    assert machine.line("$BF", 100) == machine.line("$BL", 100) == ["ok"]
    entered(machine, DATA[1:3])


def test_a_reset_ends_a_planning_and_keeps_the_data(machine):
    machine.send(b"$BP70,110,15\n")
    assert machine.run(50) == []
    machine.send(b"\x18")
    assert [line for line in machine.run(60_000) if "IP" in line] == []
    assert machine.line("$BP70,110,15", 60_000)[-1] == "ok"


NAME = "a pair has a name of at most 23 letters, digits, _ and -."
COMMANDS = (
    "basic data are entered with $BM, $BD, $BR, $BA and $BI; $BL lists them, $BF forgets them.")
DIGITS = "a number with at most 3 digits behind the point is needed."


@pytest.mark.parametrize(("line", "why"), [
    ("$B", COMMANDS),
    ("$BX1", COMMANDS),
    ("$BD1,,2", f"MDI, character 6: {DIGITS}"),
    ("$BD0,1.2345", f"MDI, character 11: {DIGITS}"),
    ("$BA1,2", "$BA takes one area."),
    ("$BI1,2,3,4", "basic data: 3 undersizes for 12 depths; bottom and side stock may follow."),
    ("$BD" + "1," * 20 + "1", "MDI, character 34: more than 15 numbers."),
    ("$BR1,0,2", "basic data: at most 6 finishes, each a roughness and a difference of the stock."),
    ("$BR-1,0", "MDI, character 4: a number with at most 1 digits behind the point is needed."),
    ("$BI-1,0", "MDI, character 4: a number with at most 2 digits behind the point is needed."),
    ("$BR1,--1", "MDI, character 7: a number with at most 1 digits behind the point is needed."),
    ("$BL1", "$BL takes no number."),
    ("$BF50,100", "$BF takes one area or one pair, or none for all."),
    ("$BFGOLD", "basic data: that pair is not among them."),
    ("$BMa b", f"MDI, character 5: {NAME}"),
    ("$BM" + 24 * "A", f"MDI, character 27: {NAME}"),
    ("$BF51", "basic data: that area is not among them."),
    ("$BP70,110", "$BP needs area, undersize and depth; gradient, seed and roughness may follow."),
    ("$BP70,110,15,61", "the gradient is at most 60 degrees."),
    ("$BP70,110,0", "area, undersize and depth must be above 0."),
    ("$BP0,110,15", "area, undersize and depth must be above 0."),
    ("$BP42949673,110,15", "MDI, character 11: the number is too large."),
    ("$BP21474836.48,110,15", "MDI, character 14: the number is too large."),
    ("$BP21474836.47,110,15", "the area is outside of the basic data."),
    ("$BP12345678901234567890,110,15", "MDI, character 14: the number is too large."),
    ("$BP70,300000000,15", "MDI, character 15: the number is too large."),
    ("$BP70,110,9999999999", "MDI, character 20: the number is too large."),
    ("$BP70,110,15,0,4294967296", "MDI, character 25: the number is too large."),
    ("$BP70,110,15,0,1.5", "MDI, character 17: a whole number is needed."),
    ("$BP70,110,15,0,", "MDI, character 16: a whole number is needed."),
    ("$BP70,110,15,0,1,10.1", "the roughness is outside of the basic data."),
    ("$BP70,110,15,0,1,0.9", "the roughness is outside of the basic data."),
    ("$BP70,110,15,0,1,1,1",
     "$BP needs area, undersize and depth; gradient, seed and roughness may follow."),
    ("$BP7,110,15", "the area is outside of the basic data."),
    ("$BP70,110,41", "the depth is outside of the basic data."),
    ("$BP70,40,15",
     "the undersize is too small: the least current of the basic data needs more."),
])
def test_bad_lines_get_one_sentence(machine, line, why):
    told = machine.line(line, 4000)
    assert told[0] == f"[MSG:{why}]"
    assert told[1] in (error_line("setting"), error_line("table"))
    assert len(told) == 2


def test_power_on_forgets(machine):
    assert Controller().line("$BP70,110,15") == ["[MSG:basic data: none have been entered.]",
                                              error_line("table")]
    entered(machine, DATA[1:3])
