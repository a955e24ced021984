# SPDX-License-Identifier: Apache-2.0
"""Guards opened by hand: only then one shows that is stuck closed, bridged or exchanged."""

from constraints.pads import PADS
from host.doctor.complaints import Place, place
from host.doctor.examination import Examination
from host.doctor.levels import open_guards

__all__ = ["ACTS", "KINDS", "opened"]

LOOK_S = 0.02       # between two looks; an answer takes longer
AXES = "XYZ"
WIDTH = {pad.name: pad.width for pad in PADS}

# Questions, and the guards that each is about.
KINDS: dict[str, tuple[str, ...]] = {
    "the emergency stop": ("estop",),
    "the limit switches": ("limit_low", "limit_high"),
    "the drives' faults": ("drive_fault",),
    "the float switch of the fluid": ("fluid_low",),
}
# What a person does to open a guard and to close it again.
ACTS = {
    "estop": "press the emergency stop, and release it",
    "limit_low": "press the lower limit switch of axis {axis}, and let it go",
    "limit_high": "press the upper limit switch of axis {axis}, and let it go",
    "drive_fault": "make the drive of axis {axis} report a fault, and end it (such as by its "
                   "supply)",
    "fluid_low": "hold the float switch of the fluid at the bottom, and let it go",
}


def opened(doctor: Examination, wait_s: float) -> bool:
    """Have a person open every guard that is closed, one after the other, and look at all of them.

    Nothing moves and no output acts meanwhile. ``wait_s`` is how long each may take.

    Returns false if one was found wrong: without an emergency stop that works, nothing may move.
    """
    already, before = _open(doctor), len(doctor.findings)
    if already is None:
        doctor.find("guards opened", None, "not tried: the controller did not tell its inputs")
        return True
    for what, pads in KINDS.items():
        wires = [(pad, bit) for pad in pads for bit in range(WIDTH[pad])
                 if place(doctor.board, pad, bit) not in already]
        if not wires:
            continue
        if not doctor.ask(f"Guards: can somebody open {what} now, one after the other? Nothing "
                          "moves."):
            doctor.find(f"{', '.join(pads)} opened", None, "not tried: a guard that is stuck "
                        "closed, or bridged, looks as a sound one does", None)
            continue
        for pad, bit in wires:
            _one(doctor, pad, bit, wait_s)
    return all(one.ok is not False for one in doctor.findings[before:])


def _one(doctor: Examination, pad: str, bit: int, wait_s: float) -> None:
    """Wait until this guard was open and is closed again; or twice another in its place.

    Once does not accuse it: a person may press another switch, and a contact may bounce.
    """
    wanted = place(doctor.board, pad, bit)
    check = f"{wanted.wire} opened"
    act = ACTS[pad].format(axis=AXES[bit])
    # It may still be open by what was done to another, or be held already.
    before = _closed(doctor, check, wanted, wait_s)
    if before is None:
        return
    doctor.say(f"Now {act}: {wanted}.")
    end = doctor.port.time_s() + wait_s
    met: list[Place] = []       # that have opened, in their order
    instead: list[Place] = []   # that opened and closed again, and this one did not
    while doctor.port.time_s() < end:
        seen = _open(doctor)
        if seen is not None:
            now = [one for one in seen if one not in before]
            met += [one for one in now if one not in met]
            if wanted in met and wanted not in now:
                others = [one.wire for one in met if one != wanted]
                doctor.find(check, True, "it opened and closed" + (
                    f"; with it {', '.join(others)}" if others else ", and no other did"))
                return
            if met and not now:
                if instead:
                    break
                instead = met
                doctor.say(f"{_names(met)} opened, and {wanted.wire} did not. Once more, {act}: "
                           f"{wanted}.")
                met = []
        doctor.listen(LOOK_S)
    met = met or instead
    if wanted in met:
        doctor.find(check, False, f"it stayed open for {wait_s:g} s", [wanted])
    elif not met:
        doctor.find(check, False, f"it stayed closed for {wait_s:g} s: nobody opened it, or it "
                    "is stuck at its supply or bridged, and guards nothing", [wanted])
    elif len(met) == 1:
        doctor.find(check, False, f"it stayed closed, and {_names(met)} opened in its place: their "
                    "wires are exchanged, or it is stuck or bridged", [wanted, *met])
    else:   # more than a wire that is exchanged: they open by what was done to this one
        doctor.find(check, False, f"it stayed closed, and {_names(met)} opened: it is stuck or "
                    "bridged, and guards nothing", [wanted])


def _closed(doctor: Examination, check: str, wanted: Place, wait_s: float) -> list[Place] | None:
    """Wait until a guard is closed that was closed at first; return which are open then.

    None is after a finding: it stays open, or the controller does not tell.
    """
    end = doctor.port.time_s() + wait_s
    told, asked = False, False
    while True:
        now = _open(doctor)
        if now is not None and wanted not in now:
            return now
        told = told or now is not None
        if doctor.port.time_s() > end:
            break
        if now is not None and not asked:
            doctor.say(f"Waiting until this guard is closed again: {wanted}.")
            asked = True
        doctor.listen(LOOK_S)
    if told:
        doctor.find(check, False, f"it stayed open for {wait_s:g} s", [wanted])
    else:
        doctor.find(check, None, "the controller did not tell its inputs")
    return None


def _names(places: list[Place]) -> str:
    return ", ".join(one.wire for one in places)


def _open(doctor: Examination) -> list[Place] | None:
    """Guards that are open now; None if it does not tell."""
    inputs = doctor.inputs()
    return None if inputs is None else [one for _, one in open_guards(doctor.board, inputs)]
