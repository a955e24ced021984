# SPDX-License-Identifier: Apache-2.0
"""An operator who does anything at any time: no move that was not asked for, and no hang."""

import pytest

from host.machines import machine as machines
from testbench.cosim.operator import FaultError, Operator, operate
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
PARTS, ACTS = 20, 500       # of the soak: 10 000 acts
LIVELY = ("jog", "line", "tape", "hold", "resume", "reset", "pull", "estop")


def operated(seed, acts):
    """A machine of its own, and what was done to it."""
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        return operate(session, seed, acts)


def test_a_few_dozen_acts():
    done = operated(2, 40)
    assert all(done[act] for act in LIVELY), done
    assert done["pulses"] > 10_000


def shorter(monkeypatch):
    """Orders that the model takes for half as long."""
    send = Operator._send
    monkeypatch.setattr(Operator, "_send", lambda self, line, *moves: send(
        self, line, *([pulses // 2 for pulses in move] for move in moves)))


def unheard(monkeypatch):
    """Resets that do not reach the machine."""
    monkeypatch.setattr(Operator, "_reset", lambda self: self._was_reset())


def unnoticed(monkeypatch):
    """Orders to go on that the model does not know."""
    monkeypatch.setattr(Operator, "_resume", lambda self: self.link.send_line("$RESUME"))


@pytest.mark.parametrize(("kind", "change", "seed"), [
    ("unasked", shorter, 1), ("reset", unheard, 1), ("held", unnoticed, 1)])
def test_the_model_sees(monkeypatch, kind, change, seed):
    change(monkeypatch)
    with pytest.raises(FaultError) as told:
        operated(seed, 200)
    assert told.value.kind == kind


@pytest.mark.soak
@pytest.mark.parametrize("part", range(PARTS))
def test_thousands_of_acts(rng, part):
    seed = rng.getrandbits(32) + part
    done = operated(seed, ACTS)
    print(part, seed, done)
    assert all(done[act] for act in LIVELY), done
