# SPDX-License-Identifier: Apache-2.0
"""The panel in a real browser: Chromium without a window, on a simulated machine.

Chromium is the system's. Without it these tests are left out and say so; with the variable
``GAPKEEPER_BROWSER=needed`` its absence is a failure, as in the continuous integration.
"""

import re
from dataclasses import dataclass

import pytest

from testbench.cosim.panel_browser import browser, chromium_path, element, opened, served
from testbench.installed import left_out

ORDERS = ("hold", "resume", "retract", "stop", "run", "arm")


@pytest.fixture(scope="module")
def chromium():
    """Path of the system's Chromium."""
    found = chromium_path()
    if found is None:
        left_out("the panel in a browser, as this computer has no Chromium", "chromium",
                 "GAPKEEPER_BROWSER")
    return found


def depth_of(page):
    """Z in the frame of the program, from the page."""
    shown = element(page, "place").locator(".work").nth(2).inner_text()
    return float(shown.replace("\N{MINUS SIGN}", "-"))


def at_rest(page):
    """Z in the frame of the program, once it stands: a held axis still comes to its command."""
    place = None
    for _ in range(60):
        before, place = place, depth_of(page)
        if place == before:
            return place
        page.wait_for_timeout(500)
    raise AssertionError("the axis does not come to rest")


@dataclass(frozen=True)
class Shown:
    """The panel of a small machine, and a browser that has met its first page."""

    url: str
    chrome: object
    complaints: list

    def open(self):
        """Open a further page, which adds its own complaints."""
        return opened(self.chrome, self.url, self.complaints)


@pytest.fixture(scope="module")
def shown(chromium):
    """One panel and one browser for all tests here: each takes ten seconds to start."""
    from playwright.sync_api import expect
    complaints = []
    with served("--machine", "small") as url, browser(chromium) as chrome:
        page = opened(chrome, url, complaints)
        expect(element(page, "state")).to_have_text("Idle")
        page.close()
        yield Shown(url, chrome, complaints)
    assert not complaints


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
    under_way = element(second, "tape").locator(".now")
    expect(under_way).to_contain_text("G01 Z-0.25")
    expect(under_way).to_be_in_viewport(ratio=0.9)

    element(page, "hold").click()
    expect(state).to_have_text("Hold:0")
    expect(element(second, "state")).to_have_text("Hold:0")
    place = at_rest(page)
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
    assert at_rest(page) == pytest.approx(place + 0.2, abs=1e-3)
    expect(element(second, "walk-place")).to_have_text(walks.inner_text())
    element(page, "walk-forward-0.1").click()
    expect(walks).to_contain_text(re.compile(r"0\.1\d+ mm before the front"))
    expect(state).to_have_text("Hold:0")
    place = at_rest(page)

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
