# SPDX-License-Identifier: Apache-2.0
"""The field of the tape names the one that *Start* runs, whatever is chosen and refused."""

import asyncio
import threading

import pytest
from nicegui import ui
from nicegui.elements.upload_files import SmallFileUpload
from nicegui.testing import user_simulation

from host.panel.job import Job
from host.panel.page import build
from testbench.unit.host.test_panel import Script, serve
from testbench.unit.host.test_panel_tabs import comes, controls, sees, sees_no_more

__all__ = ["serve"]     # a fixture

TAPE = "%\nG91 G01 X{way} F10\nM02\n%\n"


@pytest.fixture
def tapes(tmp_path):
    for name, text in {"old": TAPE.format(way=1), "new": TAPE.format(way=2), "empty": ""}.items():
        (tmp_path / f"{name}.nc").write_text(text)
    return {path.stem: path for path in sorted(tmp_path.glob("*.nc"))}


def found(user, testid):
    return next(one for one in user.client.elements.values()
                if one.props.get("data-testid") == testid)


async def stays(session):
    """Say that the page is there, as its script does."""
    while True:
        session.seen(session.sharing.holder)
        await asyncio.sleep(0.2)


def on_page(session, tapes, act):
    """Open a page with the tape ``old`` in force, and carry out what ``act`` does."""
    async def opened():
        async with user_simulation() as user:
            build(session, list(tapes.values()))
            await user.open("/")
            await controls(user)
            there = asyncio.create_task(stays(session))
            field = found(user, "choose")
            field.set_value(str(tapes["old"]))
            await sees(user, "in force: old.nc")
            await act(user, field)
            there.cancel()

    asyncio.run(opened())


def test_a_tape_that_cannot_be_read_leaves_the_one_in_force_named(serve, tapes):
    session = serve(Script())

    async def act(user, field):
        field.set_value(str(tapes["empty"]))
        await comes(lambda: user.notify.messages)
        await comes(lambda: field.value == str(tapes["old"]))
        await sees(user, "in force: old.nc")
        assert session.job.path == tapes["old"]

    on_page(session, tapes, act)


def test_a_tape_chosen_while_one_runs_is_not_named(serve, tapes):
    session = serve(Script())

    async def act(user, field):
        session.running = True
        field.set_value(str(tapes["new"]))
        await comes(lambda: user.notify.messages)
        await comes(lambda: field.value == str(tapes["old"]))
        session.running = False
        assert session.job.path == tapes["old"]
        await sees_no_more(user, "new.nc")

    on_page(session, tapes, act)


def test_the_newest_choice_wins_and_nothing_starts_while_it_is_read(serve, tapes, monkeypatch):
    session, read, go_on = serve(Script()), Job.of, threading.Event()

    def slow(path):
        if path == tapes["old"]:
            go_on.wait(20)
        return read(path)

    async def act(user, field):
        field.set_value(str(tapes["new"]))
        await sees(user, "in force: new.nc")
        monkeypatch.setattr(Job, "of", slow)
        field.set_value(str(tapes["old"]))
        await sees(user, "old.nc is being read")
        user.find("Start").click()
        await comes(lambda: "old.nc is still being read." in user.notify.messages)
        assert not session._start
        field.set_value(str(tapes["new"]))
        await sees(user, "in force: new.nc")
        go_on.set()
        await asyncio.sleep(0.5)
        assert session.job.path == tapes["new"]
        assert field.value == str(tapes["new"])

    try:
        on_page(session, tapes, act)
    finally:
        go_on.set()


def test_an_uploaded_tape_is_named_and_the_field_is_empty(serve, tapes):
    session = serve(Script())

    async def act(user, field):
        upload = next(one for one in user.client.elements.values() if isinstance(one, ui.upload))
        await upload.handle_uploads(
            [SmallFileUpload("mine.nc", "text/plain", TAPE.format(way=3).encode())])
        await sees(user, "in force: mine.nc")
        assert field.value is None
        assert session.job.path.name == "mine.nc"

    on_page(session, tapes, act)
