# SPDX-License-Identifier: Apache-2.0
"""A port as a pipe of bytes: a serial line, a socket, a pseudo-terminal; anything pyserial opens.

Ports have pyserial's names: a device (``/dev/ttyUSB0``), ``socket://HOST:PORT``,
``rfc2217://HOST:PORT``. Every failure is one sentence that names the port.
"""

import errno
import re
import socket
import time
from contextlib import suppress
from urllib.parse import urlsplit

import serial
from serial.tools import list_ports

from host.errors import UsageError
from host.link.link import LinkError

__all__ = ["BAUD", "Port", "PortError", "check_name"]

_ADDRESS = re.compile(r"[\w.-]+:\d+")    # of a computer and a port of it
SCHEMES = ("socket", "rfc2217")
BAUD = 1_000_000    # of a board; a socket has none
STEP_S = 0.01       # longest sleep of a call between two looks at the clock
WRITE_S = 5.0       # longest time for which the port may take no byte


class PortError(LinkError):
    """A port cannot be opened, or the connection over it is lost."""


class Port:
    """An open port, for ``host.link.Link``. Its time is the computer's.

    Parameters
    ----------
    url : str
        Device or pyserial URL.
    baud : int
        Bits a second, of a serial line.

    Raises
    ------
    UsageError
        If the name cannot be that of a port, there is no such port, or it has no such rate.
    PortError
        If the port cannot be opened. ``read`` and ``write`` raise it when the connection is lost.
    """

    def __init__(self, url: str, baud: int = BAUD) -> None:
        self.url = url
        self._lost = False
        check_name(url)
        try:
            self._serial = serial.serial_for_url(
                url, baudrate=baud, timeout=STEP_S, exclusive=True,
                write_timeout=None if url.startswith("rfc2217:") else WRITE_S)  # it has none
        except (serial.SerialException, OSError) as error:
            raise _cannot_open(url, error) from error
        except (OverflowError, ValueError) as error:
            raise UsageError(f"{url} cannot carry {baud} bits a second.") from error

    def write(self, data: bytes) -> None:
        """Send all of ``data``."""
        try:
            self._serial.write(data)
        except serial.SerialTimeoutException as error:
            raise PortError(f"{self.url} has taken nothing for {WRITE_S:g} s.") from error
        except (serial.SerialException, OSError) as error:
            raise self._gone() from error

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that have come; wait at most ``timeout_s`` for one."""
        if self._lost:
            raise self._gone()
        end = self.time_s() + timeout_s
        data = bytearray()
        try:
            while not data:
                data += self._serial.read(1)
                if self.time_s() >= end:
                    break
            while waiting := self._serial.in_waiting:
                data += self._serial.read(waiting)
        except (serial.SerialException, OSError) as error:
            self._lost = True   # told by the next call: what came before is read
            if not data:
                raise self._gone() from error
        return bytes(data)

    def time_s(self) -> float:
        """Seconds of the computer's clock."""
        return time.monotonic()

    def close(self) -> None:
        """Close the port."""
        # pyserial 3.5 forgets to close a socket that the other end has cut off.
        cut_off = getattr(self._serial, "_socket", None)
        with suppress(serial.SerialException, OSError):
            self._serial.flush()
            self._serial.close()
        if cut_off is not None:
            cut_off.close()

    def _gone(self) -> PortError:
        return PortError(f"the connection over {self.url} is lost: the other end has closed it, or "
                         "the cable is off.")


def check_name(url: str) -> None:
    """Refuse a name that cannot be that of a port; nothing is opened.

    Raises
    ------
    UsageError
        If it is no device, and no URL with all parts that it needs.
    """
    if not _well_formed(url):
        raise UsageError(f'"{url}" names no port: give a device such as /dev/ttyUSB0, or '
                         "socket://HOST:PORT.")


def _well_formed(url: str) -> bool:
    """Whether a name can be that of a port: a device, or a URL with all parts that it needs."""
    if "://" not in url:
        return bool(url)
    try:
        parts = urlsplit(url)
        return parts.scheme in SCHEMES and bool(parts.hostname and parts.port)
    except ValueError:  # of a number that is none of a port
        return False


def _cannot_open(url: str, error: Exception) -> Exception:
    """The sentence on a port that does not open."""
    cause: BaseException | None = error
    number = None
    while cause is not None and not isinstance(number, int):
        if isinstance(cause, socket.gaierror):
            return PortError(f"there is no computer of the name in {url}.")
        number = getattr(cause, "errno", None) or next(iter(cause.args), None)
        cause = cause.__cause__ or cause.__context__
    if number in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        if _ADDRESS.fullmatch(url):
            return UsageError(f"there is no port {url}; over TCP it is socket://{url}.")
        known = ", ".join(sorted(port.device for port in list_ports.comports())) or "none"
        return UsageError(f"there is no port {url}; serial ports of this computer: {known}.")
    if number in (errno.EAGAIN, errno.EBUSY):
        return PortError(f"{url} is in use by another program.")
    if number == errno.EACCES:
        return PortError(f"{url} may not be opened by this user; on Linux, members of its group "
                         "(dialout) may.")
    if number == errno.ECONNREFUSED:
        return PortError(f"nobody listens at {url}.")
    if number in (errno.ENOTTY, errno.EINVAL, errno.EISDIR):
        return UsageError(f"{url} is no serial port.")
    if "timed out" in str(error) or number == errno.ETIMEDOUT:
        return PortError(f"nobody answers at {url}.")
    return PortError(f"{url} cannot be opened: {error}.")
