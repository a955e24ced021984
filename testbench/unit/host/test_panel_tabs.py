# SPDX-License-Identifier: Apache-2.0
"""What a page of the panel shows of the settings, without a browser."""

import asyncio

import pytest
from nicegui import ui
from nicegui.testing import UserInteraction, user_simulation

from host.panel.page import build
from softcore.tables.settings import GROUPS, SETTINGS, named
from testbench.unit.host.test_panel import SETTING, Script, serve

__all__ = ["serve"]     # a fixture

SINGLE, DRY = named("single_block"), named("dry_run_mm_min")
KNOWN = {setting.number: str(setting.default) for setting in SETTINGS}
TRIES = 100         # looks at the page, a tenth of a second apart
UNKNOWN = "Dry run: not known yet"


def on_page(session, act):
    """Open a page of a session, and carry out what ``act`` does with its user."""
    async def opened():
        async with user_simulation() as user:
            build(session, [])
            await user.open("/")
            await act(user)

    asyncio.run(opened())


async def sees(user, *texts):
    for text in texts:
        await user.should_see(text, retries=TRIES)


async def sees_no_more(user, text):
    await user.should_not_see(text, retries=TRIES)


async def controls(user):
    user.find("Take the controls").click()
    await sees(user, "Let go of the controls")


def unfold(user, group):
    """Open the settings of a group."""
    next(one for one in user.client.elements.values()
         if isinstance(one, ui.expansion) and one.text == GROUPS[group]).open()


def fields(user):
    """The fields of settings that the page has."""
    return [one for one in user.client.elements.values()
            if isinstance(one, ui.input) and "inputmode" in one.props]


async def field_of_setting(user):
    """Take the controls, and open the field of ``SETTING``, the first that is opened."""
    await controls(user)
    unfold(user, SETTING.group)
    await sees(user, SETTING.title)
    places = [setting.number for setting in SETTINGS if setting.group == SETTING.group]
    return fields(user)[places.index(SETTING.number)]


async def comes(condition):
    """Wait until a condition holds."""
    for _ in range(TRIES):
        if condition():
            return
        await asyncio.sleep(0.1)
    raise AssertionError("it has not happened in time")


def told(session, settings):
    with session.lock:
        session.heard.settings = dict(settings)


def test_what_is_not_known_of_the_settings_is_not_shown(serve):
    """Else a tape is started in the belief that it runs dry."""
    wire = Script()
    session = serve(wire)
    told(session, KNOWN | {SINGLE.number: "1", DRY.number: "900", SETTING.number: "13"})

    async def act(user):
        await controls(user)
        await sees(user, "Single block: on", "Dry run: no discharge, cuts at F900")
        unfold(user, SETTING.group)
        await sees(user, SETTING.title)
        assert "13" in [field.value for field in fields(user)]
        told(session, {})
        await sees(user, "Single block: ?", UNKNOWN)
        await sees_no_more(user, "no discharge")
        assert len(fields(user)) > 1
        assert {field.value for field in fields(user)} == {""}
        before = len(wire.lines)
        user.find("Single block: ?").click()    # on or off: nobody knows what it would do
        await sees(user, "It is not known yet whether this is on.")
        assert f"${SINGLE.number}=1" not in wire.lines[before:]
        told(session, KNOWN)
        await sees(user, "Single block: off")
        await sees_no_more(user, UNKNOWN)

    on_page(session, act)


def test_settings_are_on_the_page_when_their_group_is_opened(serve):
    """All at once, on a slow computer the browser is busy so long that the page is given up."""
    session = serve(Script())
    told(session, KNOWN)
    program = [setting for setting in SETTINGS if setting.group == DRY.group]

    async def act(user):
        await sees(user, *GROUPS.values())
        assert not fields(user)
        unfold(user, DRY.group)
        await sees(user, *(setting.title for setting in program))
        assert [field.value for field in fields(user)] == [KNOWN[one.number] for one in program]
        assert not any(field.enabled for field in fields(user))     # nobody has the controls
        await controls(user)
        assert all(field.enabled for field in fields(user))
        unfold(user, SETTING.group)
        await sees(user, SETTING.title)
        assert all(field.enabled for field in fields(user))
        so_many = len(fields(user))
        assert so_many < len(SETTINGS)
        opened = [one for one in user.client.elements.values() if isinstance(one, ui.expansion)]
        for again in opened:
            if again.value:
                again.close()
                again.open()
        assert len(fields(user)) == so_many
        for again in opened:
            again.open()
        assert len(fields(user)) == len(SETTINGS)

    on_page(session, act)


def test_a_field_whose_value_is_refused_shows_what_is_in_force(serve):
    """Else a setting is believed that the controller has not taken."""
    wire = Script()
    session = serve(wire)
    wire.refuses = f"${SETTING.number}="
    told(session, KNOWN)
    given = str(int(KNOWN[SETTING.number]) + 1)

    async def act(user):
        field = await field_of_setting(user)
        assert field.value == KNOWN[SETTING.number]
        field.set_value(given)
        UserInteraction(user, {field}, None).trigger("keydown.enter")
        await sees(user, f"${SETTING.number}={given} is refused")
        await comes(lambda: field.value == KNOWN[SETTING.number])

    on_page(session, act)


@pytest.mark.parametrize(("typed", "why"), [
    ("21", "The drives are being measured"), ("99999999", "must be a whole number")])
def test_a_field_whose_value_the_panel_refuses_shows_what_is_in_force(serve, typed, why):
    session = serve(Script())
    told(session, KNOWN)

    async def act(user):
        field = await field_of_setting(user)
        session._tuner = "another"
        field.set_value(typed)
        UserInteraction(user, {field}, None).trigger("keydown.enter")
        assert any(why in told for told in user.notify.messages)
        session._tuner = ""
        assert field.value == KNOWN[SETTING.number]

    on_page(session, act)
