# SPDX-License-Identifier: Apache-2.0
"""The pages: they can be built, all that they name exists, and generated pages are not stale."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from host import pages
from softcore.tables.faults import FAULTS
from softcore.tables.grbl import GRBL_SETTINGS
from softcore.tables.settings import SETTINGS
from testbench.native import page as signals

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.rglob("*.md")), *sorted(ROOT.glob("*.md")), ROOT / "tapes" / "README.md"]
ELEMENTS = DOCS / "explanation" / "four-patents.md"
LONGEST_README = 150
SETTING_NUMBERS = {one.number for one in (*SETTINGS, *GRBL_SETTINGS)}
FAULT_NUMBERS = {number for one in FAULTS for number in (one.number, one.grbl_error, one.grbl_alarm)
                 if number}
TOPS = ("rtl/", "softcore/", "host/", "testbench/", "constraints/", "docs/", "tapes/")


def prose(path):
    """A page without its fenced code."""
    return re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)


def dead_links(path):
    """Links to files that do not exist."""
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(path)):
        place = target.partition("#")[0]
        if place and "://" not in place and not (path.parent / place).exists():
            yield target


def dead_names(path):
    """Files and folders that a page names in code type and that do not exist."""
    for name in re.findall(r"`([\w./-]+)`", prose(path)):
        if name.startswith(TOPS) and "NAME" not in name and not (ROOT / name).exists():
            yield name


def dead_numbers(path):
    """Settings, alarms and errors that a page names by their number, and that do not exist."""
    text = prose(path)
    yield from (f"${number}" for number in re.findall(r"\$(\d{3})\b", text)
                if int(number) not in SETTING_NUMBERS)
    yield from (f"{word}{number}" for word, number in re.findall(
        r"\b(alarm |ALARM:|error:)(\d{1,3})\b", text) if int(number) not in FAULT_NUMBERS)


def lost_words(path):
    """Names of functions and tests in a table's row that no file named in the row has."""
    for row in re.findall(r"^\|.*\|$", prose(path), re.M):
        words = re.findall(r"`([\w./-]+)`", row)
        texts = [(ROOT / word).read_text(encoding="utf-8") for word in words
                 if word.startswith(TOPS) and (ROOT / word).is_file()]
        yield from (word for word in words if texts and re.fullmatch(r"[a-z]*_[a-z_0-9]+", word)
                    and not any(re.search(rf"\b{word}\b", text) for text in texts))


def dead(path):
    return [*dead_links(path), *dead_names(path), *dead_numbers(path)]


def test_no_page_names_what_is_not_there():
    assert len(PAGES) > 20
    found = [f"{path.relative_to(ROOT)}: {what}" for path in PAGES
             if path.name != "CHANGELOG.md" for what in dead(path)]
    found += [f"{ELEMENTS.name}: {what}" for what in lost_words(ELEMENTS)]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("line", [
    "See [there](nowhere.md).", "It is in `rtl/nowhere.py`.", "It is `$399`.",
    "Then alarm 43 comes.", "It answers `error:99`.",
    "| x | `_nowhere` in `rtl/motion/retraction.py` |"])
def test_a_planted_dead_name_is_found(tmp_path, line):
    page = tmp_path / "page.md"
    page.write_text(line)
    assert [*dead(page), *lost_words(page)]


def g_words(text):
    """Codes of a text in tenths; ``G54 to G59`` has all between."""
    codes = r"G(\d+(?:\.\d)?)"
    found = {round(10 * float(code)) for code in re.findall(codes, text)}
    for first, last in re.findall(rf"{codes}`? (?:to|and) `?{codes}", text):
        step = 1 if "." in first else 10
        found |= {*range(round(10 * float(first)), round(10 * float(last)) + 1, step)}
    return found


def test_every_g_word_of_the_interpreter_stands_on_the_page_of_programs():
    source = (ROOT / "softcore" / "firmware" / "interp" / "interpreter.c").read_text()
    rows = source[source.index("G_ROWS[] = {"):]
    taken = {int(code) for code in re.findall(r"\{(\d+), G_\w+\}", rows[:rows.index("};")])}
    assert len(taken) > 40
    page = (DOCS / "reference" / "programs.md").read_text(encoding="utf-8")
    assert not taken - g_words(page)


def test_the_readme_can_be_read_at_once():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= LONGEST_README


@pytest.mark.parametrize("page", pages.PAGES, ids=lambda page: page.stem)
def test_a_page_made_from_the_program_is_not_stale(page):
    assert page.read_text(encoding="utf-8") == pages.PAGES[page](), "run python -m host.pages"


def test_the_site_can_be_built_and_nothing_is_warned_of(workdir):
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-E", "-W", "--keep-going", "-q", "-b", "html",
         DOCS, workdir / "site"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (workdir / "site" / "reference" / "guards.html").exists()


def test_the_page_of_the_signals_is_not_stale():
    assert signals.PAGE.read_text(encoding="utf-8") == signals.page(), \
        "run python -m testbench.native.page"
