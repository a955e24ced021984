# SPDX-License-Identifier: Apache-2.0
"""Members of ``rtl.motion.retraction``, with their meaning and unit.

A rate is in 2**-32 pulse/clock, a coordinate or a distance in path pulses; coordinates wrap.
"""

from amaranth import *
from amaranth.lib.wiring import In, Out

from rtl.events import Happened

__all__ = ["DATA", "MEMBERS", "STAGED"]

RATE, LENGTH, COORDINATE = 30, 31, signed(32)

# Words of the tape. They are staged: ``commit_strobe`` puts them in force together.
STAGED = {
    "rate": In(RATE),               # of the way back: R of the tape
    "limit": In(LENGTH),            # retractable limit, from the first start point: L
    "high_rate": In(RATE),          # of the re-advance, to the changeover: H
    "low_rate": In(RATE),           # ... and from there to the start point: E
    "changeover": In(LENGTH),       # distance before the start point: Q
    "low_lead": In(24),             # braking distance from ``low_rate`` to the start/stop speed
    "jump_distance": In(LENGTH),    # how far a jump goes back
    "jump_rate": In(RATE),          # of a jump's way back
    "jump_high_rate": In(RATE),     # of a jump's re-advance, to the changeover
}
# Words of the tape and rules, each with the name of its register in ``softcore/regmap.py``.
DATA = {
    **STAGED,
    "jump_period": In(32),          # machining time between jumps, clocks; 0 for none
    "gain": In(16),                 # progress beyond the first start point that ends a short burst
    "repeats": In(8),               # return of the short in a burst that halts; 0 for no bound
    "settle": In(24),               # time in position at the limit before a short halts, clocks
    "walk": In(LENGTH),             # how far before the front the operator walks; 0 for none
}
MEMBERS = {
    **DATA,
    "commit_valid": In(1),          # the staged words are valid; read with ``commit_strobe``
    "commit_strobe": In(1),         # put them in force, at once or on the return to the front

    # Orders
    "run": In(1),                   # path pulses are allowed at all
    "hold": In(1),                  # no forward pulses
    "retract": In(1),               # the operator's order to go back, one clock
    "release": In(1),               # leave ``State.HALTED``, one clock
    "backpressure": In(1),          # firmware has not taken the events yet: no forward pulses

    # The servo
    "servo": In(1),                 # at the front move by strobes only
    "up": In(1),                    # strobe: a step back
    "down": In(1),                  # strobe: a step forward
    "step": In(16),                 # length of a step, pulses
    "held": Out(1),                 # strobes are lost

    # The gap and the machine
    "safe": In(1),                  # outputs are safe: halted, without an alarm of this block
    "shorted": In(1),               # Ss, with the discharge on
    "completed": In(1),             # the sample that completed Ss came in this clock
    "discharging": In(1),           # there are main pulses, or would be: the time of jumps runs
    "wait": In(1),                  # discharge off, gap not known to be open: no forward pulse
    "contact": In(1),               # discharge off, and the electrode touches the work
    "wanted": Out(1),               # forward pulses would come but for ``wait`` and ``contact``
    "in_position": In(1),           # every axis is within its window of its command
    "cycle": In(32),                # clock count, for events

    # The path
    "load": In(1),                  # the machine is put at a new origin: begin anew at the front
    "feed": In(RATE),               # at the front
    "highest": In(26),              # bound of every rate, 2**-28 pulse/clock; 0 for none
    "ahead": In(COORDINATE),        # end of the loaded segments
    "behind": In(COORDINATE),       # their start
    "back_limit": In(COORDINATE),   # no pulse goes back beyond it
    "fast_ahead": In(COORDINATE),   # next place ahead where the machine must be slow
    "fast_behind": In(COORDINATE),  # next such place behind
    "fast_ahead_rate": In(26),      # bound from there on, 2**-28 pulse/clock; 0 for none
    "fast_behind_rate": In(26),
    "command": In(COORDINATE),      # of the last pulse Ps
    "position": In(COORDINATE),     # of the last pulse Pp
    "front": In(COORDINATE),        # furthest ``position`` since ``load``

    # The ramp
    "ready": In(1),                 # the segment has been fetched
    "pp": In(1),                    # a pulse Pp
    "rest": In(1),                  # nothing stored or under way, and the ramp is slow
    "steady": In(1),                # pulses leave as they come, or at its target
    "distance": In(24),             # braking distance, pulses

    # Orders to pulse generator and ramp
    "go": Out(1),                   # pulses Ps may come
    "reverse": Out(1),              # ... and go back
    "target": Out(RATE),            # ... at this rate
    "bound": Out(COORDINATE),       # ... up to here
    "brake": Out(1),                # slow down to the start/stop speed

    # Reports
    "sensing": Out(1),              # away from the front: sensing pulses only
    "quiet": Out(1),                # halted: no pulses at all
    "start": Out(COORDINATE),       # start point BS
    "first": Out(COORDINATE),       # ``front`` at the first short of the burst
    "burst": Out(8),                # returns of the short in the burst
    "mark": Out(1),                 # the way back has ended: one clock
    "event": Out(Happened),         # what happened: each event for one clock, else the kind NONE
}
