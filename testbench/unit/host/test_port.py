# SPDX-License-Identifier: Apache-2.0
"""Ports and the lines behind them: opening, loss, ports in use, clients turned away."""

import re
import socket
from contextlib import closing

import pytest

from host.errors import UsageError, UserError
from host.link.port import Port, PortError
from host.link.serve import PORT, UNREAD, Pty, Tcp, split_address


@pytest.mark.parametrize("baud", [99_999_999_999, -1])
def test_a_rate_that_no_port_has_is_one_sentence(baud):
    with closing(Pty(print)) as line, pytest.raises(UsageError, match=f"cannot carry {baud} bits"):
        Port(line.url, baud)


@pytest.mark.parametrize(("url", "kind", "message"), [
    ("/dev/ttyNONE", UsageError, "there is no port /dev/ttyNONE; serial ports of this computer: "),
    ("socket://127.0.0.1:1", PortError, "nobody listens at socket://127.0.0.1:1."),
    ("localhost:3333", UsageError, "there is no port localhost:3333; over TCP it is "
                                   "socket://localhost:3333."),
    ("socket://localhost", UsageError, '"socket://localhost" names no port: give a device such'),
    ("socket://localhost:99999", UsageError, '"socket://localhost:99999" names no port: give a'),
    ("telnet://localhost:23", UsageError, '"telnet://localhost:23" names no port: give a device'),
    ("", UsageError, '"" names no port: give a device such as /dev/ttyUSB0, or socket://HOST:P'),
    (__file__, UsageError, f"{__file__} is no serial port."),
])
def test_a_port_that_does_not_open_is_one_sentence(url, kind, message):
    with pytest.raises(kind, match=f"^{re.escape(message)}"):
        Port(url)


def test_a_port_in_use_is_named():
    line = Pty(lambda text: None)
    first = Port(line.url)
    with pytest.raises(PortError, match=rf"^{line.url} is in use by another program\.$"):
        Port(line.url)
    first.close()
    Port(line.url).close()
    line.close()


def test_what_came_before_a_connection_was_lost_is_read():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = Port(f"socket://127.0.0.1:{listener.getsockname()[1]}")
        other, _ = listener.accept()
        other.sendall(b"ok\n")
        other.close()
        assert port.read(1.0) == b"ok\n"
        with pytest.raises(PortError, match=r"^the connection over socket://\S+ is lost: "):
            port.read(1.0)
        port.close()


# ---- the other end

@pytest.mark.parametrize(("text", "expected"), [
    ("", ("127.0.0.1", PORT)), ("4000", ("127.0.0.1", 4000)), ("box", ("box", PORT)),
    ("box:7", ("box", 7)), ("socket://box:7", ("box", 7)), ("0.0.0.0:80", ("0.0.0.0", 80)),
    ("[::1]:9", ("::1", 9)),
])
def test_addresses(text, expected):
    assert split_address(text) == expected


@pytest.mark.parametrize("text", ["a:b", "box:99999", "a/b", "me@box:1", "99999", "http://box:1"])
def test_what_is_no_address_is_refused(text):
    with pytest.raises(UsageError, match=rf'^"{text}" is no address: give HOST:PORT, such as 127'):
        split_address(text)


def test_an_address_in_use_is_one_sentence():
    line = Tcp("127.0.0.1", 0, print)
    port = int(line.url.rpartition(":")[2])
    with pytest.raises(UserError, match=rf"^127\.0\.0\.1:{port} cannot be listened at: Address "
                                        r"already in use\.$"):
        Tcp("127.0.0.1", port, print)
    line.close()


def test_a_line_has_one_client_at_a_time():
    said = []
    line = Tcp("127.0.0.1", 0, said.append)
    first = Port(line.url)
    line.take(1)
    second = Port(line.url)
    while len(said) < 2:
        line.take(1)
    with pytest.raises(PortError, match="is lost"):
        second.read(1.0)
    first.close()
    while "gone" not in said[-1]:
        line.take(1)
    third = Port(line.url)
    line.take(1)
    line.give(b"here")
    assert third.read(1.0) == b"here"
    third.close()
    line.close()
    here = "a client is"
    assert said == [f"{here} connected.", f"{here} turned away: there is one already.",
                    "the client has gone.", f"{here} connected."]


def test_a_client_may_come_back_at_once():
    """The events that it goes and that it comes may be seen in either order."""
    said = []
    line = Tcp("127.0.0.1", 0, said.append)
    for number in range(20):
        port = Port(line.url)
        port.write(bytes([number]) * 100)
        came = b""
        while len(came) < 100:
            came += line.take(7)
        assert came == bytes([number]) * 100
        port.close()
    line.close()
    assert "turned away" not in " ".join(said)


def test_a_client_that_reads_nothing_is_let_go():
    said = []
    line = Tcp("127.0.0.1", 0, said.append)
    port = Port(line.url)
    line.take(1)
    for _ in range(100):
        line.give(bytes(UNREAD // 2))
        if len(said) > 1:
            break
    assert said[-1] == f"the client reads nothing: {UNREAD} bytes wait for it, and it is let go."
    port.close()
    line.close()


def test_a_pseudo_terminal_is_a_port_and_carries_every_byte():
    said = []
    line = Pty(said.append)
    line.give(b"to nobody")
    every = bytes(range(256))
    for _ in range(2):
        port = Port(line.url)
        assert line.take(1) == b""
        line.give(every)
        assert port.read(1.0) == every
        port.write(every)
        came = b""
        while len(came) < len(every):
            came += line.take(100)
        assert came == every
        port.close()
        assert line.take(1) == b""
    line.close()
    assert said == ["a client has opened it.", "the client has closed it."] * 2
