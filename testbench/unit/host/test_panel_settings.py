# SPDX-License-Identifier: Apache-2.0
"""What the panel knows of the settings, without its page.

The controller is a script of answers, or the firmware.
"""

import re

import pytest

from softcore.tables.settings import SETTINGS, assign, named
from testbench.unit.host.test_panel import SETTING, Board, serve, until
from testbench.unit.host.test_panel_by_hand import Slow

__all__ = ["serve"]     # a fixture

SINGLE, DRY = named("single_block").number, named("dry_run_mm_min").number
GRBL_SPEED = 110    # a setting of grbl, which follows from ours


class Listed(Slow):
    """A controller that tells a list of settings, once for each ``$$`` that it answers."""

    told = "0"

    def say(self, line):
        if re.match("ok ", line) and self.lines[-1] == "$$" != self.waits:
            super().say(f"${SETTING.number}={self.told}")
            super().say(f"${GRBL_SPEED}=600.000")
        super().say(line)


def begun(serve, wire):
    """A session whose page has the controls; return it, and what waits while the page is there."""
    session = serve(wire)
    session.take("a")

    def await_(condition):
        until(condition, lambda: session.seen("a"))

    return session, await_


def own(session):
    """What is known of the settings that can be set."""
    return {one.number: session.heard.settings.get(one.number) for one in SETTINGS}


def lists(wire):
    """How often the list has been asked for."""
    return wire.lines.count("$$")


def passed(session, await_):
    """Wait until a line that is ordered now has been answered."""
    session.order("a", "line", "M09")
    await_(lambda: session.notice == "M09: ok")


@pytest.mark.parametrize("line", ["$RST=$", "$rst=*"])
def test_defaults_that_are_brought_back_are_known(serve, line):
    """Else a tape is started in the belief that it runs dry."""
    session, await_ = begun(serve, Board())
    session.order("a", "line", f"${SINGLE}=1")
    session.order("a", "line", f"${DRY}=900")
    await_(lambda: (session.heard.settings[SINGLE], session.heard.settings[DRY]) == ("1", "900"))
    assert session.heard.dry
    session.order("a", "line", line)
    await_(lambda: None not in own(session).values() and not session.heard.dry)
    assert own(session) == {one.number: str(one.default) for one in SETTINGS}


def test_nothing_is_known_of_the_settings_until_their_list_has_come(serve):
    wire = Listed(waits="$$$")
    wire.told = "12"
    session, await_ = begun(serve, wire)
    assert session.heard.settings == {SETTING.number: "12", GRBL_SPEED: "600.000"}
    wire.waits, wire.told = "$$", "5"
    before = lists(wire)
    session.order("a", "line", "$RST=$")
    await_(lambda: lists(wire) > before)
    assert session.heard.settings == {}
    wire.waits = ""
    wire.say(f"ok @{session._sent.number}")
    await_(lambda: session.heard.settings.get(SETTING.number) == "5")
    passed(session, await_)
    assert lists(wire) == before + 1


def test_the_list_is_asked_for_anew_if_a_stop_has_ended_it(serve):
    wire = Listed(waits="$$$")
    session, await_ = begun(serve, wire)
    wire.waits, wire.told = "$$", "5"
    before = lists(wire)
    session.order("a", "line", "$RST=$")
    await_(lambda: lists(wire) > before)
    ended = session._sent
    session.order("a", "stop")
    await_(lambda: session._sent is not ended)
    wire.waits = ""
    await_(lambda: session.heard.settings.get(SETTING.number) == "5")


@pytest.mark.parametrize("line", ["$RST=#", "$RST=$", f"${SETTING.number}=13"])
def test_what_changes_no_setting_keeps_what_is_known(serve, line):
    """The offsets alone, and what is refused."""
    wire = Listed(waits="$$$")
    wire.refuses = "" if line == "$RST=#" else line
    wire.told = "12"
    session, await_ = begun(serve, wire)
    before = lists(wire)
    session.order("a", "line", line)
    passed(session, await_)
    assert session.heard.settings == {SETTING.number: "12", GRBL_SPEED: "600.000"}
    assert lists(wire) == before


@pytest.mark.parametrize("value", ["13", "013"])
def test_a_setting_that_was_taken_is_known_without_the_list(serve, value):
    """The list takes long, and every line and every jog would wait for it."""
    wire = Listed(waits="$$$")
    session, await_ = begun(serve, wire)
    before = lists(wire)
    session.order("a", "line", f"${SETTING.number}={value}")
    passed(session, await_)
    assert session.heard.settings == {SETTING.number: "13"}     # grbl's follow from ours
    assert lists(wire) == before


@pytest.mark.parametrize("line", ["$399=1", f"${SETTING.number}={SETTING.highest + 1}",
                                  f"${SETTING.number}=1.5"])
def test_a_setting_that_the_panel_does_not_know_is_asked_for(serve, line):
    """Firmware of another edition may have taken it otherwise than it was given."""
    wire = Listed(waits="$$$")
    session, await_ = begun(serve, wire)
    before = lists(wire)
    wire.told = "7"
    session.order("a", "line", line)
    await_(lambda: session.heard.settings.get(SETTING.number) == "7")
    assert lists(wire) == before + 1


@pytest.mark.parametrize("line", ["$RST=$", f"${SETTING.number}=13"])
def test_a_line_that_an_alarm_has_overtaken_may_have_changed_settings(serve, line):
    wire = Listed(waits="$$$")
    session, await_ = begun(serve, wire)
    before, wire.waits, wire.told = lists(wire), line, "5"
    session.order("a", "line", line)
    await_(lambda: line in wire.lines)
    wire.say("ALARM:140")
    await_(lambda: lists(wire) > before)
    await_(lambda: session.heard.settings.get(SETTING.number) == "5")


def test_the_firmware_keeps_every_setting_as_it_was_given(serve):
    session, await_ = begun(serve, Board())
    given = [assign(one.name, min(one.default + 1, one.highest)) for one in SETTINGS]
    for line in given:
        await_(lambda line=line: session.order("a", "line", line) == "")
    passed(session, await_)
    known = own(session)
    assert sum(known[one.number] != str(one.default) for one in SETTINGS) > len(SETTINGS) / 2
    session.heard.settings.clear()
    session.order("a", "line", "$$")
    await_(lambda: None not in own(session).values())
    assert own(session) == known
