# SPDX-License-Identifier: Apache-2.0
"""The machine's wires as every board has them: a board only says which pins they have.

Every output of power is high when active and has a resistor to ground. Every input that guards the
machine is a closed contact, or an output that says "good", to 3.3 V: low is a fault.
"""

from typing import Any

from constraints.wires import Wire

__all__ = ["machine_wires"]

OUTPUT: dict[str, Any] = {"drive_ma": 8, "slow": True, "hold": "ground"}
GUARD: dict[str, Any] = {"low": True}

STOPS = "a broken wire reads as the fault: the machine stops"
# Pad: kind, reason, what a broken wire does, the rest of the wire.
USUAL: dict[str, tuple[str, str, str, dict[str, Any]]] = {
    "enc_a": ("coder", "plain input; the supervision compares it with the drive's model",
              "the axis seems to stand: the supervision trips when it should move", {}),
    "enc_b": ("coder", "plain input, as phase A",
              "the axis seems to tremble: the supervision trips when it should move", {}),
    "enc_index": ("coder", "plain input; only homing reads it", "homing does not find the index: "
                  "ALARM:9", {}),
    "dac": ("drive", "high is a velocity, so that no level at all is none",
            "the drive stands still; the supervision trips", OUTPUT),
    "dac_negative": ("drive", "a sign alone moves nothing",
                     "the axis runs the wrong way; the supervision trips", OUTPUT),
    "step": ("drive", "a step needs an edge", "no steps; nothing sees it without a coder", OUTPUT),
    "dir": ("drive", "a direction alone moves nothing",
            "steps the wrong way; nothing sees it without a coder", OUTPUT),
    "drive_enable": ("enable", "high is enabled", "the drive is disabled", OUTPUT),
    "drive_fault": ("contact", "the drive says \"good\" by 3.3 V", STOPS, GUARD),
    "estop": ("contact", "a closed contact says \"no emergency stop\" by 3.3 V", STOPS, GUARD),
    "fluid_low": ("contact", "a closed float switch says \"enough fluid\" by 3.3 V",
                  "a broken wire reads as too little fluid: machining stops", GUARD),
    "fin": ("contact", "a make contact: the machine side has done it",
            "the auxiliary function runs into its time-out", {}),
    "gap_sense": ("gate", "high is on", "contact is not seen: no motion, alarm 152 or the time-out",
                  OUTPUT),
    "contactor": ("enable", "high is closed", "the contactor falls off", OUTPUT),
    "arm": ("button", "a make contact: only a pressed button arms",
            "the discharge cannot be armed", {}),
    "gap_noise": ("comparator", "plain input; optional", "no discharge seems noisy", {}),
    "gap_reference": ("reference", "a density of ones; none is the lowest level",
                      "the comparator's level falls to zero", OUTPUT),
    "gap_on": ("gate", "high is on", "no discharge", OUTPUT),
    "gap_level": ("gate", "high adds current", "less current than ordered", OUTPUT),
    "gap_current": ("comparator", "high while no current flows",
                    "a broken wire reads as current: the gate seems stuck, outputs are safe",
                    GUARD),
    "gap_high": ("comparator", "high above the open level",
                 "no gap seems open: the electrode does not advance", {}),
    "gap_arc": ("comparator", "high above the arc level", "every discharge seems an arc", GUARD),
    "gap_short": ("comparator", "high above the short level",
                  "a broken wire reads as a short: the electrode retracts", GUARD),
    "chain": ("relay", "three pins carry what is slow",
              "auxiliary functions and voltage stay as they are, or change at random",
              OUTPUT | {"behind": "drive_enable"}),
    "limit_low": ("contact", "a closed switch says \"not pressed\" by 3.3 V", STOPS, GUARD),
    "limit_high": ("contact", "a closed switch says \"not pressed\" by 3.3 V", STOPS, GUARD),
}


def machine_wires(pins: dict[str, str]) -> tuple[Wire, ...]:
    """Wires at the header; ``pins`` has the names of the header's pins by pad, first bit first."""
    return tuple(Wire(pad, where, USUAL[pad][0], USUAL[pad][1], USUAL[pad][2], **USUAL[pad][3])
                 for pad, where in pins.items())
