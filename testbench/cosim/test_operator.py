# SPDX-License-Identifier: Apache-2.0
"""An operator who does anything at any time: no move that was not asked for, and no hang."""

import random

import pytest

from host.link.link import RESUME
from host.machines import machine as machines
from testbench.cosim.job import MM
from testbench.cosim.operator import JOG_CANCEL, FaultError, Operator, operate
from testbench.native.simulation import Simulation

MACHINE = machines.load("sinker")
PARTS, ACTS = 20, 500       # of the soak: 10 000 acts
LIVELY = ("jog", "line", "tape", "hold", "resume", "reset", "pull", "estop", "walk")


def operated(seed, acts):
    """A machine of its own, and what was done to it."""
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        return operate(session, seed, acts)


def test_a_few_dozen_acts():
    done = operated(2, 60)
    assert set(LIVELY) <= set(done), done
    assert done["pulses"] > 10_000


# ---- the model sees what must not be: something moves, or does not, behind its back

@pytest.fixture
def operator():
    with Simulation(machine=MACHINE.tables, clock_hz=MACHINE.clock_hz, seed=1,
                    trace=False) as session:
        yield Operator(session, random.Random(1))


def further(operator):
    """A jog of twice the way that the model takes it for."""
    operator._send("$J=G91 X1 F1500", [MM // 2, 0, 0])


def beyond(operator):
    """A jog to where a soft limit should have been."""
    operator.limit = 0.5
    operator._send("$J=G91 X1 F1500", [MM, 0, 0])


def unheard(operator):
    """A reset that does not reach the machine."""
    operator._send("$J=G91 X1 F60", [MM, 0, 0])
    operator.pass_time(0.1)
    operator._was_reset()


def unnoticed(operator):
    """A hold that ends by itself."""
    operator._send("G91 G01 X1 F60", [MM, 0, 0])
    operator.pass_time(0.1)
    operator._hold()
    operator.pass_time(0.3)
    assert operator.held
    operator.link.send_line(RESUME)


def disobeyed(operator):
    """A hold that does not reach the machine."""
    operator._send("G91 G01 X1 F60", [MM, 0, 0])
    operator.pass_time(0.1)
    operator.link.press = lambda byte: None
    operator._hold()


def deaf(operator):
    """A cancel of a jog that does not reach the machine."""
    operator._send("$J=G91 X1 F60", [MM, 0, 0])
    operator.pass_time(0.1)
    operator.rng.random = lambda: 1.0       # no jog besides
    send = operator.link.realtime
    operator.link.realtime = lambda byte: None if byte == JOG_CANCEL else send(byte)
    operator._cancel()


def astray(operator):
    """A walk that nobody ordered."""
    operator._send("G91 G01 X0.2 F1000", [MM // 5, 0, 0])
    operator.pass_time(2)
    assert not operator.orders
    operator._hold()
    operator.pass_time(0.3)
    operator.held = None
    operator.link.send_line("$WALK=0.1")


def displaced(operator):
    """A machine that stands elsewhere than the controller says."""
    operator.session.get = lambda name: 3.0


def dead(operator):
    """An emergency stop that is not let go."""
    operator.session.set("force.estop", 1)
    operator.recover()


@pytest.mark.parametrize(("kind", "deed"), [
    ("unasked", further), ("unasked", astray), ("limit", beyond), ("reset", unheard),
    ("held", unnoticed), ("stop", disobeyed), ("stop", deaf), ("place", displaced),
    ("stuck", dead)])
def test_the_model_sees(operator, kind, deed):
    def and_then(seconds):      # it shows at once, or later
        deed(operator)
        operator.pass_time(seconds)

    with pytest.raises(FaultError) as told:
        and_then(1)
    assert told.value.kind == kind


@pytest.mark.soak
@pytest.mark.parametrize("part", range(PARTS))
def test_thousands_of_acts(rng, part):
    seed = rng.getrandbits(32) + part
    done = operated(seed, ACTS)
    print(part, seed, done)
    assert set(LIVELY) <= set(done), done
    assert done["walked"]
    assert done["cancelled"]
