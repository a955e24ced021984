# SPDX-License-Identifier: Apache-2.0
"""The command ``gapkeeper panel`` and a browser that looks at it: Chromium without a window."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
import warnings
from contextlib import contextmanager

from host.places import ROOT

__all__ = ["browser", "chromium_path", "element", "first_picture_s", "opened", "served"]

ANSWER_S = 240.0    # to the first answer, if the machine must be built
DEADLINE_MS = 240_000
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def chromium_path():
    """Path of the system's Chromium, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


@contextmanager
def served(*options):
    """The command ``gapkeeper panel`` during a block; yields its address.

    It must not know that it is tested: NiceGUI would serve no page.
    """
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    process = subprocess.Popen(
        [sys.executable, "-m", "host.cli", "panel", "--listen", f"127.0.0.1:{port}", *options],
        env={name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")},
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    url = f"http://127.0.0.1:{port}/"
    try:
        _await_answer(process, url)
        yield url
    finally:
        process.send_signal(signal.SIGINT)
        try:
            said, _ = process.communicate(timeout=60)
        except subprocess.TimeoutExpired:
            process.kill()
            said, _ = process.communicate()
    assert "the panel is closed." in said, said
    assert "Traceback" not in said, said


def _await_answer(process, url):
    end = time.monotonic() + ANSWER_S
    while time.monotonic() < end:
        assert process.poll() is None, process.communicate()[0]
        try:
            with urllib.request.urlopen(url, timeout=5) as answer:
                assert answer.status == 200
                return
        except OSError:     # nobody listens yet, or is slow
            time.sleep(0.1)
    raise AssertionError("the panel serves no page")


@contextmanager
def browser(path):
    """Chromium without a window."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")     # of Playwright's own loop at its end
        from playwright.sync_api import expect, sync_playwright
        expect.set_options(timeout=DEADLINE_MS)
        with sync_playwright() as playwright:
            sandbox = [] if os.getuid() else ["--no-sandbox"]   # root has no sandbox
            opened = playwright.chromium.launch(executable_path=path, args=sandbox)
            try:
                yield opened
            finally:
                opened.close()


def element(page, name):
    """Element of a page by its name for tests."""
    return page.get_by_test_id(name)


def opened(chrome, url, complaints):
    """A page of the browser at an address; what is wrong with it goes into ``complaints``."""
    page = chrome.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(DEADLINE_MS)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: None if request.url.startswith((url, "data:", "blob:"))
            else complaints.append(f"asks the internet: {request.url}"))
    page.goto(url)
    return page


def first_picture_s(path):
    """Seconds from the command to the first picture of the panel in a browser that is open."""
    with browser(path) as chrome:
        from playwright.sync_api import expect
        began = time.monotonic()
        with served("--machine", "small") as url:
            expect(element(opened(chrome, url, []), "state")).to_be_visible()
            return time.monotonic() - began
