# SPDX-License-Identifier: Apache-2.0
"""The simulated flash memory for Python: in a station, or alone behind the firmware's own port."""

import ctypes

__all__ = ["ERASE_UNITS", "SECTOR", "Flash"]

SECTOR = 4096
ERASE_UNITS = 64    # of ``cut_after``; see testbench/plant/flash.hpp

_POINTER, _WORD, _UNSIGNED = ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint64
FUNCTIONS = {
    "flash_create": (_POINTER, [_UNSIGNED, ctypes.c_double]),
    "flash_free": (None, [_POINTER]),
    "flash_order": (ctypes.c_uint8, [_POINTER, _UNSIGNED, _WORD, ctypes.c_uint8]),
    "flash_read": (None, [_POINTER, _WORD, _UNSIGNED, ctypes.c_char_p]),
    "flash_write": (None, [_POINTER, _WORD, _UNSIGNED, ctypes.c_char_p]),
    "flash_cut": (None, [_POINTER, _UNSIGNED]),
    "flash_cut_after": (None, [_POINTER, ctypes.c_int64]),
    "flash_units": (_UNSIGNED, [_POINTER]),
    "flash_erasures": (_UNSIGNED, [_POINTER, _WORD]),
}


class Flash:
    """A flash memory: ``library`` has the functions of ``flash.cpp``, ``handle`` is its address."""

    def __init__(self, library: ctypes.CDLL, handle: int):
        for name, (result, arguments) in FUNCTIONS.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
        self.library = library
        self.handle = handle

    def read(self, address: int, size: int) -> bytes:
        """Bytes from ``address`` on."""
        data = ctypes.create_string_buffer(size)
        self.library.flash_read(self.handle, address, size, data)
        return data.raw

    def write(self, address: int, data: bytes) -> None:
        """Put bytes there at once, as a programmer for flash memories would."""
        self.library.flash_write(self.handle, address, len(data), data)

    def cut(self, clock: int) -> None:
        """Switch its power off and on in a clock; what is under way stays half done."""
        self.library.flash_cut(self.handle, clock)

    def cut_after(self, units: int) -> None:
        """Switch its power off after so many programmed bytes; an erase is ``ERASE_UNITS``."""
        self.library.flash_cut_after(self.handle, units)

    @property
    def units(self) -> int:
        """Programmed bytes so far, and ``ERASE_UNITS`` for every erase."""
        return self.library.flash_units(self.handle)

    def erasures(self, sector: int) -> int:
        """How often a sector was erased."""
        return self.library.flash_erasures(self.handle, sector)
