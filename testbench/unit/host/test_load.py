# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper plan --load``: basic data to a controller over TCP, here its firmware alone."""

import os
import subprocess
import sys

import pytest
from rich.console import Console

from host.errors import UserError
from host.link.link import Link
from host.places import ROOT
from host.roughing import load as loading
from testbench.live import serving
from testbench.piped import Machinery

BASIC = ROOT / "tapes" / "basic"
BAUD = 1_000_000


@pytest.fixture
def url():
    """Port of a controller."""
    with serving(Machinery()) as (url, _):
        yield url


def test_the_command_enters_all_areas_and_the_controller_holds_them(url):
    result = subprocess.run(
        [sys.executable, "-m", "host.cli", "plan", "--electrode", "copper", "--workpiece", "steel",
         "--area", "70", "--undersize", "110", "--depth", "15", "--load", url],
        capture_output=True, text=True, timeout=120, check=False,
        env=os.environ | {"COLUMNS": "120"})
    assert (result.returncode, result.stderr) == (0, "")
    assert f"The controller at {url} holds 75 currents of 5 areas, copper on steel" in result.stdout


def test_data_of_before_are_replaced(url):
    for _ in range(2):
        loading.load("copper", "steel", BASIC, url, baud=BAUD, console=Console(quiet=True))


def test_two_pairs_of_materials_are_held_and_one_is_in_force(url, workdir, capsys):
    for path in BASIC.glob("copper_steel_*.toml"):
        text = path.read_text(encoding="utf-8").replace('"copper"', '"graphite"')
        (workdir / path.name.replace("copper", "graphite")).write_text(text, encoding="utf-8")
    for _ in range(2):
        loading.load("copper", "steel", BASIC, url, baud=BAUD, console=Console(quiet=True))
        loading.load("graphite", "steel", workdir, url, baud=BAUD, console=Console(width=200))
        assert "graphite on steel: $BP plans with them. It also holds COPPER_STEEL." in (
            capsys.readouterr().out)


def test_a_controller_that_holds_less_is_noticed(url, monkeypatch):
    class Losing(Link):
        """A link that loses the lines of one current."""

        def command(self, line):
            if not line.startswith("$BI15,"):
                super().command(line)

    monkeypatch.setattr(loading, "Link", Losing)
    with pytest.raises(UserError, match=rf"^the controller at {url} does not hold what was entered"
                                        r": it lists 78 lines of 83, or others\.$"):
        loading.load("copper", "steel", BASIC, url, baud=BAUD, console=Console(quiet=True))


def test_nobody_at_the_port_is_one_sentence():
    with pytest.raises(UserError, match=r"^nobody listens at socket://127\.0\.0\.1:1\.$"):
        loading.load("copper", "steel", BASIC, "socket://127.0.0.1:1", baud=BAUD,
                     console=Console(quiet=True))
