# Generated from softcore/tables/states.py by `python -m softcore.generate`; do not edit.
"""States of the motion, the coders' supervision and the oscilloscope's pulses."""

from amaranth.lib import enum

__all__ = ["Check", "Pulse", "State"]


class State(enum.Enum, shape=4):
    """What the motion is doing."""

    FRONT = 0       # machining at the front of the path
    STOPPING = 1    # a retraction was ordered: coming to rest
    RETRACTING = 2  # going back
    AT_LIMIT = 3    # as far back as allowed, still short
    HIGH = 4        # re-advance at VH (H of the tape), to the changeover position
    LOW = 5         # re-advance at VL (E of the tape), to the start point
    HALTED = 6      # stopped by an alarm


class Check(enum.Enum, shape=3):
    """The check that failed first."""

    NONE = 0
    MODEL = 1    # the axis does not move as the model of its drive
    SILENT = 2   # no edge of either phase
    PHASE_A = 3  # B alone has edges
    PHASE_B = 4  # A alone has edges
    AGAINST = 5  # against the command
    SHARE = 6    # much less, or much more, than the drive was commanded
    RATE = 7     # faster than any drive


class Pulse(enum.Enum, shape=3):
    """The pulse that got its class in the clock of an entry."""

    NONE = 0
    OPEN = 1
    OK = 2
    DAME = 3
    SHORT = 4
    SENSED_OPEN = 5   # a sensing pulse
    SENSED_SHORT = 6  # a sensing pulse
