# SPDX-License-Identifier: Apache-2.0
"""Who may reach the panel, and its pictures."""

import asyncio
from urllib.parse import urlsplit
from xml.etree import ElementTree

import pytest

from host.errors import UserError
from host.panel import draw
from host.panel.gate import COOKIE, Gate, is_local
from host.panel.heard import CLASSES, Sample
from host.panel.outline import Outline, outline
from host.panel.panel import _introduction, panel

TOKEN = "a-token"
ALONE = [(b"content-security-policy", b"frame-ancestors 'none'"), (b"x-frame-options", b"DENY")]
SVG_LINES = "planned", "trail", "now"


# ---- the gate

def ask(gate, kind="http", query="", path="/x", **headers):
    """Send one request through a gate; return the messages that it answers."""
    said = []

    async def receive():
        return {"type": f"{kind}.connect"}

    async def send(message):
        said.append(message)

    scope = {"type": kind, "path": path, "query_string": query.encode(), "headers": [
        (name.encode(), value.encode()) for name, value in headers.items()]}
    asyncio.run(gate(scope, receive, send))
    return said


async def behind(scope, _receive, send):
    await send({"type": "came through", "path": scope["path"]})


def passes(gate, kind="http", query="", **headers):
    said = ask(gate, kind, query, **headers)
    if said[0]["type"] == "came through":
        return True
    refused = (said[0].get("status") == 403 if kind == "http"
               else said[0]["type"] == "websocket.close")
    assert refused
    return False


def framing_of(start):
    """Headers of an answer that tell who may frame it."""
    return sorted((name.lower(), value) for name, value in start["headers"]
                  if name.lower() in (b"x-frame-options", b"content-security-policy"))


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(("headers", "good"), [
    ({"host": "127.0.0.1:8080"}, True),
    ({"host": "localhost:8080"}, True),
    ({"host": "LOCALHOST"}, True),
    ({"host": "[::1]:8080"}, True),
    ({"host": "panel.example"}, True),
    ({"host": "127.0.0.1:8080", "origin": "http://127.0.0.1:8080"}, True),
    ({"host": "localhost.evil.example:8080"}, False),      # a name that is made to lead here
    ({"host": "evil.example"}, False),
    ({"host": "192.168.1.5:8080"}, False),
    ({"host": "["}, False),
    ({"host": ""}, False),
    ({}, False),
    ({"host": "127.0.0.1:8080", "origin": "http://evil.example"}, False),
    ({"host": "127.0.0.1:8080", "origin": "null"}, False),
    ({"host": "127.0.0.1:8080", "origin": "http://127.0.0.1:8081"}, False),
])
def test_only_this_computer_and_its_own_page_come_in(kind, headers, good):
    assert passes(Gate(behind, names=["Panel.example"]), kind, **headers) == good


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(("cookie", "good"), [
    (f"{COOKIE}={TOKEN}", True), (f"other=1; {COOKIE}={TOKEN}", True), (f"{COOKIE}=", False),
    (f"{COOKIE}={TOKEN}x", False), (f"other={TOKEN}", False), ("\"[", False), ("", False)])
def test_beyond_this_computer_a_token_is_always_needed(kind, cookie, good):
    gate = Gate(behind, token=TOKEN)
    for host in ("192.168.1.5:8080", "127.0.0.1:8080"):
        assert passes(gate, kind, host=host, cookie=cookie) == good
    assert not passes(gate, kind, host="evil.example", cookie=f"{COOKIE}={TOKEN}")
    assert not passes(gate, kind, host="192.168.1.5", origin="http://evil.example",
                      cookie=f"{COOKIE}={TOKEN}")


def test_the_token_goes_from_the_address_into_a_cookie():
    gate = Gate(behind, token=TOKEN)
    start, _ = ask(gate, query=f"token={TOKEN}", host="192.168.1.5:8080")
    headers = dict(start["headers"])
    assert (start["status"], headers[b"location"]) == (303, b"/x")
    cookie = headers[b"set-cookie"].decode()
    assert cookie.startswith(f"{COOKIE}={TOKEN}; ")
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert not passes(gate, query="token=wrong", host="192.168.1.5:8080")


