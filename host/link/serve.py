# SPDX-License-Identifier: Apache-2.0
"""The other end of a port, to which a client connects to reach a controller that runs here.

A line has one client at a time. Bytes that the controller sends while there is none are lost, as on
a cable without a computer. So are bytes beyond the ``UNREAD`` that a client leaves unread.
"""

import os
import select
import socket
import time
import tty
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol
from urllib.parse import urlsplit

from host.errors import UsageError, UserError

__all__ = ["PORT", "Line", "Pty", "Tcp", "split_address"]

HOST, PORT = "127.0.0.1", 3333
LOCAL = ("localhost", "127.", "::1")
UNREAD = 1 << 20    # bytes
GRACE_S = 0.5       # a new client may be the old one: that it has gone may be seen later

Say = Callable[[str], None]


class Line(Protocol):
    """One end of a line of bytes; a client may connect to the other and leave it."""

    url: str    # pyserial's name of the port that a client opens
    gone: int   # clients that have left so far

    def take(self, most: int) -> bytes:
        """Bytes that the client has sent, at most ``most``; returns at once, maybe empty."""

    def give(self, data: bytes) -> None:
        """Send to the client, if there is one; never waits."""

    def wait(self, timeout_s: float) -> None:
        """Return when a client connects or sends, at the latest after ``timeout_s``."""

    def close(self) -> None:
        """Let no client in any more."""


def split_address(address: str, usual: int = PORT) -> tuple[str, int]:
    """Host and port of ``HOST:PORT``, ``HOST``, ``PORT`` or nothing; missing parts are defaults.

    ``usual`` is the default of the port.

    ``socket://`` may stand before it, as in the URL by which clients connect.

    Raises
    ------
    UsageError
        If the text is no such address.
    """
    bare = address.removeprefix("socket://")
    try:
        parts = urlsplit(f"//:{bare}" if bare.isdecimal() else f"//{bare}")
        port = usual if parts.port is None else parts.port
    except ValueError as error:
        raise UsageError(f'"{address}" is no address: give HOST:PORT, such as {HOST}:{usual}.'
                         ) from error
    if parts.path or parts.query or parts.username:
        raise UsageError(f'"{address}" is no address: give HOST:PORT, such as {HOST}:{usual}.')
    return parts.hostname or HOST, port


class Tcp:
    """A line over TCP, at ``host`` and ``port``; port 0 takes any free one.

    ``local`` says whether only programs of this computer reach it. ``say`` gets a sentence for
    every client that comes, goes, or is turned away because there is one already.

    Raises
    ------
    UserError
        If the address cannot be listened at.
    """

    def __init__(self, host: str, port: int, say: Say) -> None:
        self.say = say
        self.gone = 0
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._listener = socket.create_server((host, port), family=family)
        except (OSError, OverflowError) as error:
            # Python adds to the system's words what it has been doing.
            why = (getattr(error, "strerror", None) or str(error)).partition(" (while ")[0]
            raise UserError(f"{host}:{port} cannot be listened at: {why}.") from error
        self._listener.setblocking(False)
        shown = f"[{host}]" if ":" in host else host
        self.url = f"socket://{shown}:{self._listener.getsockname()[1]}"
        self.local = host.startswith(LOCAL)
        self._client: socket.socket | None = None
        self._next: socket.socket | None = None     # a client that has come while there is one
        self._patience_s = 0.0                      # time until which it waits for that one to go
        self._unread = bytearray()

    def take(self, most: int) -> bytes:
        self._let_in()
        if self._client is None:
            return b""
        try:
            data = self._client.recv(most)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._drop("the client has gone.")
        return data

    def give(self, data: bytes) -> None:
        if self._client is None:
            return
        self._unread += data
        try:
            sent = self._client.send(self._unread)
        except BlockingIOError:
            sent = 0
        except OSError:
            self._drop("the client has gone.")
            return
        del self._unread[:sent]
        if len(self._unread) > UNREAD:
            self._drop(f"the client reads nothing: {UNREAD} bytes wait for it, and it is let go.")

    def wait(self, timeout_s: float) -> None:
        ends = [] if self._client is None else [self._client]
        ends += [] if self._next is not None else [self._listener]
        select.select(ends, [], [], timeout_s)

    def close(self) -> None:
        for one in (self._client, self._next, self._listener):
            if one is not None:
                one.close()

    def _let_in(self) -> None:
        if self._next is None:
            try:
                self._next, _ = self._listener.accept()
            except BlockingIOError:
                return
            self._next.setblocking(False)
            self._next.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._patience_s = time.monotonic() + GRACE_S
        if self._client is None:
            self._client, self._next = self._next, None
            self.say("a client is connected.")
        elif time.monotonic() > self._patience_s:
            self._next.close()
            self._next = None
            self.say("a client is turned away: there is one already.")

    def _drop(self, why: str) -> None:
        if self._client is not None:
            self._client.close()
        self._client = None
        self._unread.clear()
        self.gone += 1
        self.say(why)


class Pty:
    """A line over a pseudo-terminal, which clients use as a serial port.

    Raises
    ------
    UserError
        If the computer has no free pseudo-terminal.
    """

    local = True

    def __init__(self, say: Say) -> None:
        self.say = say
        self.gone = 0
        try:
            self._master, client = os.openpty()
        except OSError as error:
            raise UserError(f"there is no pseudo-terminal to be had: {error.strerror}.") from error
        tty.setraw(client)
        self.url = os.ttyname(client)
        os.close(client)    # from here on the master end hears whether a client has it open
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)
        self._open = False

    def take(self, most: int) -> bytes:
        try:
            data = os.read(self._master, most)
        except BlockingIOError:     # opened, and nothing has come
            self._is_open(True)
            return b""
        except OSError:             # nobody has it open
            self._is_open(False)
            return b""
        self._is_open(True)
        return data

    def give(self, data: bytes) -> None:
        if self._open:
            with suppress(OSError):     # full: nobody reads
                os.write(self._master, data)

    def wait(self, timeout_s: float) -> None:
        # Without a client the terminal counts as hung up, which ends every wait at once.
        if self._open:
            self._poll.poll(timeout_s * 1000)
        else:
            select.select([], [], [], timeout_s)

    def close(self) -> None:
        os.close(self._master)

    def _is_open(self, now: bool) -> None:
        if now != self._open:
            self.gone += not now
            self.say("a client has opened it." if now else "the client has closed it.")
        self._open = now
