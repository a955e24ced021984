# SPDX-License-Identifier: Apache-2.0
"""``gapkeeper panel``: the operator's page, on a simulated machine or a controller at a port."""

import secrets
import socket
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from rich.console import Console

from host.errors import UsageError, UserError
from host.link.port import Port, PortError, check_name
from host.link.serve import split_address
from host.machines import machine as machines
from host.panel.gate import Gate, is_local
from host.panel.session import Session
from host.panel.wires import Bench, Remote, Wire
from host.places import ROOT

__all__ = ["PORT", "panel"]

PORT = 8080
TAPES = ROOT / "tapes"


def panel(*, machine: str, port: str | None, baud: int, clock_hz: int | None, seed: int,
          listen: str, names: Sequence[str], console: Console, flash: Path | None = None) -> None:
    """Serve the page until Ctrl-C."""
    try:
        from nicegui import app, ui

        from host.panel.page import build
    except ImportError as error:
        raise UsageError("the panel needs NiceGUI, which is not installed: run make install, or "
                         f'.venv/bin/python -m pip install -e ".[panel]" ({error}).') from error

    def say(text: str) -> None:
        console.print(text, soft_wrap=True, markup=False)

    chosen = machines.load(machine)
    host, at = split_address(listen, PORT)
    _free(host, at)
    if port is not None:
        _require_port(port, baud)
    token = "" if is_local(host) else secrets.token_urlsafe(16)
    clock_hz = clock_hz or chosen.clock_hz

    def connect(tell: Callable[[str], None]) -> Wire:
        if port is not None:
            return Remote(port, chosen, baud=baud, clock_hz=clock_hz, say=tell)
        return Bench(chosen, clock_hz=clock_hz, seed=seed, say=tell, flash=flash)

    session = Session(chosen, connect)
    build(session, sorted(TAPES.glob("*.nc")))
    app.add_middleware(Gate, token=token, names=[*names, host])
    for text in _introduction(host, at, token, port):
        say(text)

    def end() -> None:      # here, as the server ends the program by the signal that it got
        session.close()
        say("the panel is closed.")

    app.on_shutdown(end)
    session.start()
    ui.run(host=host, port=at, title="Gapkeeper", show=False, reload=False, dark=None,
           show_welcome_message=False)


def _free(host: str, port: int) -> None:
    """Refuse an address that cannot be listened at, before a machine is switched on."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        socket.create_server((host, port), family=family).close()
    except (OSError, OverflowError) as error:
        why = (getattr(error, "strerror", None) or str(error)).partition(" (while ")[0]
        raise UserError(f"{host}:{port} cannot be listened at: {why}.") from error


def _require_port(port: str, baud: int) -> None:
    """Refuse a name that is no port here. One that is only silent or in use may be so later."""
    check_name(port)
    if "://" not in port:
        with suppress(PortError):
            Port(port, baud).close()


def _address(everywhere: str) -> str:
    """Return this computer's address as others see it, or its name if it is in no network.

    A tablet finds the address; the name only if the network knows it.
    """
    family, outside = ((socket.AF_INET6, "2001:db8::1") if ":" in everywhere
                       else (socket.AF_INET, "192.0.2.1"))    # reserved for documentation
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((outside, 9))     # sends nothing: it chooses the way out
        except OSError:
            return socket.gethostname()
        return str(probe.getsockname()[0])


def _introduction(host: str, at: int, token: str, port: str | None) -> list[str]:
    shown = _address(host) if host in ("0.0.0.0", "::") else host
    shown = f"[{shown}]" if ":" in shown else shown
    behind = f"/?token={token}" if token else "/"
    told = [f"panel: http://{shown}:{at}{behind}"]
    if token:
        told.append("Whoever reaches this computer and has this address, with its token, can move "
                    "the machine. If others know this computer by another name, give it by --name.")
    else:
        told.append("Only programs on this computer can connect.")
    told.append("The machine is simulated." if port is None else f"The controller is at {port}.")
    told.append("Ctrl-C closes it: the machine is held, and the controller reset.")
    return told

