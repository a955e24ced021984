# SPDX-License-Identifier: Apache-2.0
"""The panel in a real browser: Chromium without a window, on a simulated machine.

Chromium is the system's. Without it these tests are left out and say so; with the variable
``GAPKEEPER_BROWSER=needed`` its absence is a failure, as in the continuous integration.
"""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
import warnings
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from host.places import ROOT
from testbench.installed import left_out

FIRST_S = 10.0      # from the command to the first picture, with all built
ANSWER_S = 240.0    # to the first answer, if the machine must be built
DEADLINE_MS = 240_000
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ORDERS = ("hold", "resume", "retract", "stop", "run", "arm")


@pytest.fixture(scope="module")
def chromium():
    """Path of the system's Chromium."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        left_out("the panel in a browser, as this computer has no Chromium", "chromium",
                 "GAPKEEPER_BROWSER")
    return found


@contextmanager
def served(*options):
    """The command ``gapkeeper panel`` during a block; yields its address and its process.

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
        yield url, process
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
    pytest.fail("the panel serves no page")


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


def cpu_s(process):
    """CPU seconds of a process so far."""
    text = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, text[11:13])) / os.sysconf("SC_CLK_TCK")


def element(page, name):
    return page.get_by_test_id(name)


def opened(chrome, url, complaints):
    page = chrome.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(DEADLINE_MS)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: None if request.url.startswith((url, "data:", "blob:"))
            else complaints.append(f"asks the internet: {request.url}"))
    page.goto(url)
    return page


def depth_of(page):
    """Z in the frame of the program, from the page."""
    shown = element(page, "place").locator(".work").nth(2).inner_text()
    return float(shown.replace("\N{MINUS SIGN}", "-"))


@dataclass(frozen=True)
class Shown:
    """The panel of a small machine, and a browser that has met its first page."""

    url: str
    chrome: object
    complaints: list
    wall_s: float       # from the command to the first picture
    work_s: float       # CPU seconds of the panel until then

    def open(self):
        """Open a further page, which adds its own complaints."""
        return opened(self.chrome, self.url, self.complaints)


@pytest.fixture(scope="module")
def shown(chromium):
    """One panel and one browser for all tests here: each takes ten seconds to start."""
    from playwright.sync_api import expect
    complaints, began = [], time.monotonic()
    with served("--machine", "small") as (url, process), browser(chromium) as chrome:
        page = opened(chrome, url, complaints)
        expect(element(page, "state")).to_be_visible()
        wall_s, work_s = time.monotonic() - began, cpu_s(process)
        expect(element(page, "state")).to_have_text("Idle")
        page.close()
        yield Shown(url, chrome, complaints, wall_s, work_s)
    assert not complaints


def test_the_first_picture_comes_soon(shown):
    print(f"first picture after {shown.wall_s:.1f} s, {shown.work_s:.1f} s of them at work")
    # Others may be at work on this computer.
    assert min(shown.wall_s, shown.work_s) < FIRST_S


def test_a_page_that_is_closed_lets_go_of_the_controls(shown):
    from playwright.sync_api import expect
    page, second = shown.open(), shown.open()
    expect(second.get_by_role("button", name="Take the controls")).to_be_enabled()
    page.get_by_text("Take the controls").click()
    expect(second.get_by_role("button", name="Take the controls")).to_be_disabled()
    page.close()
    second.get_by_text("Take the controls").click()
    expect(element(second, "hold")).to_be_enabled()
    second.close()


@pytest.mark.soak
def test_the_work_is_touched_and_the_gap_recorded_from_the_page(shown):
    from playwright.sync_api import expect
    page = shown.open()
    expect(element(page, "state")).to_have_text("Idle")
    page.get_by_role("tab", name="Touch").click()
    expect(element(page, "touch")).to_be_disabled()     # nobody has the controls
    page.get_by_role("tab", name="Gap").click()
    expect(element(page, "scope-single")).to_be_disabled()
    page.get_by_text("Take the controls").click()
    element(page, "scope-single").click()
    expect(element(page, "scope-state")).to_contain_text("Armed")
    page.get_by_role("tab", name="Touch").click()
    element(page, "touch").click()
    # The surface is 0.1 mm below; the offset of the contact is not calibrated.
    expect(page.get_by_text(re.compile(r"Edge found: Z -0\.(09[5-9]|10)"))).to_be_visible()
    page.get_by_role("tab", name="Gap").click()     # contact is a short: it has triggered
    expect(element(page, "scope-facts")).to_contain_text("number 1")
    expect(element(page, "scope-facts")).to_contain_text("sensed short")
    page.close()


