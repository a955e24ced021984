# SPDX-License-Identifier: Apache-2.0
"""An examination by ``gapkeeper doctor`` of the simulated machine, with a person who answers."""

import time
from dataclasses import dataclass

from host.doctor.complaints import place
from host.doctor.doctor import Doctor
from host.link.port import Port
from host.link.serve import Tcp
from host.machines import machine as machines
from host.run import simulation
from softcore.build import BOARDS
from testbench.live import Client, serving

__all__ = ["AXES", "BOOTED_S", "GUARDS", "Examined", "examined", "of"]

AXES = "XYZ"
BOOTED_S = 0.3
GUARDS = ["estop", "fluid_low", *(f"{name}[{axis}]" for name in (
    "limit_low", "limit_high", "drive_fault") for axis in range(3))]
PRESSED_S = 0.2     # a person holds a guard open for so long


class Wire(Tcp):
    """A line over TCP at which ``meddle`` sees the bytes to the controller, and may change them.

    It is called with them, from the thread of the machine.
    """

    def __init__(self, meddle):
        super().__init__("127.0.0.1", 0, print)
        self.meddle = meddle

    def take(self, most):
        return self.meddle(super().take(most))


@dataclass
class Examined:
    """What an examination found, and how it left the machine."""

    findings: list
    report: str
    asked: list
    ended: str          # name of the exception that ended it, or nothing
    armed: bool         # the contactor is closed
    status: str         # the controller's last report

    @property
    def wrong(self):
        return [str(one) for one in self.findings if one.ok is False]

    @property
    def named(self):
        """Wires that findings accuse, with their pins."""
        return {str(one) for finding in self.findings if finding.ok is False
                for one in finding.places}

    def of(self, ok):
        return {one.check for one in self.findings if one.ok is ok}


def examined(force=None, value=0, *, arm=True, agrees=AXES, machine="sinker", entered=False,
             others=True, meddle=lambda simulated, data: data, before=b"", hand=None):
    """An examination of a machine with this force, or this parameter of the machine.

    With ``arm``, the person presses the button when the doctor asks for it, and agrees to move the
    axes of ``agrees``; None answers the first such question with Ctrl-C. ``others`` is the answer
    to other questions, or a function that gets question and machine. ``entered``: the doctor is
    given the machine's file. ``meddle`` gets the machine and the bytes to it, as of ``Wire``.
    ``before`` is sent to the controller before the doctor comes. ``hand`` gets the wire of each
    guard that is to be opened, such as ``limit_low[2]``, and returns force and value that open it,
    or None; without it nobody opens guards.
    """
    chosen = machines.load(machine)
    simulated = simulation.start(chosen, clock_hz=chosen.clock_hz, seed=1, waves=None, trace=False,
                                 progress=print)
    asked, ended, due, released = [], "", [], []

    def ask(question):
        asked.append(question)
        if question.startswith("Guards"):
            return hand is not None
        if not question.startswith("Axis"):
            return others(question, simulated) if callable(others) else others
        if agrees is None:
            raise KeyboardInterrupt
        return question.split()[1] in agrees

    def say(text):
        print(text)
        if arm and text.startswith("Press the button"):
            due.append((simulated.button_arm, True))
        if hand and (text.startswith("Now ") or "Once more, " in text):
            wire = next(wire for wire in GUARDS if text.endswith(f": {of(wire)}."))
            if act := hand(wire):
                due.append((press, *act))

    def press(force, value):
        simulated.set(f"force.{force}", value)
        released.append((simulated.time_s() + PRESSED_S, f"force.{force}"))

    def look(data):
        while due:
            act, *values = due.pop()
            act(*values)
        while released and simulated.time_s() > released[0][0]:
            simulated.set(released.pop(0)[1], 0)
        return meddle(simulated, data)

    try:
        if force:
            simulated.set(force if "." in force else f"force.{force}", value)
        with serving(simulated, Wire(look), clock=simulated.time_s) as (url, _):
            while simulated.time_s() < BOOTED_S:
                time.sleep(0.01)
            port = Port(url)
            try:
                port.write(before)
                doctor = Doctor(port, BOARDS["ulx3s"], say=say, ask=ask,
                                machine=chosen if entered else None, wait_s=10.0 if arm else 2.0)
                try:
                    doctor.examine()
                except KeyboardInterrupt as error:
                    ended = type(error).__name__
                client = Client(port)
                client.send("?")
                status = next(line for line in client.lines_until(
                    lambda lines: any(line.startswith("<") for line in lines))
                    if line.startswith("<"))
            finally:
                port.close()
        return Examined(doctor.findings, doctor.report(), asked, ended, simulated.armed(), status)
    finally:
        simulated.close()


def of(wire):
    """A wire, such as ``enc_a[1]``, as a finding names it, with its pin."""
    pad, _, bit = wire.rstrip("]").partition("[")
    return str(place(BOARDS["ulx3s"], pad, int(bit or 0)))
