# SPDX-License-Identifier: Apache-2.0
"""A client that does anything, on the live simulated machine and on its firmware alone."""

import pytest

from host.machines import machine as machines
from host.run import simulation
from testbench.piped import Machinery
from testbench.stray import Stray, StrayedError

SINKER = machines.load("sinker")
TREMBLE = 3     # pulses, of an axis at rest


@pytest.fixture
def seed(request):
    return request.config.getoption("seed")


def roam(stray, actions):
    try:
        while stray.actions < actions:
            stray.act()
        stray.settle()
    finally:
        stray.close()
    print(f"{stray.actions} actions: {stray.lines} lines, {stray.answers} answers, {stray.moves} "
          f"motions asked for, {stray.resets} resets, {stray.visits} connections, "
          f"{stray.jogs} jogs, {stray.ended} times ended on the way")
    assert stray.answers > actions / 2
    assert stray.moves > actions / 10
    assert stray.visits > actions / 50
    assert stray.jogs > actions / 20


def on_the_firmware(seed, actions):
    print(f"seed {seed}")
    roam(Stray(Machinery(pulses_per_pass=50), seed), actions)   # F600


def on_the_machine(seed, actions):
    print(f"seed {seed}")
    machine = simulation.start(SINKER, clock_hz=SINKER.clock_hz, seed=seed, waves=None,
                               trace=False, progress=print)
    try:
        roam(Stray(machine, seed, tremble=TREMBLE), actions)
    finally:
        machine.close()


def test_a_random_client_on_the_firmware(seed):
    on_the_firmware(seed, 2000)


@pytest.mark.soak
def test_a_random_client_on_the_machine(seed):
    on_the_machine(seed, 50)


@pytest.mark.soak
def test_a_random_client_on_the_firmware_for_long(seed):
    on_the_firmware(seed, 1_000_000)


@pytest.mark.soak
def test_a_random_client_on_the_machine_for_long(seed):
    on_the_machine(seed, 10_000)


class Doubtful(Machinery):
    """A machine that sometimes breaks a rule."""

    def __init__(self, fault):
        super().__init__()
        self.fault, self.said = fault, 0

    def read(self, timeout_s):
        data = super().read(timeout_s)
        if self.fault == "answers twice":
            return data.replace(b"ok\r\n", b"ok\r\nok\r\n") if self.time_s() > 1 else data
        if self.fault == "answers not":
            return b"" if data == b"ok\r\n" and self.time_s() > 1 else data
        return data

    def positions(self):
        drift = self.fault == "moves" and self.time_s() > 1
        return {axis: at + drift for axis, at in super().positions().items()}

    def discharges(self):
        burnt = self.fault == "burns" and self.time_s() > 1
        return super().discharges() | {"ok": int(burnt)}


@pytest.mark.parametrize(("fault", "said"), [
    ("answers twice", "answers no line"), ("answers not", "does not come"),
    ("moves", "the axes rest at"), ("burns", "it discharges"),
])
def test_what_must_not_be_is_seen(seed, fault, said):
    stray = Stray(Doubtful(fault), seed)
    with pytest.raises(StrayedError, match=said):
        roam(stray, 2000)