@pytest.mark.parametrize(("path", "leads"), [
    ("/", b"/"), ("/x/y", b"/x/y"), ("//evil.example/", b"/evil.example/"),
    ("///evil.example", b"/evil.example"), ("/\\evil.example", b"/evil.example"),
    ("\\/evil.example", b"/evil.example"), ("/\t/evil.example", b"/%09/evil.example"),
    ("/\r\nX-A:b", b"/%0D%0AX-A%3Ab"), ("/ä x?y", b"/%C3%A4%20x%3Fy"), ("", b"/")])
def test_the_token_leads_to_a_place_of_this_panel_only(path, leads):
    start, _ = ask(Gate(behind, token=TOKEN), path=path, query=f"token={TOKEN}",
                   host="192.168.1.5:8080")
    assert dict(start["headers"])[b"location"] == leads


@pytest.mark.parametrize(("query", "host", "status"), [
    ("", "127.0.0.1:8080", 403), (f"token={TOKEN}", "127.0.0.1:8080", 303),
    ("", "evil.example", 403)])
def test_no_answer_of_the_gate_may_be_framed(query, host, status):
    """Another site could lay the panel invisibly under its own buttons."""
    start, _ = ask(Gate(behind, token=TOKEN), query=query, host=host)
    assert start["status"] == status
    assert framing_of(start) == ALONE


