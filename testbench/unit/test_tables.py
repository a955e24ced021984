# SPDX-License-Identifier: Apache-2.0
"""Each table stands once: it is well formed, and what is made of it follows a change of one entry.

That what is made is not stale is held by ``test_registers``, with all that is generated.
"""

import re
from dataclasses import replace

import pytest

from softcore import render
from softcore.tables import settings
from softcore.tables.settings import SETTINGS


def altered(table, name, **changes):
    """A copy of a table with one entry changed."""
    assert [one.name for one in table].count(name) == 1
    return tuple(replace(one, **changes) if one.name == name else one for one in table)


def cells(page, first):
    """Cells of the one row of a Markdown page's tables that begins with a cell."""
    found = [line for line in page.splitlines() if line.startswith(f"| {first} |")]
    assert len(found) == 1, first
    return [cell.strip() for cell in found[0].strip("|").split("|")]


# ---- settings


def test_settings_are_well_formed():
    for one in SETTINGS:
        assert 0 <= one.lowest <= one.default <= one.highest < 1 << 32, one.name
        assert re.fullmatch("[a-z][a-z0-9_]*", one.name), one.name
        assert one.meaning.endswith("."), one.name
        assert one.group in settings.GROUPS, one.name
        assert one.guards or not one.switches_off, one.name
        for number in re.findall(r"\$(\d+)", one.meaning):
            assert settings.of_number(int(number)), f"{one.name} speaks of ${number}"
    for key in ("number", "name", "title"):
        assert len({getattr(one, key) for one in SETTINGS}) == len(SETTINGS), key


def test_a_setting_is_changed_in_one_place():
    table = altered(SETTINGS, "no_progress_s", number=464, highest=7, default=5, unit="min",
                    guards=False, title="new title", meaning="New meaning.")
    assert "[SET_NO_PROGRESS_S] = {5, 0, 7, 464, GROUP_GAP, false,\n" \
           '        "new title", "min", "no progress"},' in render.settings_source(table)
    assert cells(render.settings_page(table), "`$464`") == [
        "`$464`", "`no_progress_s`", "min", "5", "0 to 7", "no program", "New meaning."]
    assert "| `$44` |" not in render.settings_page(table)
    assert settings.assign("no_progress_s", 7, table) == "$464=7"
    with pytest.raises(ValueError, match=r"^setting 464 \(no_progress_s\) must be 0 to 7, not 8$"):
        settings.assign("no_progress_s", 8, table)


def test_a_setting_more_is_one_more_everywhere():
    table = (*SETTINGS, replace(SETTINGS[0], number=99, name="fresh"))
    assert "    SET_FRESH,\n    SETTINGS,\n" in render.settings_header(table)
    assert "[SET_FRESH] = {" in render.settings_source(table)
    assert cells(render.settings_page(table), "`$99`")[1] == "`fresh`"
    assert settings.of_number(99, table).name == "fresh"
    assert settings.of_number(99) is None


def test_no_setting_of_an_unknown_name():
    with pytest.raises(KeyError, match="nothing"):
        settings.assign("nothing", 1)
