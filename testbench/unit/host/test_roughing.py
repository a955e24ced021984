# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper plan``: its program, read by the firmware's own reader, and its output."""

import inspect
import math
import re
from dataclasses import replace

import pytest
from matplotlib.image import imread

from host.errors import TapeError, UsageError, UserError
from host.machines import machine as machines
from host.places import ROOT
from host.roughing.basic import read_all
from host.roughing.roughing import (
    BUILT_IN,
    JUMP,
    LIMITS,
    condition,
    conditions,
    parts_of_step,
    plot,
    program,
    sunk,
)
from host.roughing.staircase import Job, Staircase, Step, plan
from host.tape.check import check
from host.tape.codes import EIA, ISO
from host.tape.tape import encode
from rtl.controller import Controller
from softcore.build import BOARDS
from softcore.tables.conditions import CURRENT_MAX_A, IP_MA, level_max
from softcore.tables.settings import assign, named
from testbench import command
from testbench.firmware import ITEMS, Checker

DATA = read_all("copper", "steel")
LIMIT = ITEMS.index("L")
PULSES_PER_UM = 10
MEASURED = re.compile(r"\.number = (\d+), \.milli_ip = (\d+)000, \.on_us = (\d+), "
                      r"\.off_us = (\d+), \.rest_us = (\d+), \.negative = false")


@pytest.fixture(scope="module")
def checker():
    return Checker()


def made(*steps, parts=1, bottom=0):
    """A staircase of these steps; a program needs nothing else of it."""
    job = Job(70, 110, steps[-1][1] / 1000, steps=parts)
    return Staircase(job, 110, 6.2, steps[-1][0], 107.8, tuple(Step(*one) for one in steps),
                     bottom, 25, ())


