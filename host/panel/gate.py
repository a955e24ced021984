# SPDX-License-Identifier: Apache-2.0
"""Who may reach the panel: checks of Host, Origin and token before anything is answered.

A page of another site may make a browser send requests here, and a name of another site may be made
to lead here. So the Host must be this computer, and the Origin, if one is sent, must be the panel
itself. Beyond this computer a token is needed too: the first request has it behind ``?token=``, and
a cookie has it from then on. No page may frame the panel: else one of another site could lay it
invisibly under its own buttons.
"""

import hmac
import ipaddress
import socket
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

__all__ = ["COOKIE", "Gate", "is_local"]

COOKIE = "gapkeeper_panel"
_FRAME = b"x-frame-options"
_ALONE = ((_FRAME, b"DENY"), (b"content-security-policy", b"frame-ancestors 'none'"))
_LOCAL = ("localhost", "127.0.0.1", "::1")

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]


def is_local(host: str) -> bool:
    """Whether only programs of this computer reach an address."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _host_of(address: str) -> str | None:
    """The host of ``HOST:PORT``; None if it is no address."""
    try:
        return urlsplit(f"//{address}").hostname
    except ValueError:
        return None


class Gate:
    """An ASGI application in front of another one; it refuses what must not come in.

    Every answer tells the browser that nobody may frame it.

    Parameters
    ----------
    app : callable
        The application behind.
    token : str
        What a request must know; empty if this computer alone reaches the panel.
    names : iterable of str
        Names of this computer by which it may be called beside its addresses.
    """

    def __init__(self, app: App, *, token: str = "", names: Iterable[str] = ()) -> None:
        self.app, self.token = app, token
        own = socket.gethostname().lower()
        self.names = {*_LOCAL, *(name.lower() for name in names)} | (
            {own, f"{own}.local"} if token else set())

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        send = _alone(send)
        headers = {name.decode("latin-1").lower(): value.decode("latin-1")
                   for name, value in scope["headers"]}
        query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
        if why := self.refusal(headers, query.get("token", [""])[0]):
            await self._refuse(scope, receive, send, why)
            return
        if self.token and scope["type"] == "http" and "token" in query:
            await self._enter(scope, send)
            return
        await self.app(scope, receive, send)

    def refusal(self, headers: dict[str, str], token: str) -> str:
        """Why a request with these headers (small letters) is refused, or nothing."""
        host = headers.get("host", "")
        if not self._own(host):
            return "The panel is not called by this name."
        origin = headers.get("origin")
        if origin is not None and origin not in (f"http://{host}", f"https://{host}"):
            return "The request comes from a page of another site."
        if self.token and not (self._knows(token) or self._knows(_cookie(headers))):
            return "The panel needs its token: open the address that gapkeeper panel has printed."
        return ""

    def _own(self, host: str) -> bool:
        name = _host_of(host)
        if name is None or name in self.names:
            return name is not None
        try:    # nobody can make an address lead elsewhere, but only the token makes it enough
            address = ipaddress.ip_address(name)
        except ValueError:
            return False
        return address.is_loopback or bool(self.token)

    def _knows(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self.token.encode())

    async def _enter(self, scope: Message, send: Send) -> None:
        """Put the token into a cookie, and out of the address, which stays one of this panel."""
        place = "/" + quote(scope["path"].lstrip("/\\"))    # `//name/` would be another computer
        cookie = f"{COOKIE}={self.token}; Path=/; HttpOnly; SameSite=Strict"
        await send({"type": "http.response.start", "status": 303, "headers": [
            (b"location", place.encode()), (b"set-cookie", cookie.encode())]})
        await send({"type": "http.response.body", "body": b""})

    @staticmethod
    async def _refuse(scope: Message, receive: Receive, send: Send, why: str) -> None:
        if scope["type"] == "websocket":
            await receive()     # the connection's first message
            await send({"type": "websocket.close", "code": 1008, "reason": why})
            return
        await send({"type": "http.response.start", "status": 403,
                    "headers": [(b"content-type", b"text/plain; charset=utf-8")]})
        await send({"type": "http.response.body", "body": f"{why}\n".encode()})


def _alone(send: Send) -> Send:
    """Answers with the headers that forbid a frame around them."""
    async def sends(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = [one for one in message.get("headers", ()) if one[0].lower() != _FRAME]
            message = {**message, "headers": [*headers, *_ALONE]}   # policies add up
        await send(message)

    return sends


def _cookie(headers: dict[str, str]) -> str:
    """The token that a browser has kept."""
    try:
        found = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return found.value if found else ""
