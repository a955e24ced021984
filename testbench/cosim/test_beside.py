# SPDX-License-Identifier: Apache-2.0
"""Speed of the simulation beside another version's."""

import sys
from itertools import pairwise
from pathlib import Path

import pytest

from host.errors import UsageError
from testbench.beside import BIN, ROOT, TAPES, fastest, main, measure, speed


def test_speed_is_clocks_by_cpu_time():
    assert speed([(0, 3_000_000, 1.0), (3_000_000, 1_000_000, 0.6)]) == pytest.approx(2.5)


def test_of_equal_runs_the_fastest_time_of_each_part_counts():
    one = [(0, BIN, 0.02), (BIN, BIN // 2, 0.03), (BIN + BIN // 2, BIN // 2, 0.01)]
    other = [(0, BIN, 0.03), (BIN, BIN, 0.02)]
    assert fastest([one, other]) == pytest.approx(2 * BIN / 0.04 / 1e6)
    # A part that another run did not go through, or in other clocks, is left out.
    assert fastest([[*one, (2 * BIN, BIN, 9.0)], other]) == pytest.approx(2 * BIN / 0.04 / 1e6)


def test_this_version_beside_itself(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["beside", str(ROOT), "--tapes", TAPES[0], "--pairs", "1",
                                      "--until", "0.05"])
    main()
    *_, pair, best = capsys.readouterr().out.splitlines()
    assert pair.startswith(f"| `{TAPES[0]}` | pair 1 | ")
    assert best.startswith(f"| `{TAPES[0]}` | fastest of 1 | ")
    for row in pair, best:
        times = float(row.split("|")[-2])
        assert 0.1 < times < 10     # of the same work


def test_a_run_is_told_clock_by_clock(monkeypatch):
    monkeypatch.chdir(ROOT / "docs")
    rows = measure(Path(".."), TAPES[0], 0.05)
    assert rows[0][0] == 0
    assert all(at + count == after for (at, count, _), (after, *_) in pairwise(rows))
    assert rows[-1][0] + rows[-1][1] > 0.05 * 2_000_000


@pytest.mark.parametrize("tape", [TAPES[0], "no_such_tape"])
def test_a_folder_without_the_tape_is_named(tmp_path, tape):
    folder = tmp_path if tape == TAPES[0] else ROOT
    with pytest.raises(UsageError, match=f"is no folder of Gapkeeper: there is no .*{tape}.nc"):
        measure(folder, tape)


def test_no_pair_is_refused(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["beside", str(ROOT), "--pairs", "0"])
    with pytest.raises(SystemExit):
        main()
    assert capsys.readouterr().err.endswith("argument --pairs: at least one pair is needed\n")


def test_a_version_that_does_not_run_says_why(tmp_path):
    (tmp_path / "tapes").mkdir()
    (tmp_path / "tapes" / f"{TAPES[0]}.nc").write_text("%\nM02\n%\n")
    (tmp_path / "host").mkdir()
    (tmp_path / "host" / "__init__.py").write_text("raise ImportError('too old')\n")
    with pytest.raises(UsageError, match=r"(?s)did not run sink_shallow_deep:.*too old"):
        measure(tmp_path, TAPES[0])
