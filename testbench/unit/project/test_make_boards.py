# SPDX-License-Identifier: Apache-2.0
"""``make boards``: several boards at a time, and their budgets. A stand-in builds each board."""

import io
import json
import re
import sys
from dataclasses import asdict, fields

import pytest
from rich.console import Console

from host import bitstream
from host.errors import UsageError, UserError
from softcore.build import BOARDS, Cells
from testbench.budget import boards
from testbench.budget.boards import BoardBudget

# Notes when it began and ended; fails for the board that is told.
STAND_IN = """
import sys, time
name, failing = sys.argv[2], sys.argv[1]
print("place and route, seed 1", flush=True)
with open("{log}", "a") as log:
    log.write(f"+ {{name}}\\n")
time.sleep(0.4)
with open("{log}", "a") as log:
    log.write(f"- {{name}}\\n")
if name == failing:
    sys.exit("gapkeeper: the layout is too slow")
"""
NAMES = list(BOARDS)


@pytest.fixture
def built(workdir, monkeypatch):
    """Build boards by the stand-in; return what was printed, and most boards at a time."""
    log = workdir / "log.txt"
    log.unlink(missing_ok=True)

    def run(names, failing=""):
        monkeypatch.setattr(bitstream, "COMMAND", [
            sys.executable, "-c", STAND_IN.format(log=log), failing])
        out = io.StringIO()
        try:
            bitstream.build_boards(names, Console(file=out, width=1000))
        finally:
            at_once = most = 0
            for line in log.read_text().splitlines() if log.exists() else []:
                at_once += 1 if line[0] == "+" else -1
                most = max(most, at_once)
        return out.getvalue(), most

    run.log = log
    return run


def test_boards_are_built_two_at_a_time_and_each_line_names_its_board(built):
    said, most = built([*NAMES, NAMES[0]])
    assert most == bitstream.TOGETHER == 2
    for name in NAMES:
        assert said.count(f"{name}: place and route, seed 1\n") == 1
        assert re.search(rf"^{name}: took \d+\.\d minutes of CPU time$", said, re.M)


def test_a_board_that_fails_does_not_stop_the_others_and_is_named_at_the_end(built):
    with pytest.raises(UserError, match=rf"^1 of 3 boards failed: {NAMES[0]}; what each said is "
                                        r"above\.$"):
        built(NAMES, failing=NAMES[0])
    assert sorted(built.log.read_text().split()) == sorted(
        word for name in NAMES for word in ("+", "-", name, name))


def test_an_unknown_board_is_refused_before_any_is_built(built):
    with pytest.raises(UsageError, match=r'^there is no board "nosuch"; there are: '):
        built([NAMES[0], "nosuch"])
    assert not built.log.exists()


BUDGET = BoardBudget(luts=20_000, lut4=10_000, ccu2c=4000, ff=12_000, ram=200, bram=100, dsp=4,
                     mhz=54.0)
NAN = float("nan")


def manifest(**changed):
    found = asdict(BUDGET) | changed
    mhz = found.pop("mhz")
    return {"cells": found, "clocks_mhz": {
        "clk": {"reached": mhz, "wanted": 50.0}, "other": {"reached": 900.0, "wanted": 25.0}}}


@pytest.mark.parametrize(("changed", "said"), [
    ({}, []),
    ({"luts": 21_000, "mhz": 51.4}, []),
    ({"luts": 21_001}, ["one: luts 21001, budget 20000 (+5.0%)"]),
    ({"luts": 18_900}, ["one: luts 18900, budget 20000 (-5.5%)"]),
    ({"mhz": 51.2}, ["one: mhz 51.2, budget 54 (-5.2%)"]),
    ({"bram": 106, "ff": 13_000}, ["one: ff 13000, budget 12000 (+8.3%)",
                                   "one: bram 106, budget 100 (+6.0%)"]),
    ({"lut4": 10_501}, ["one: lut4 10501, budget 10000 (+5.0%)"]),
    ({"ccu2c": 4640}, ["one: ccu2c 4640, budget 4000 (+16.0%)"]),
    ({"ram": 400}, ["one: ram 400, budget 200 (+100.0%)"]),
    ({"mhz": NAN}, ["one: mhz is missing from the manifest, or no number"]),
    ({"mhz": float("inf")}, ["one: mhz is missing from the manifest, or no number"]),
    ({"ff": NAN, "dsp": None}, ["one: ff is missing from the manifest, or no number",
                                "one: dsp is missing from the manifest, or no number"]),
])
def test_a_change_beyond_five_percent_is_told_with_both_figures(monkeypatch, changed, said):
    monkeypatch.setitem(boards.BUDGETS, "one", BUDGET)
    assert boards.changes("one", manifest(**changed)) == said


