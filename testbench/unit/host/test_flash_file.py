# SPDX-License-Identifier: Apache-2.0
"""The file of a simulated flash memory: read at power-on, written at power-off."""

import pytest

from host.errors import UsageError, UserError
from host.machines import machine as machines
from host.run import simulation
from softcore.top import SIMULATED_JOURNAL

CONTENTS = bytes(range(256)) * (SIMULATED_JOURNAL.size // 256)


class Native:
    """A native simulation that only has a flash memory."""

    clock_hz, byte_clocks = 2_000_000, 80

    def __init__(self, flash):
        self.held = flash
        self.closed = False

    def power_off(self):
        """Its memory, with a byte changed."""
        return b"\0" + CONTENTS[1:]

    def close(self):
        """Note it."""
        self.closed = True


@pytest.fixture
def started(monkeypatch):
    made = []

    def start(flash):
        monkeypatch.setattr(simulation.door, "start",
                            lambda **options: made.append(Native(options["flash"])) or made[-1])
        on = simulation.start(machines.load("sinker"), clock_hz=2_000_000, seed=1, waves=None,
                              progress=lambda _: None, flash=flash)
        return on, made[-1]

    return start


def test_the_memory_is_kept_in_the_file(started, workdir):
    path = workdir / "kept.flash"
    path.unlink(missing_ok=True)
    on, native = started(path)
    assert native.held is None, "a fresh memory"
    on.close()
    assert native.closed
    assert path.read_bytes() == b"\0" + CONTENTS[1:]
    on, native = started(path)
    assert native.held == b"\0" + CONTENTS[1:]
    on.close()


def test_without_a_file_the_memory_is_fresh_and_forgotten(started):
    on, native = started(None)
    assert native.held is None
    on.close()
    assert native.closed


def test_a_file_of_another_length_is_refused_and_stays(started, workdir):
    path = workdir / "short.flash"
    path.write_bytes(b"mine")
    with pytest.raises(UsageError, match=r"short.flash is not what a flash memory holds: it has 4 "
                                         r"bytes, not 65536 or whole sectors more\."):
        started(path)
    assert path.read_bytes() == b"mine"


def test_a_file_that_cannot_be_written_is_told(started, workdir):
    on, native = started(workdir / "nowhere" / "kept.flash")
    with pytest.raises(UserError, match="what the flash memory holds cannot be written"):
        on.close()
    assert native.closed
