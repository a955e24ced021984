# SPDX-License-Identifier: Apache-2.0
"""Cost of a step of the environment over the same clocks of the native simulation.

Two environments begin in the same state. One is stepped. The simulation of the other gets the same
bytes in the same clocks, but is run by the native library alone. They take turns, step by step, so
that other programs on the computer slow both.
"""

import time
from dataclasses import dataclass

from host.study.environment import STEP_S, Sinking

__all__ = ["Cost", "policy", "step_cost"]

OPEN, OK, DAME, SHORT = range(4)    # places in the observation


@dataclass(frozen=True)
class Cost:
    """CPU seconds of some steps, by the environment and natively, and the end of both runs.

    ``ends`` has clock, positions and discharges of each.
    """

    environment_s: float
    native_s: float
    ends: tuple[tuple, tuple]


def policy(observation):
    """An agent like a gap servo: forward while pulses are open, back from arcs and shorts."""
    fired = observation[OK] + observation[DAME] + observation[SHORT]
    if observation[OPEN] > 0.3 * (observation[OPEN] + fired):
        return [0.4, -1]
    return [-0.4 if observation[DAME] + observation[SHORT] > 20 else 0, -1]


def _written(pipe):
    """Record the bytes written to a simulation from now on: a list of clock and bytes."""
    kept, inner = [], pipe.write

    def write(data):
        kept.append((pipe.cycle, data))
        inner(data)

    pipe.write = write
    return kept


def _end(native):
    return native.cycle, native.positions(), native.discharges()


def step_cost(steps: int, seed: int = 1) -> Cost:
    """Step one environment, and run a twin of its machine natively; see the module."""
    one, other = Sinking(), Sinking()
    try:
        observation, _ = one.reset(seed=seed)
        other.reset(seed=seed)
        written = _written(one.bench._simulation)
        native = other.bench._simulation._native
        clocks = round(STEP_S * native.clock_hz)
        environment_s = native_s = 0.0
        for _ in range(steps):
            written.clear()
            began = time.process_time()
            observation, *_ = one.step(policy(observation))
            environment_s += time.process_time() - began
            began, end = time.process_time(), native.cycle + clocks
            for clock, data in written:
                native.run(clock - native.cycle)
                native.send(data)
            native.run(end - native.cycle)
            native.received()
            native_s += time.process_time() - began
        return Cost(environment_s, native_s,
                    (_end(one.bench._simulation._native), _end(native)))
    finally:
        one.close()
        other.close()
