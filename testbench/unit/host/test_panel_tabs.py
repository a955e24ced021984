# SPDX-License-Identifier: Apache-2.0
"""What a page of the panel shows of the settings: the page is real, the browser is not there."""

import asyncio

from nicegui import ui
from nicegui.testing import user_simulation

from host.panel.page import build
from softcore.tables.settings import SETTINGS, named
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


def fields(user):
    """The fields of settings that the page has, by what is before them."""
    return [one for one in user.client.elements.values()
            if isinstance(one, ui.input) and "inputmode" in one.props]


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
        assert "13" in [field.value for field in fields(user)]
        told(session, {})
        await sees(user, "Single block: ?", UNKNOWN)
        await sees_no_more(user, "no discharge")
        assert {field.value for field in fields(user)} == {""}
        before = len(wire.lines)
        user.find("Single block: ?").click()    # on or off: nobody knows what it would do
        await sees(user, "It is not known yet whether this is on.")
        assert f"${SINGLE.number}=1" not in wire.lines[before:]
        told(session, KNOWN)
        await sees(user, "Single block: off")
        await sees_no_more(user, UNKNOWN)

    on_page(session, act)