@pytest.mark.parametrize("own", [[], [(b"X-Frame-Options", b"SAMEORIGIN"), (b"x-other", b"1")]])
def test_no_page_behind_the_gate_may_be_framed(own):
    async def answers(_scope, _receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": own})
        await send({"type": "http.response.body", "body": b"page"})

    start, body = ask(Gate(answers), host="127.0.0.1:8080")
    assert framing_of(start) == ALONE
    assert (b"x-other", b"1") in start["headers"] or not own
    assert body["body"] == b"page"


def test_a_websocket_comes_through_the_gate_as_it_is():
    async def accepts(_scope, _receive, send):
        await send({"type": "websocket.accept"})

    assert ask(Gate(accepts), "websocket", host="127.0.0.1:8080") == [{"type": "websocket.accept"}]


def test_addresses_of_this_computer_alone_are_told_from_others():
    assert all(map(is_local, ("127.0.0.1", "127.3.2.1", "localhost", "::1")))
    assert not any(map(is_local, ("0.0.0.0", "::", "192.168.1.5", "a.example", "127.evil.example")))


def test_an_address_that_is_taken_is_told_in_one_sentence_before_anything_starts():
    import socket
    with socket.create_server(("127.0.0.1", 0)) as taken:
        at = f"127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(UserError, match=f"^{at} cannot be listened at: .*in use"):
            panel(machine="sinker", port=None, baud=1, clock_hz=None, seed=1, listen=at, names=[],
                  console=None)


@pytest.mark.parametrize(("port", "told"), [
    ("/dev/null", "/dev/null is no serial port"), ("/dev/nosuch", "there is no port /dev/nosuch"),
    ("http://x", '"http://x" names no port'), ("socket://", '"socket://" names no port'),
    ("socket://x", '"socket://x" names no port'), ("", '"" names no port')])
def test_a_name_that_is_no_port_is_told_before_anything_starts(port, told):
    with pytest.raises(UserError, match=f"^{told}"):
        panel(machine="sinker", port=port, baud=9600, clock_hz=None, seed=1,
              listen="127.0.0.1:0", names=[], console=None)


@pytest.mark.parametrize("everywhere", ["0.0.0.0", "::", "192.168.1.5", "shop-pc"])
def test_the_address_that_is_printed_leads_through_the_gate(everywhere):
    told = _introduction(everywhere, 8080, TOKEN, None)[0].removeprefix("panel: ")
    address = urlsplit(told)
    assert (address.port, address.query) == (8080, f"token={TOKEN}")
    assert address.hostname not in ("0.0.0.0", "::")
    start, _ = ask(Gate(behind, token=TOKEN, names=[everywhere]), query=address.query,
                   host=address.netloc)
    assert start["status"] == 303


# ---- the pictures

def parts_of(svg, name):
    """Elements of a picture by their class; fails if it is no XML."""
    return [one for one in ElementTree.fromstring(svg).iter() if one.get("class") == name]


def points_of(element):
    return [tuple(map(float, pair.split(","))) for pair in element.get("points").split()]


@pytest.mark.parametrize(("low", "high", "most"), [(0, 1, 5), (-0.3, 0.31, 4), (1000, 1001, 7),
                                                   (5, 5, 3), (-2e4, 3e5, 6)])
def test_ticks_are_round_and_few_and_within_the_ends(low, high, most):
    found = draw.ticks(low, high, most)
    assert len(found) <= most + 1
    assert all(low - 1e-9 <= value <= high + 1e-9 for value in found)
    assert high == low or found


def test_a_plan_shows_the_way_the_trail_and_the_place_to_one_scale():
    way = outline(["G90 G01 X2 Y0", "Y1", "X0", "Y0"])
    svg = draw.plan(way, [(0, 0, 0), (2, 0, 0), (2, 0.5, 0)], (2, 0.5, 0), 2)
    corners = points_of(parts_of(svg, "planned")[0])
    (x0, y0), (x1, _), (x2, y2) = corners[:3]
    assert x2 == x1 > x0
    assert y2 < y0      # Y is up
    assert (x1 - x0) / (y0 - y2) == pytest.approx(2, abs=0.01)
    assert points_of(parts_of(svg, "now")[0]) == corners[1:3]
    place = parts_of(svg, "place")[0]
    assert float(place.get("cx")) == pytest.approx(x1, abs=0.2)
    assert float(place.get("cy")) == pytest.approx((y0 + y2) / 2, abs=0.2)


def test_a_depth_shows_electrode_goal_and_cut():
    way = outline(["G90 G00 Z1", "G01 Z-1"])
    svg = draw.depth(way, [(0, 0, 1.0), (0, 0, -0.5)], (0, 0, -0.25))
    stock, cut = parts_of(svg, "stock")[0], parts_of(svg, "cut")[0]
    assert cut.get("y") == stock.get("y")
    top, deepest = float(cut.get("y")), float(cut.get("height"))
    goal = float(parts_of(svg, "goal")[0].get("y1"))
    assert goal - top == pytest.approx(2 * deepest, abs=0.2)
    tip = float(parts_of(svg, "electrode")[0].get("d").split("V")[1].split("H")[0])
    assert tip - top == pytest.approx(deepest / 2, abs=0.2)


def samples(**changed):
    values = {"volts": 40.0, "shares": (0.5, 0.25, 0.15, 0.1), "pulses": 100, "place": -0.1,
              "feed": 6.0, "motion": 0} | changed
    return [Sample(t=index / 8, **values) for index in range(400)]


def test_a_strip_shows_voltage_shares_and_retractions_of_half_a_minute():
    svg = draw.strip(samples(motion=2), wire=False)
    assert len(points_of(parts_of(svg, "volts")[0])) == 241
    moment = [float(parts_of(svg, f"class-{name}")[7].get("height")) for name in CLASSES]
    assert moment == pytest.approx([30, 15, 9, 6], abs=0.1)
    assert len(parts_of(svg, "back")) == 240
    assert not parts_of(draw.strip(samples(), wire=True), "back")
    assert not parts_of(draw.strip(samples(pulses=0), wire=True), "class-good")
    assert "does not tell it" in draw.strip(samples(volts=None), wire=False)


def test_pictures_of_nothing_can_be_drawn():
    for svg in (draw.plan(Outline(), [], (), 0), draw.depth(Outline(), [], ()),
                draw.strip([], wire=True)):
        assert ElementTree.fromstring(svg).tag == "svg"
