# SPDX-License-Identifier: Apache-2.0
"""The image for the soft core: it builds without a warning, fits, and is found again."""

import ctypes
import shutil
import struct
from pathlib import Path

import pytest

from softcore import generate, image
from softcore.build import BOARDS
from testbench.firmware import Record, library
from testbench.some import some

# Of a memory; None is that of the simulated machine. Then that of the smallest board.
SIZES = [None, *sorted({board.memory_size for board in BOARDS.values()})]
SMALLEST = image.BESIDE_PATH + 256 * image.PATH_UNIT  # memory for the firmware and a short path


@pytest.mark.parametrize("size", some(SIZES, None, SIZES[1]))
def test_image_fits_its_memory_with_room_for_the_stack(size):
    path = image.target_image(*() if size is None else (size,))
    assert path.stat().st_size > 16_384
    jump, mark, edition, memory, first = struct.unpack("<5I", path.read_bytes()[:20])
    assert jump == 0x0100006F, "over the three words"
    assert mark.to_bytes(4, "little") == b"GKFI"
    assert edition == generate.edition(), "of the gateware of this checkout"
    assert memory == (size or 311_296)
    assert first == 0x30401073, "csrw mie, zero is the first instruction"


def test_image_is_the_same_every_time_and_built_once():
    path = image.target_image()
    before = path.stat().st_mtime_ns
    assert image.target_image() == path
    assert path.stat().st_mtime_ns == before
    again = image.target_image(SMALLEST)
    assert again != path, "another memory is another image: the stack begins elsewhere"


def test_another_memory_compiles_one_source_again(monkeypatch, tmp_path):
    image.target_image()
    ran = []
    run = image._run
    monkeypatch.setattr(image, "BUILD", tmp_path)
    monkeypatch.setattr(image, "_run", lambda command: (ran.append(command), run(command)))
    image.target_image(SMALLEST)
    compiled = [Path(command[command.index("-o") - 1]) for command in ran if "-c" in command]
    assert {path.relative_to(path.parents[1]) for path in compiled} <= {Path(image.RING)}
    assert len(ran) - len(compiled) == 2, "linked, and copied as bytes"


def test_memory_too_small_is_refused():
    with pytest.raises(image.FirmwareError, match="does not fit"):
        image.target_image(49_152)


@pytest.fixture
def sources(monkeypatch, tmp_path):
    """A copy of the sources to change, with what has been compiled of them."""
    image.host_library()
    copy, objects = tmp_path / "firmware", tmp_path / "objects"
    shutil.copytree(image.SOURCES, copy)
    objects.mkdir()
    for made in image.OBJECTS.glob("*.o"):
        (objects / made.name).symlink_to(made)
    monkeypatch.setattr(image, "SOURCES", copy)
    monkeypatch.setattr(image, "OBJECTS", objects)
    monkeypatch.setattr(image, "BUILD", tmp_path / "build")
    return copy


def test_a_warning_is_an_error(sources):
    (sources / "unused.c").write_text("static int unused(void) { return 1; }\n")
    with pytest.raises(image.FirmwareError, match="unused"):
        image.host_library()


@pytest.mark.parametrize("name", ["base/text.c", "base/text.h"])
def test_what_is_compiled_already_is_not_used_for_another_source_or_header(name, sources):
    image.host_library()
    changed = sources / name
    changed.write_text(changed.read_text() + "#error changed\n")
    with pytest.raises(image.FirmwareError, match="changed"):
        image.host_library()


def test_after_a_change_of_one_source_the_others_are_not_compiled_again(sources, monkeypatch):
    before = image.host_library()
    (sources / "base" / "text.c").write_text((sources / "base" / "text.c").read_text() + "\n")
    ran = []
    run = image._run
    monkeypatch.setattr(image, "_run", lambda command: (ran.append(command), run(command)))
    assert image.host_library() != before
    assert len(ran) == 2, "the source, and all linked"


@pytest.mark.parametrize(("what", "other"), [
    ("COMMON", [*image.COMMON, "-DOTHER"]), ("_version", lambda command: "another compiler"),
    ("TARGET_ONLY", (*image.TARGET_ONLY, "unused.c"))])
def test_other_options_sources_or_compilers_make_another_library(what, other, sources, monkeypatch):
    (sources / "unused.c").write_text("int unused_number = 1;\n")
    ran = []
    monkeypatch.setattr(image, "_run", lambda command: (
        ran.append(command), Path(command[command.index("-o") + 1]).write_bytes(b"made")))
    before = image.host_library()
    monkeypatch.setattr(image, what, other)
    ran.clear()
    assert image.host_library() != before
    assert ran


def test_records_have_the_layout_of_the_library():
    """The Python side of the interface is written by hand."""
    assert library().gk_record_size() == ctypes.sizeof(Record)


def test_what_memory_is_left_remembers_the_path():
    """A retraction over 5000 blocks needs the larger board."""
    assert [image.path_units(size) for size in (311_296, 212_992, 188_416)] == [8192, 2048, 512]
    with pytest.raises(image.FirmwareError, match="does not fit"):
        image.path_units(SMALLEST - image.PATH_UNIT)


def test_what_is_compiled_for_speed_is_one_list_of_sources_that_exist():
    sources = {str(path.relative_to(image.SOURCES)) for path in image.SOURCES.rglob("*.c")}
    assert sources > image.FAST
    told = [path for path in image.SOURCES.rglob("*.[ch]")
            if "minsize" in path.read_text() or "optimize(" in path.read_text()]
    assert not told, "size or speed is chosen in softcore.image alone"