@pytest.mark.soak
def test_the_drives_are_measured_from_the_page(shown):
    from playwright.sync_api import expect
    page = shown.open()
    expect(element(page, "state")).to_have_text("Idle")
    page.get_by_role("tab", name="Settings").click()
    page.get_by_text("Tune the position loops").click()
    expect(element(page, "tune")).to_be_disabled()      # nobody has the controls
    page.get_by_text("Take the controls").click()
    for axis in "XY":
        element(page, f"tune-{axis}").click()
        page.get_by_role("option", name=f"not {axis}").click()
    element(page, "tune").click()
    expect(element(page, "tune-told")).to_contain_text("Z: loop gain 50.0 1/s")
    expect(page.get_by_role("button", name="Enter $456=50")).to_be_enabled()
    expect(page.locator(".tune-picture svg")).to_be_visible()
    page.close()


def test_a_run_is_begun_held_resumed_retracted_and_ended_while_a_second_page_watches(shown):
    from playwright.sync_api import expect
    page = shown.open()
    state = element(page, "state")
    expect(state).to_have_text("Idle")
    second = shown.open()
    expect(element(second, "state")).to_have_text("Idle")
    for name in ORDERS:     # nobody has the controls
        expect(element(page, name)).to_be_disabled()
    page.get_by_text("Take the controls").click()
    for name in ORDERS:
        expect(element(page, name)).to_be_enabled()
        expect(element(second, name)).to_be_disabled()
    expect(second.get_by_text("another one holds the controls")).to_be_visible()
    expect(second.get_by_role("button", name="Take the controls")).to_be_disabled()

    element(page, "run").click()
    expect(page.locator(".q-notification")).to_contain_text("No tape is chosen.")
    element(page, "arm").click()
    expect(second.get_by_text("armed", exact=True)).to_be_visible()
    element(page, "choose").fill("sink_servo")
    page.get_by_role("option", name="sink_servo", exact=True).click()
    expect(element(second, "tape")).to_contain_text("SINK SERVO")
    element(page, "run").click()
    expect(state).to_have_text("Run")
    expect(element(second, "tape").locator(".now")).to_contain_text("G01 Z-0.25")

    element(page, "hold").click()
    expect(state).to_have_text("Hold:0")
    expect(element(second, "state")).to_have_text("Hold:0")
    place = depth_of(page)
    second.wait_for_timeout(1000)
    assert depth_of(second) == pytest.approx(place, abs=2e-4)

    # It walks back along the path and forward again; a step to the front is not offered.
    walks, back = element(page, "walk-place"), element(page, "walk-back-0.1")
    expect(walks).to_contain_text("On hold")
    expect(element(page, "walk-forward-0.1")).to_be_disabled()
    expect(element(second, "walk-back-0.1")).to_be_disabled()
    back.click()
    back.click()
    expect(walks).to_contain_text(re.compile(r"0\.2\d+ mm before the front"))
    expect(state).to_have_text("Hold:0")
    assert depth_of(page) == pytest.approx(place + 0.2, abs=1e-3)
    expect(element(second, "walk-place")).to_have_text(walks.inner_text())
    element(page, "walk-forward-0.1").click()
    expect(walks).to_contain_text(re.compile(r"0\.1\d+ mm before the front"))
    expect(state).to_have_text("Hold:0")
    place = depth_of(page)

    # A page that watches can touch nothing, even if its buttons are made to work.
    second.evaluate("""() => {
        jogStart("Z", 1);
        for (const button of document.querySelectorAll("button")) button.disabled = false;
    }""")
    element(second, "resume").dispatch_event("click")
    second.wait_for_timeout(1000)
    expect(state).to_have_text("Hold:0")
    assert depth_of(second) == pytest.approx(place, abs=2e-4)

    element(page, "resume").click()
    expect(state).to_have_text("Run")
    expect(element(page, "walk")).to_be_hidden()
    element(page, "retract").click()
    second.get_by_role("tab", name="Record").click()
    expect(element(second, "record")).to_contain_text("Retraction: the operator's order.")
    element(page, "stop").click()
    expect(state).to_have_text(re.compile("Alarm|Idle"))
    expect(element(second, "state")).to_have_text(re.compile("Alarm|Idle"))
    page.close()
    second.close()