def way(records):
    """Condition, depth at the end (um) and limit (um) of each move of machining, as executed."""
    number, depth, moves = 0, 0, []
    for one in records:
        number = one.condition or number
        depth -= one.delta[2] // PULSES_PER_UM
        if one.moves and one.delta[2] < 0:
            moves.append((number, depth, one.items[LIMIT] // PULSES_PER_UM))
    return moves


def test_the_conditions_are_those_of_the_controller():
    text = (ROOT / "softcore" / "firmware" / "gap" / "built_in.h").read_text()
    rows = [tuple(map(int, row)) for row in MEASURED.findall(text)]
    assert [(ip, number, on, off) for number, ip, on, off, _ in rows] == list(BUILT_IN)


def test_a_condition_lies_between_its_neighbours():
    assert condition(6) == (130, "")
    assert condition(3) == (903, "G10 C903 I3 P45 Q35 R35")
    assert condition(15) == (915, "G10 C915 I15 P250 Q125 R125")
    ons = [int(re.search(r" P(\d+)", condition(ip)[1] or " P0")[1]) or
           next(row[2] for row in BUILT_IN if row[0] == ip) for ip in range(1, 64)]
    assert ons == sorted(set(ons))
    assert ons[-1] <= 2000


def test_the_reference_case_is_a_program_that_the_firmware_takes(checker):
    found = plan(DATA, Job(70, 110, 15))
    records = checker.check(encode(program(found, DATA)).rows)
    assert isinstance(records, list), records
    assert found.steps[-1].depth_um == 15_000
    steps = [(condition(int(step.ip))[0], step.depth_um) for step in sunk(found)]
    moves = way(records)
    assert [(number, depth) for number, depth, _ in moves
            if depth not in (1500, 6000)] == steps
    assert [depth for _, depth, _ in moves] == [1500, steps[0][1], 6000, steps[1][1], 14_970]


@pytest.mark.parametrize("series", [False, True])
def test_with_jumps_the_way_is_cleared_while_it_machines(checker, series):
    found = plan(DATA, Job(70, 110, 15))
    plain, jumping = (program(found, DATA, depth_series=series, jumps=jumps).splitlines()
                      for jumps in (False, True))
    words = [line.split(" ", 1)[-1] for line in jumping]
    assert words[words.index("M03") + 1] == JUMP
    assert words[words.index("M05") - 1] == "G38 P0"
    assert [word for word in words if "G38" not in word] == [
        line.split(" ", 1)[-1] for line in plain]
    records = checker.check(encode("\n".join([*jumping, ""])).rows)
    assert isinstance(records, list), records


@pytest.mark.parametrize("steps", [
    [(6, 15_000)],
    [(8, 700), (7, 1500), (6, 6000)],
    [(9, 1499), (8, 1500), (7, 1501), (6, 6001)],
    [(12, 50), (6, 900)],
    [(15, 6000), (1, 40_000)],
])
def test_conditions_and_limits_change_where_they_should(checker, steps):
    records = checker.check(encode(program(made(*steps), DATA)).rows)
    assert isinstance(records, list), records
    begin, moves = 0, way(records)
    for number, depth, limit in moves:
        assert number == next(condition(ip)[0] for ip, end in steps if begin < end)
        limits = [re.search(r"L([0-9.]+)", words)[1] for at, words in LIMITS if at <= begin]
        assert limit == float(limits[-1]) * 1000
        assert limit - begin <= 500
        begin = depth
    assert begin == steps[-1][1]
    assert {end for _, end in steps} <= {depth for _, depth, _ in moves}


def test_as_a_depth_series_the_way_is_one_block():
    text = program(made((8, 2203), (7, 7499), (6, 15_000)), DATA, depth_series=True)
    body = [line.split(" ", 1)[1] for line in text.splitlines() if line.startswith("N")]
    at = body.index("M03")
    assert body[at + 1:at + 6] == ["G39 Z-2.203 C907", "G39 Z-7.499 C130", "G01 Z-15. F60", "G39",
                                   "M05"]
    assert "C908" in body[:at]
    assert sum(line.startswith("G36") for line in body) == 1


@pytest.mark.parametrize(("steps", "bottom", "wanted"), [
    ([(8, 2203), (6, 15_000)], 29.2, [(8, 2203), (6, 14_970)]),
    ([(8, 960), (7, 980), (6, 1000)], 30, [(8, 940), (6, 970)]),    # the last 30 um by 6 IP
    ([(8, 30), (6, 50)], 30, [(6, 20)]),
])
def test_a_program_ends_above_the_depth_by_the_stock_on_the_bottom(checker, steps, bottom, wanted):
    found = made(*steps, bottom=bottom)
    assert [(step.ip, step.depth_um) for step in sunk(found)] == wanted
    records = checker.check(encode(program(found, DATA)).rows)
    assert isinstance(records, list), records
    assert way(records)[-1][1] == wanted[-1][1]


def test_a_cavity_less_deep_than_its_stock_is_refused():
    with pytest.raises(UserError, match=r"^the last step leaves 30 um on the bottom, so nothing is "
                                        r"roughed to 0\.03 mm\.$"):
        program(made((6, 30), bottom=30), DATA)


def test_a_long_source_is_no_longer_than_a_block(checker):
    data = [replace(one, source="own trials, May " * 40) for one in DATA]
    records = checker.check(encode(program(made((6, 15_000)), data)).rows)
    assert isinstance(records, list), records


def test_a_single_step_needs_no_depth_series_but_may_have_one():
    text = program(made((6, 15_000)), DATA, depth_series=True)
    assert text.count("G39") == 1


def test_what_the_controller_cannot_be_set_to_is_refused():
    bound = r"^the controller sets the power supply to {} of its steps at most, IP {}, so no "
    with pytest.raises(UserError, match=bound.format(20, "20") + r"program .* with IP 21\.$"):
        program(made((21, 1000), (20, 2000)), DATA)
    with pytest.raises(UserError, match=bound.format(60, "20") + r"program .* with IP 20.333\.$"):
        program(made((61 / 3, 1000), (20, 2000), parts=3), DATA)
    with pytest.raises(UserError, match=bound.format(63, "15.75") + r"program .* with IP 16\.$"):
        program(made((16, 1000), (15.75, 2000), parts=4), DATA)
    many = [((20 - n) / 4, 100 * (n + 1)) for n in range(20)]
    with pytest.raises(UserError, match=r"^the staircase needs 17 conditions of its own, and the "
                                        r"controller takes 16\.$"):
        program(made(*many, parts=4), DATA)


def test_the_bound_is_that_of_the_gateware():
    usual = inspect.signature(Controller).parameters["level_max"].default
    assert usual == level_max(CURRENT_MAX_A, IP_MA / 1000)
    assert all(level_max(board.current_max_a, board.supply_step_a) == usual
               for board in BOARDS.values())


def test_parts_of_an_ip_have_rows_of_their_own():
    steps = [Step(ip, 1000 * n) for n, ip in enumerate((8.5, 8, 7.5, 0.5), 1)]
    assert conditions(steps) == [
        (964, "G10 C964 I8.5 P142 Q71 R71"), condition(8), (965, "G10 C965 I7.5 P125 Q62 R62"),
        (966, "G10 C966 I0.5 P8 Q13 R13")]
    assert condition(0.05, 970) == (970, "G10 C970 I0.05 P5 Q8 R8")


@pytest.mark.parametrize("series", [False, True])
@pytest.mark.parametrize("parts", range(2, 21))
def test_a_supply_of_finer_steps_has_a_program_that_the_firmware_takes(checker, parts, series):
    """It needs the setting that it names; it uses every level that the gateware has."""
    setting = assign("current_step_ma", round(1500 / parts))
    number, value = setting[1:].split("=")
    ends = [(20, 16, 12, 8, 4), (19, 15, 11, 7, 3), (18, 14, 10, 6, 2), (17, 13, 9, 5, 1)]
    for levels in ends:
        steps = [(level / parts, 300 * n) for n, level in enumerate(levels, 1)]
        text = program(made(*steps, parts=parts), DATA, depth_series=series)
        assert f"NEEDS SETTING {number} AT {value}, MA OF ONE STEP" in text
        for code in (ISO, EIA):
            rows = encode(text, code).rows
            checker.forget()
            if any(level % parts for level in levels):
                words = "steps of the power supply, 1500 mA each"
                assert words in checker.check(rows).sentence
            assert checker.enter(setting) == ""
            records = checker.check(rows)
            assert isinstance(records, list), records
    checker.forget()


def test_a_supply_of_half_ampere_roughs_with_more_than_twenty_steps():
    """Currents up to 8.333 IP are 25 steps of 0.5 A; a machine whose gateware has 20 refuses."""
    text = program(plan(DATA, Job(70, 110, 15, steps=3)), DATA)
    tape = encode(text)
    setting = assign("current_step_ma", 500)
    half, sinker = machines.load("half"), machines.load("sinker")
    assert half.level_max == 60
    assert "I8.333 " in text
    assert check(tape, [], half) == check(tape, [setting]) > 20
    with pytest.raises(TapeError, match="must be 0 to 20 steps of the power supply, 500 mA each"):
        check(tape, [setting], sinker)


def test_without_finer_steps_no_setting_is_named():
    assert "SETTING" not in program(made((8, 2203), (6, 15_000)), DATA)


@pytest.mark.parametrize(("step", "parts"), [(1, 1), (0.5, 2), (0.333, 3), (1 / 3, 3), (0.05, 20)])
def test_the_supply_divides_an_ip_into_whole_parts(step, parts):
    assert parts_of_step(step) == parts


@pytest.mark.parametrize("step", [0, -1, 0.4, 2, 0.01, 1e-320, math.inf, math.nan])
def test_other_steps_are_refused(step):
    with pytest.raises(UsageError, match=r"^the supply's step must be 1 IP or a whole part of it, "
                                         rf"down to 1/20, not {step}\.$"):
        parts_of_step(step)


def gapkeeper(*arguments):
    return command.gapkeeper("plan", *arguments, columns=120)


JOB = ["--electrode", "copper", "--workpiece", "steel", "--area", 70, "--undersize", 110,
       "--depth", 15]


def test_the_command_shows_and_writes(tmp_path):
    target = tmp_path / "made" / "job.nc"
    result = gapkeeper(*JOB, "--taper", 10, "--finish", 5, "-o", target)
    assert result.returncode == 0, result.stderr
    for words in ("synthetic: do not machine", "C908", "count as 108.33 um", "21 um on the",
                  "7.499   15.000    6            9        C130"):
        assert words in result.stdout
    assert target.read_text().startswith("%\n(ROUGHING, COPPER ON STEEL, 70 MM2 TO 15 MM")
    picture = imread(target.with_suffix(".png"))
    assert picture.shape[0] > 400
    assert picture[:, :, :3].std() > 0.02


def test_the_command_writes_for_a_supply_of_finer_steps(tmp_path):
    target = tmp_path / "job.nc"
    result = gapkeeper(*JOB, "--step", 0.5, "-o", target)
    assert result.returncode == 0, result.stderr
    assert "It needs the setting $455=750 (one step of the power supply, mA)." in result.stdout
    assert re.search(r"7\.5  +11\.25  +C965 ", result.stdout)
    text = target.read_text()
    assert "G10 C965 I7.5 " in text
    assert f"NEEDS SETTING {named('current_step_ma').number} AT 750," in text


def test_a_name_of_a_material_may_be_anything(tmp_path, recwarn):
    data = [replace(one, electrode="$\\no", workpiece="\u9ec4$ (x)") for one in DATA]
    found = plan(data, Job(70, 110, 15))
    assert "(ROUGHING,   NO ON     X , 70 MM2" in program(found, data)
    plot(found, data, tmp_path / "made.png")
    assert imread(tmp_path / "made.png").shape[0] > 400
    assert not recwarn.list


@pytest.mark.parametrize(("arguments", "status", "words"), [
    (["--area", 0.5], 1, "the area of 0.5 mm2 is outside of the basic data (20 to 400 mm2)."),
    (["--electrode", "silver"], 1, "there are no basic data of silver on steel in "),
    (["--series"], 2, "--series needs a program to be written (-o)."),
    (["--jumps"], 2, "--jumps needs a program to be written (-o)."),
    (["--step", 0.4], 2, "the supply's step must be 1 IP or a whole part of it"),
    (["--undersize", 150, "--step", 0.2, "-o", "build/never.nc"], 1,
     "the controller sets the power supply to 63 of its steps at most, IP 12.6, so no program can "
     "be written with IP 13."),
    (["-o", "/dev/null/x.nc"], 1, "/dev/null cannot be written"),
    (["-o", "/dev/full", "--plot", "build/never.png"], 1,
     "/dev/full cannot be written: No space left on device."),
    (["-o", "build/one.png"], 2, "build/one.png cannot be the program and its plot."),
    (["-o", "build/one.nc", "--plot", "build/../build/one.nc"], 2,
     "build/one.nc cannot be the program and its plot."),
    (["--plot", "build/one.svg"], 2, "build/one.svg must end with .png: the plot is a PNG."),
    (["--plot", "build/one"], 2, "build/one must end with .png: the plot is a PNG."),
])
def test_failures_are_one_sentence(arguments, status, words):
    result = gapkeeper(*JOB, *arguments)
    assert result.returncode == status
    assert words in result.stderr
    assert result.stderr.count("\n") == 1
    assert result.stdout == ""


def test_an_undersize_without_bounds_is_refused():
    result = gapkeeper(*JOB, "--undersize", "inf")
    assert result.returncode == 2
    assert "--undersize" in result.stderr
    assert gapkeeper(*JOB, "--undersize", 100_000).stderr == ""
