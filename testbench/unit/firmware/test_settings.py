# SPDX-License-Identifier: Apache-2.0
"""Settings as senders read them: ``$$`` of grbl 1.1, ``$ES`` of grblHAL, and what cannot be set."""

import ctypes
import re

import pytest

from softcore.tables.faults import error_line
from softcore.tables.grbl import GRBL_SETTINGS
from softcore.tables.settings import FIRST, GROUPS, SETTINGS, assign, named
from testbench.firmware import Checker

BY_NAME = {one.name: str(one.number) for one in SETTINGS}
GRBL = {str(one.number) for one in GRBL_SETTINGS}


def listed(machine):
    """Values of ``$$`` by number, in their order."""
    *rows, answer = machine.line("$$", passes=2000)
    assert answer == "ok"
    return dict(re.fullmatch(r"\$(\d+)=(\d+(?:\.\d{3})?)", row).groups() for row in rows)


def test_the_list_has_each_setting_once_in_rising_order(machine):
    values = listed(machine)
    assert [int(number) for number in values] == sorted(
        one.number for one in (*GRBL_SETTINGS, *SETTINGS))
    assert {BY_NAME[one.name]: str(one.default) for one in SETTINGS}.items() <= values.items()
    for number in values.keys() - GRBL:
        assert machine.line(f"${number}={values[number]}") == ["ok"]
    assert listed(machine) == values


def test_a_change_is_listed(machine):
    assert machine.line(assign("repeats", 7)) == ["ok"]
    assert listed(machine)[BY_NAME["repeats"]] == "7"


def test_values_of_grbl_as_built(machine):
    values = listed(machine)
    assert {number: values[number] for number in values if number in GRBL} == {
        "10": "3", "13": "0", "20": "1", "21": "1", "22": "1", "23": "3",
        "24": "25.000", "25": "500.000", "26": "1", "27": "1.000", "32": "0",
        **dict.fromkeys(("100", "101", "102"), "10000.000"),
        **dict.fromkeys(("110", "111", "112"), "1800.000"),
        **dict.fromkeys(("120", "121", "122"), "1000.000"),
        "130": "598.000", "131": "598.000", "132": "399.000"}


def test_values_of_grbl_follow_ours(machine):
    for name, value in {"highest_speed_mm_min": 901, "acceleration_mm_s2": 1234, "low_x_um": 1001,
                        "high_x_um": 2002, "low_y_um": 0, "high_y_um": 30_000, "low_z_um": 7,
                        "high_z_um": 5000, "soft_limit_um": 4000}.items():
        assert machine.line(assign(name, value)) == ["ok"]
    values = listed(machine)
    assert {values[number] for number in ("110", "111", "112")} == {"901.000"}
    assert {values[number] for number in ("120", "121", "122")} == {"1234.000"}
    assert [values[number] for number in ("130", "131", "132")] == ["3.003", "30.000", "4.007"]


def test_constants_of_grbl_say_what_is_so(machine):
    values = listed(machine)
    report = machine.line("?")[-1]
    assert int(values["10"]) & 1 == ("MPos:" in report)
    assert int(values["10"]) >> 1 & 1 == ("|Bf:" in report)
    assert values["22"] == "1"
    assert machine.line(assign("home_order", 0)) == ["ok"]
    assert listed(machine)["22"] == "0"
    assert machine.line("$H")[-1] == error_line("homing")
    machine.line("G92 X25.4")
    assert machine.line("G20") == ["ok"]
    inches = "WCO:-1.0000," in machine.line("?")[-1]
    assert int(values["13"]) == inches


@pytest.mark.parametrize("form", ["=1", "=1800.5", "=", "=-3"])
def test_a_number_of_grbl_is_not_set_and_what_to_set_is_said(machine, form):
    before = listed(machine)
    for one in GRBL_SETTINGS:
        said, answer = machine.line(f"${one.number}{form}")
        assert said.startswith(f"[MSG:${one.number} ({one.title}) ")
        assert re.findall(r"\$(\d+)", said)[1:] == [BY_NAME[name] for name in one.follows]
        assert answer == error_line("setting")
    assert listed(machine) == before
    refusal = Checker().enter(f"$110{form}")
    assert refusal.startswith("$110 (highest speed of X) follows from $"), "so in a check"


