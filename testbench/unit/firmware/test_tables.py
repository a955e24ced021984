# SPDX-License-Identifier: Apache-2.0
"""The firmware follows the tables: compiled with altered tables it behaves accordingly."""

import shutil
from dataclasses import replace

import pytest

from softcore import image, render
from softcore.tables.conditions import CONDITIONS
from softcore.tables.events import EVENTS
from softcore.tables.faults import FAULTS, error_line
from softcore.tables.settings import SETTINGS
from testbench.firmware import Controller, events
from testbench.unit.project.test_tables import altered

SETTINGS_NEW = altered(SETTINGS, "no_progress_s", number=699, title="new title", unit="min",
                       default=5, highest=7)
FAULTS_NEW = altered(altered(FAULTS, "locked", grbl_error=7), "not_armed", number=253,
                     sentence="press the button")
EVENTS_NEW = altered(EVENTS, "resume", number=44, word="on")
CONDITIONS_NEW = (replace(CONDITIONS[0], number=105), *CONDITIONS[1:])


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """The whole firmware, compiled with altered tables and unlocked."""
    folder = tmp_path_factory.mktemp("altered")
    sources = folder / "firmware"
    shutil.copytree(image.SOURCES, sources)
    for name, text in (("base/settings_table.c", render.settings_source(SETTINGS_NEW)),
                       ("base/settings_table.h", render.settings_header(SETTINGS_NEW)),
                       ("base/fault_codes.h", render.faults_header(FAULTS_NEW)),
                       ("hal/event_kinds.h", render.events_header(EVENTS_NEW)),
                       ("gap/built_in.h", render.conditions_header(CONDITIONS_NEW))):
        assert (sources / name).read_text().partition("\n")[2] != text, "nothing is altered"
        (sources / name).write_text(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(image, "SOURCES", sources)
        patch.setattr(image, "BUILD", folder / "build")
        made = Controller()
    assert made.line("G00 X1")[-1] == "error:7", "it is locked"
    assert made.line("$X")[-1] == "ok"
    assert made.line("$POSITION=HERE") == ["ok"]
    return made


def test_a_setting_has_the_number_the_range_and_the_words_of_its_row(machine):
    assert machine.line("$444=5")[-1] == error_line("setting")
    assert machine.line("$699=8")[-1] == error_line("setting")
    assert "$699=5" in machine.line("$$", passes=2000)
    assert machine.line("$ES=699") == ["[SETTING:699|8|new title|min|5|#########0|0|7]", "ok"]
    assert machine.line("$699=0") == ["ok"]
    assert machine.line("?")[-1].endswith("|Off:no progress>")
    assert machine.line("$699=7") == ["ok"]


def test_a_refusal_has_the_number_and_the_sentence_of_its_row(machine):
    assert machine.line("C110")[-1] == "ok"
    assert machine.line("M03") == ["[MSG:press the button.]", "error:253"]


def test_an_event_has_the_number_and_the_word_of_its_row(machine):
    machine.library.gk_event(44, 0, 0, 0)
    assert events(machine.run(60)) == [["on"]]
    machine.library.gk_event(4, 0, 0, 0)
    assert not events(machine.run(60)), "nobody knows the old number"


def test_a_condition_has_the_number_of_its_row(machine):
    assert machine.line("C105")[-1] == "ok"
    assert machine.line("C100")[-1] == error_line("condition")