@pytest.mark.parametrize("other", [
    {}, {"reached": NAN}, {"reached": 10**400}, {"reached": None}, {"reached": "54"}, 7])
def test_one_clock_without_a_figure_is_told(monkeypatch, other):
    """Also when another clock, before or behind it, has one."""
    monkeypatch.setitem(boards.BUDGETS, "one", BUDGET)
    good = {"reached": 54.0, "wanted": 50.0}
    for clocks in ({"clk": good, "other": other}, {"other": other, "clk": good}, {"other": other}):
        assert boards.changes("one", manifest() | {"clocks_mhz": clocks}) == [
            "one: mhz is missing from the manifest, or no number"]


@pytest.mark.parametrize("found", [{}, {"cells": None, "clocks_mhz": None},
                                   {"cells": [], "clocks_mhz": {}}])
def test_a_manifest_without_figures_lacks_each_of_them(monkeypatch, found):
    monkeypatch.setitem(boards.BUDGETS, "one", BUDGET)
    assert boards.changes("one", found) == [
        f"one: {figure} is missing from the manifest, or no number" for figure in asdict(BUDGET)]


def test_a_board_without_a_budget_that_lacks_a_figure_is_told(monkeypatch):
    monkeypatch.delitem(boards.BUDGETS, "one", raising=False)
    assert boards.changes("one", manifest(ram=None)) == [
        "one: ram is missing from the manifest, or no number"]


def test_all_that_synthesis_counts_has_a_budget():
    figures = set(asdict(BUDGET))
    assert figures == {field.name for field in fields(Cells)} | {"luts", "mhz"}


def test_a_board_without_a_budget_is_told_with_its_figures(monkeypatch):
    monkeypatch.delitem(boards.BUDGETS, "one", raising=False)
    assert boards.changes("one", manifest()) == [f"one: no budget yet, measured is {BUDGET}"]


def test_the_command_fails_with_the_figures(workdir, monkeypatch, capsys):
    first, second, *_ = NAMES
    for name, found in ((first, manifest()), (second, manifest(luts=30_000))):
        monkeypatch.setitem(boards.BUDGETS, name, BUDGET)
        (workdir / name).mkdir(exist_ok=True)
        (workdir / name / "manifest.json").write_text(json.dumps(found))
    for names, status in (([first], 0), ([first, second], 1)):
        monkeypatch.setattr(sys, "argv", ["boards", *names])
        with pytest.raises(SystemExit) as end:
            boards.main(workdir)
        assert end.value.code == status
    assert capsys.readouterr().err == f"{second}: luts 30000, budget 20000 (+50.0%)\n"


@pytest.mark.parametrize("text", [b"", b"{", b"[]", b"\xff"])
def test_a_damaged_manifest_is_one_sentence(tmp_path, monkeypatch, capsys, text):
    (tmp_path / NAMES[0]).mkdir()
    (tmp_path / NAMES[0] / "manifest.json").write_bytes(text)
    monkeypatch.setattr(sys, "argv", ["boards", NAMES[0]])
    with pytest.raises(SystemExit) as end:
        boards.main(tmp_path)
    assert end.value.code == 1
    assert capsys.readouterr().err == (
        f"{NAMES[0]}: its manifest is damaged; gapkeeper build {NAMES[0]} makes it anew\n")


def test_a_board_that_was_not_built_is_one_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["boards", NAMES[0]])
    with pytest.raises(SystemExit) as end:
        boards.main(tmp_path)
    assert end.value.code == 1
    assert capsys.readouterr().err == (
        f"{NAMES[0]}: there is no layout to judge; gapkeeper build {NAMES[0]} makes it\n")