@pytest.mark.parametrize("number", [0, 9, 11, 14, 99, 103, 133, FIRST - 1])
def test_no_other_number_below_ours_exists(machine, number):
    assert machine.line(f"${number}=1") == [
        f"[MSG:setting {number} does not exist or is out of range.]", error_line("setting")]
    assert machine.line(f"$ES={number}")[-1] == error_line("setting")


def test_words_of_all_settings(machine):
    *rows, answer = machine.line("$ES", passes=2000)
    assert answer == "ok"
    # grbl-streamer classifies a line by these words in it.
    assert not [row for row in rows if re.search("error|ALARM|Grbl ", row)]
    words = {row[0]: row[1:] for row in (
        re.fullmatch(r"\[SETTING:(.*)\]", row)[1].split("|") for row in rows)}
    assert list(words) == list(listed(machine))
    for one in SETTINGS:
        assert words[str(one.number)] == [
            str(1 + list(GROUPS).index(one.group)), one.title, one.unit, "5", "#########0",
            str(one.lowest), str(one.highest)]
    for number, value in listed(machine).items():
        if number in GRBL:
            assert words[number][0] == "0"
            assert words[number][-2:] == [value, value], "it cannot be set"
            assert words[number][3] == ("6" if "." in value else "5")


def test_words_of_one_setting(machine):
    repeats = named("repeats")
    said, answer = machine.line(f"$ES={repeats.number}")
    assert answer == "ok"
    assert said == (f"[SETTING:{repeats.number}|2|{repeats.title}|shorts|5|#########0|0|255]")
    assert machine.line("$es=132")[0] == (
        "[SETTING:132|0|travel of Z|mm|6|#########0.000|399.000|399.000]")


@pytest.mark.parametrize("line", ["$ES=", "$ES=4x", "$ES=400,401", "$ES=-1"])
def test_words_are_asked_for_by_a_number(machine, line):
    said, answer = machine.line(line)
    assert "$ES=number" in said
    assert answer == error_line("setting")


def test_groups(machine):
    assert machine.line("$EG", passes=100) == [
        *(f"[SETTINGGROUP:{number}|0|{title}]" for number, title in enumerate(GROUPS.values(), 1)),
        "ok"]


def test_a_reset_ends_a_list(machine):
    machine.send(b"$$\n")
    assert len(machine.run(20)) > 2
    machine.send(b"\x18")
    said = machine.run(300)
    assert "ok" not in said
    assert len(said) < 10


def ramp(machine):
    """Start rate and acceleration, those of the way back, and the lead, as written."""
    row = (ctypes.c_uint32 * 5)()
    machine.library.gk_ramp_words(row)
    return tuple(row)


def test_the_way_back_has_a_ramp_of_its_own(machine):
    start, acceleration, *back, _ = ramp(machine)
    assert back == [start, acceleration]
    assert machine.line(assign("start_speed_um_s", 5000)) == ["ok"]
    assert machine.line(assign("acceleration_mm_s2", 2000)) == ["ok"]
    half, twice, *back, _ = ramp(machine)
    assert back == [half, twice]
    assert abs(2 * half - start) <= 2
    assert 2 * acceleration <= twice
    assert machine.line(assign("back_start_speed_um_s", 10_000)) == ["ok"]
    assert machine.line(assign("back_acceleration_mm_s2", 1000)) == ["ok"]
    assert ramp(machine)[:4] == (half, twice, start, acceleration)


def test_feed_forward_makes_up_the_lag_of_the_loop(machine):
    """It does as delivered."""
    clocks = machine.library.gk_lead(100, named("loop_gain").default)
    assert ramp(machine)[4] == clocks > 0
    assert machine.line(assign("loop_gain", 25)) == ["ok"]
    assert ramp(machine)[4] == 2 * clocks
    assert machine.line(assign("feed_forward", 50)) == ["ok"]
    assert ramp(machine)[4] == clocks
    assert machine.line(assign("feed_forward", 0)) == ["ok"]
    assert ramp(machine)[4] == 0
