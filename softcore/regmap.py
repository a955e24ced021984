# SPDX-License-Identifier: Apache-2.0
"""The register map: the only place where addresses, bits and units are written down.

The gateware (``softcore.csr``) reads these tables. ``python -m softcore.generate`` makes the C
header and the register reference of them. Plain data: imports nothing from Amaranth.

A field ``f`` of register ``r`` in block ``b`` is the member ``registers.b.r`` of the controller if
it is the only field of its register, and ``registers.b.r_f`` otherwise. Widths are written here
only.
"""

from softcore.flashmap import FLASH
from softcore.linkmap import LINK
from softcore.registers import AXES, Block, Field
from softcore.registers import registers as _registers
from softcore.registers import value as _value
from softcore.safetymap import SAFETY
from softcore.scopemap import SCOPE
from softcore.tables.events import QUEUE, numbered

RATE = "2**-32 pulse/clock"
LEVEL = "2**-16 full scale"     # of the converter of the gap voltage
SHORT_LEVEL = 122               # after reset: 12 V of 100, so that a short is always detected

BASE = 0x8000_0000  # the CPU's data cache leaves addresses with the top bit set alone

SYSTEM = Block(name="system", base=0x000, doc="What this gateware is, and its clock.",
               registers=_registers(
    ("ident", "Always ``GAPK``, first letter lowest, so that the firmware can refuse other "
     "gateware.", _value(32, "The four letters.", access="r")),
    ("build", "Digest of the gateware: its sources, the board and its pins; 0 in a simulation.",
     _value(32, "Its first 32 bits.", access="r")),
    ("clock_hz", "Clock frequency.", _value(32, "Clock.", access="r", unit="Hz")),
    ("pulses_per_mm", "Unit of position.", _value(32, "Pulses.", access="r", unit="pulse/mm")),
    ("shape", "Sizes of this build.", (
        Field(name="axes", bits=4, access="r", doc="Number of axes."),
        Field(name="slots", bits=8, access="r", doc="Segments that the path window holds."),
        Field(name="jump_axis", bits=4, access="r", doc="Axis of jumps; 15 for a wire machine."))),
    ("cycle_low", "Clocks since reset, lower half. Reading it latches the upper half.",
     _value(32, "Clocks.", access="r", unit="clock"), "read"),
    ("cycle_high", "Upper half of the clock count latched by the last read of the lower.",
     _value(32, "Clocks.", access="r", unit="2**32 clock")),
    ("sleep", "Stop the processor until there is an event or a byte from the host, or until this "
     "time is over.", _value(16, "Longest sleep.", access="w", unit="clock"), "write"),
))

PATH = Block(name="path", base=0x200, doc="The path: its window of segments, and the machine's "
             "place on it. Coordinates are path pulses and wrap at 32 bits.", registers=_registers(
    ("slot_select", "Choose a slot to be written, beginning with its first word. Segment n is in "
     "slot n modulo the number of slots.", _value(8, "The slot."), "write"),
    ("slot_data", "Next word of the slot: a line has 6, an arc 16; see ``rtl.motion.path``.",
     _value(32, "The word."), "write"),
    ("ahead", "End of the loaded segments: no forward pulse passes it.",
     _value(32, "Path coordinate.", signed=True, unit="pulse")),
    ("behind", "Start of the loaded segments: no backward pulse passes it.",
     _value(32, "Path coordinate.", signed=True, unit="pulse")),
    ("back_limit", "Back limit: the lowest point that a retraction may reach (ceiling, soft limit "
     "or start of the path).",
     _value(32, "Path coordinate.", signed=True, unit="pulse")),
    ("fast_ahead", "Next corner ahead, or a place before it: there the ramp is back at the "
     "start/stop speed.",
     _value(32, "Path coordinate.", signed=True, unit="pulse")),
    ("fast_behind", "Next corner behind, or a place before it, for the way back.",
     _value(32, "Path coordinate.", signed=True, unit="pulse")),
    ("fast_ahead_rate", "Bound of every rate from that place ahead on; 0 for the start/stop speed "
     "alone.", _value(26, "Rate.", unit="2**-28 pulse/clock")),
    ("fast_behind_rate", "The same from the place behind on, for the way back.",
     _value(26, "Rate.", unit="2**-28 pulse/clock")),
    ("fast_slot", "Put both corners with their rates in force, if the machine is still in the "
     "segment of this slot.",
     _value(8, "The slot."), "write"),
    ("origin", "Put the (resting) machine at coordinate 0, at the start of a slot's segment.",
     _value(8, "The slot.", access="w"), "write"),
    ("command", "Path coordinate of the last pulse Ps.",
     _value(32, "Path coordinate.", signed=True, access="r", unit="pulse")),
    ("position", "Path coordinate of the last ramped pulse Pp.",
     _value(32, "Path coordinate.", signed=True, access="r", unit="pulse")),
    ("front", "Furthest path coordinate commanded.",
     _value(32, "Path coordinate.", signed=True, access="r", unit="pulse")),
    ("slot", "Slot of the segment in which the machine is.",
     _value(8, "The slot.", access="r")),
    ("status", "State of the motion.", (
        Field(name="moving", bits=1, access="r", doc="Pulses are stored, or the ramp moves."),
        Field(name="reverse", bits=1, access="r", doc="The last pulse was a backward one."),
        Field(name="in_position", bits=1, access="r", doc="Every axis is within its window."),
        Field(name="state", bits=4, access="r",
              doc="Retraction: 0 front, 1 stopping, 2 retracting, 3 at limit, 4 re-advance high, "
                  "5 re-advance low, 6 halted."),
        Field(name="backpressure", bits=1, access="r",
              doc="Backpressure: many events wait, so forward motion stops until the firmware "
                  "takes them."))),
    ("pace", "New feed of a segment, for ``pace_slot``.", _value(30, "Rate.", unit=RATE)),
    ("pace_slot", "Put ``pace`` in force at once, if the machine is in the segment of this slot. "
     "The rate in the slot must be written before.", _value(8, "The slot."), "write"),
))

RAMP = Block(name="ramp", base=0x300, doc="Accelerator/decelerator; see ``rtl.motion.ramp``.",
             registers=_registers(
    ("start_rate", "Start/stop speed: any change of speed below it is immediate.",
     _value(30, "Rate.", unit=RATE)),
    ("acceleration", "Slope of the linear ramp.",
     _value(30, "Change of rate.", unit="2**-32 pulse/clock per 16 clock")),
    ("back_start_rate", "Start/stop speed on the way back.", _value(30, "Rate.", unit=RATE)),
    ("back_acceleration", "Slope of the ramp on the way back.",
     _value(30, "Change of rate.", unit="2**-32 pulse/clock per 16 clock")),
    ("lead", "Lag of the position loop that the velocity feed-forward makes up; 0: the plain loop. "
     "Taken over at rest. See ``rtl.motion.feed_forward``.",
     _value(27, "Time.", unit="clock")),
))

RETRACTION = Block(name="retraction", base=0x400, doc="Retraction data in force and the start of "
                   "retractions; see ``rtl.motion.retraction``. The data words are staged: "
                   "``commit`` puts them in force together.", registers=_registers(
    ("rate", "Retraction speed.", _value(30, "Rate.", unit=RATE)),
    ("limit", "Retractable limit: distance from the first start point.",
     _value(31, "Path pulses.", unit="pulse")),
    ("high_rate", "High re-advance speed.", _value(30, "Rate.", unit=RATE)),
    ("low_rate", "Low re-advance speed.", _value(30, "Rate.", unit=RATE)),
    ("changeover", "Changeover position: distance before the start point.",
     _value(31, "Path pulses.", unit="pulse")),
    ("low_lead", "Braking distance from the low re-advance speed to the start/stop speed.",
     _value(24, "Path pulses.", unit="pulse")),
    ("jump_distance", "How far a jump goes.", _value(31, "Path pulses.", unit="pulse")),
    ("jump_rate", "Speed of a jump upwards.", _value(30, "Rate.", unit=RATE)),
    ("jump_high_rate", "Speed of a jump back, down to the changeover position.",
     _value(30, "Rate.", unit=RATE)),
    ("commit", "Put the staged data in force: at once if the machine is at the front, else when it "
     "is there again.", (
        Field(name="valid", bits=1, access="w", doc="The data are valid. Without valid data a "
              "short halts the machine."),),
     "write"),
    ("jump_period", "Machining time between jumps; 0 for none.",
     _value(32, "Clocks at the front with the discharge on.", unit="clock")),
    ("gain", "Depth beyond the first start point that ends a short burst.",
     _value(16, "Path pulses.", unit="pulse", init=10)),
    ("repeats", "Return of the short in a short burst that halts the machine; 0 for no bound.",
     _value(8, "Shorts after the first.", init=20)),
    ("walk", "Distance before the front to which the operator walks along the path, 0 for none. "
     "Taken over at rest.", _value(31, "Path pulses.", unit="pulse")),
    ("settle", "Time at rest at the limit, with small error counters, until a short there halts.",
     _value(24, "Clocks.", unit="clock", init=1000)),
    ("control", "What motion may do.", (
        Field(name="run", bits=1, doc="Path pulses are allowed at all."),
        Field(name="hold", bits=1, doc="Feed hold: no forward pulses; retractions go on."))),
    ("command", "Orders to the retraction.", (
        Field(name="retract", bits=1, access="w", doc="Retract now (operator)."),
        Field(name="release", bits=1, access="w",
              doc="Leave the halted state: advance to the front again.")), "write"),
    ("start", "Start point BS: furthest commanded position of this short.",
     _value(32, "Path coordinate.", signed=True, access="r", unit="pulse")),
    ("first", "First start point of the short burst; the limit is measured from it.",
     _value(32, "Path coordinate.", signed=True, access="r", unit="pulse")),
    ("burst", "Number of shorts so far after the first of the present short burst.",
     _value(8, "Shorts.", access="r")),
))

def _contents(part: str) -> str:
    """Describe the contents of a part of an event, for each kind."""
    return "; ".join(f"{one.number}: {getattr(one, part)}" for one in numbered()
                     if getattr(one, part)) + "."


EVENT = Block(name="event", base=0x500, doc="Queue of the gateware's events, oldest first. An "
              "event at its head interrupts the CPU.", registers=_registers(
    ("head", "The oldest event.", (
        Field(name="kind", bits=8, access="r",
              doc="".join(f"{one.number} `{one.name}`, " for one in numbered()).rstrip(", ") + "."),
        Field(name="detail", bits=QUEUE["detail"][0], access="r", doc=_contents("detail")),
        Field(name="slot", bits=QUEUE["slot"][0], access="r",
              doc="Slot of the machine's segment at that time."),
        Field(name="valid", bits=1, access="r", doc="There is an event."))),
    ("cycle", "Time of the event.",
     _value(32, "Lower half of the clock count.", access="r", unit="clock")),
    ("path", "Path coordinate at that time.",
     _value(32, "Path coordinate.", signed=True, access="r", unit="pulse")),
    ("first", "First value; its meaning depends on the kind.",
     _value(QUEUE["first"][0], _contents("first"), access="r")),
    ("second", "Second value; its meaning depends on the kind.",
     _value(QUEUE["second"][0], _contents("second"), access="r")),
    *((axis, f"Encoder position of {axis.upper()} at that time.",
       _value(32, "Position.", signed=True, access="r", unit="pulse")) for axis in AXES),
    ("pop", "Drop the oldest event.", _value(1, "Any value.", access="w"), "write"),
    ("status", "State of the queue.", (
        Field(name="lost", bits=1, access="rw1c",
              doc="An event was lost, because the queue was full."),)),
    ("index", "Axes of which the next index of the coder shall be an event, bit 0 X. It names all "
     "that wait for one; an event, and outputs that become safe, end the wait. See "
     "``rtl.motion.index``.", _value(len(AXES), "Axes.", access="w"), "write"),
))

GAP = Block(name="gap", base=0x600, doc="Classes of the discharges, and the short detector.",
            registers=_registers(
    ("short_ratio", "A short is detected if `needed` of the last `window` pulses were shorted.", (
        Field(name="needed", bits=6, init=4, doc="Shorted pulses, 1 to 32."),
        Field(name="window", bits=6, init=5, doc="Number of the last pulses, 1 to 32."))),
    ("short_duration", "A short is also detected after so long without a clear sample; 0: never.",
     _value(24, "Clocks with the pulse on.", unit="clock")),
    ("clear_needed", "Clear samples in a row that end a short.", _value(8, "Samples.", init=3)),
    ("blanking", "From the start of a pulse (or sensing pulse) until the comparators are read.",
     _value(16, "Clocks.", unit="clock", init=6)),
    ("settle", "From the ignition until the comparators are read.",
     _value(8, "Clocks.", unit="clock")),
    ("confirm", "Within a pulse, an arc or short counts as abnormal after this time; 0 counts as "
     "1.",
     _value(8, "Clocks.", unit="clock", init=1)),
    ("delay_least", "Least delay of a good discharge.", _value(16, "Clocks.", unit="clock")),
    ("criteria", "How discharges are classified; see ``rtl.gap.discriminator``.", (
        Field(name="current", bits=1, doc="Ignition is detected by current, not by voltage."),
        Field(name="delay", bits=1, doc="A discharge without delay is suspect."),
        Field(name="noise", bits=1, doc="A discharge without high frequencies is suspect."),
        Field(name="relaxation", bits=1, doc="The main source charges a capacitor."))),
    ("reference", "References of the comparators.", (
        Field(name="open", bits=10, doc="Open level.", unit="1/1024 full scale"),
        Field(name="arc", bits=10, doc="Arc level.", unit="1/1024 full scale"),
        Field(name="short", bits=10, init=SHORT_LEVEL, doc="Short level.",
              unit="1/1024 full scale"))),
    ("open_count", "Pulses without a discharge.", _value(32, "Pulses, wraps.", access="r")),
    ("ok_count", "Good discharges.", _value(32, "Pulses, wraps.", access="r")),
    ("dame_count", "Arcs: discharges below the arc level.",
     _value(32, "Pulses, wraps.", access="r")),
    ("short_count", "Shorted pulses.", _value(32, "Pulses, wraps.", access="r")),
    ("status", "State of the gap.", (
        Field(name="shorted", bits=1, access="r", doc="The signal Ss."),
        Field(name="last", bits=2, access="r", doc="Class of the last pulse: 0 open, 1 ok, "
              "2 dame, 3 short."))),
    ("short_mean", "A short by the mean voltage below this; 0: by shorted pulses. It needs the "
     "converter.", _value(12, "Code.", unit="1/4096 full scale")),
    ("short_mean_time", "Time of that mean; 0 for never.", _value(24, "Clocks.", unit="clock")),
    ("lag_time", "After the ramp has come down to the start/stop speed, the axes may be faster for "
     "this time. Contact with the discharge off trips the interlock in this time.",
     _value(28, "Clocks.", unit="clock", init=(1 << 28) - 1)),
    ("short_current", "A pulse counts as shorted for Ss by the current, if that flows with a "
     "shorter ignition delay; 0: by the voltage. See ``rtl.gap.conduction``.",
     _value(16, "Clocks.", unit="clock")),
))

POWER = Block(name="power", base=0x700, doc="Discharge pulses; see ``rtl.power``.",
              registers=_registers(
    ("on_time", "Pulse on-time.", _value(20, "Clocks.", unit="clock", init=100)),
    ("off_time", "Pulse off-time.", _value(20, "Clocks.", unit="clock", init=100)),
    ("level", "Current level.", _value(6, "Steps of the power supply.", unit="IP")),
    ("sense_on", "Sensing pulse on-time.", _value(16, "Clocks.", unit="clock", init=20)),
    ("sense_off", "Sensing pulse off-time.", _value(16, "Clocks.", unit="clock", init=80)),
    ("control", "Discharge.", (
        Field(name="machining", bits=1, doc="Switch the discharge pulses on (M03)."),
        Field(name="cut", bits=1, init=1, doc="An abnormal pulse is cut off."))),
    ("off_extra", "Additional off-time after an abnormal pulse.",
     _value(20, "Clocks.", unit="clock")),
    ("supply", "Orders to the power supply.", (
        Field(name="voltage", bits=4, doc="Open voltage; 0 for the supply's own.",
              unit="step of the supply"),
        Field(name="negative", bits=1, doc="Electrode negative."))),
    ("limits", "Limits of the build, which no register can exceed.", (
        Field(name="level", bits=6, access="r", doc="Highest current level.", unit="IP"),
        Field(name="off", bits=20, access="r", doc="Shortest off-time.", unit="clock"))),
    ("wait_time", "Longest wait for the ignition.", _value(20, "0: none.", unit="clock")),
))

SERVO = Block(name="servo", base=0xD00, doc="Gap servo by counted pulses; see "
              "``rtl.gap.preset_counter`` and ``rtl.motion.retraction``.", registers=_registers(
    ("control", "The servo.", _value(1, "1: UP and DOWN move the electrode (G95 P1).")),
    ("presets", "Presets of the counters, 0 for off.", (
        Field(name="dame", bits=8, init=3, doc="Counter 5: arcs and shorts.", unit="pulse"),
        Field(name="open", bits=8, init=6, doc="Counter 6.", unit="pulse"),
        Field(name="ok", bits=8, init=14, doc="Counter 7.", unit="pulse"))),
    ("counting", "How pulses are counted; see ``rtl.gap.preset_counter``.", (
        Field(name="window", bits=8, init=50, doc="Pulses of a window.", unit="pulse"),
        Field(name="weight", bits=4, init=1, doc="Weight of a good pulse."),
        Field(name="mode", bits=3, doc="Number of the ``Mode``, 0 to 5."))),
    ("period", "Period of the time device; 0 for no strobes.",
     _value(24, "Clocks.", unit="clock")),
    ("step", "Length of a step by UP or DOWN.",
     _value(16, "Path pulses.", unit="pulse", init=10)),
    ("ups", "Number of UP since reset.", _value(32, "Steps, wraps.", access="r")),
    ("downs", "Number of DOWN since reset.", _value(32, "Steps, wraps.", access="r")),
    ("status", "State of the counters.", (
        Field(name="dame", bits=1, access="r", doc="Counter 5 is full."),
        Field(name="open", bits=1, access="r", doc="Counter 6 is full."),
        Field(name="held", bits=1, access="r",
              doc="The servo is suspended: not at the front, or hold."))),
))

FLUID = Block(name="fluid", base=0xE00, doc="Converter and fluid detector; see "
              "``rtl.gap.sampler`` and ``rtl.gap.fluid``. Settings may change at any time; the "
              "next average uses them.", registers=_registers(
    ("control", "The detector.", (
        Field(name="convert", bits=1, doc="The converter runs."),
        Field(name="manual", bits=1, doc="The class is set by hand."),
        Field(name="manual_class", bits=2, doc="Class set by hand."))),
    *((f"threshold_{index}", f"Threshold between the classes {index} and {index + 1}.",
       _value(12, "Code of the cell.")) for index in range(3)),
    ("hysteresis", "Hysteresis on either side of a threshold.", _value(8, "Codes.")),
    ("bounds", "Range of codes of a sound cell, inclusive.", (
        Field(name="lowest", bits=12, doc="Lowest code."),
        Field(name="highest", bits=12, init=4095, doc="Highest code."))),
    ("level", "Last average of the cell.", _value(12, "Code.", access="r")),
    ("voltage", "Last sample of the gap voltage.", _value(12, "Code.", access="r")),
    ("status", "Results of the detector.", (
        Field(name="class", bits=2, access="r", doc="Class in force: 0 highest resistance."),
        Field(name="measured", bits=2, access="r", doc="Class measured."),
        Field(name="known", bits=1, access="r", doc="There is an average."),
        Field(name="broken_low", bits=1, access="r", doc="Below the bounds: a shorted wire."),
        Field(name="broken_high", bits=1, access="r", doc="Above the bounds: a broken wire."),
        Field(name="disordered", bits=1, access="r", doc="Settings are out of order."),
        Field(name="fault", bits=1, access="r", doc="The converter does not answer."))),
))

FEED = Block(name="feed", base=0xF00, doc="Feed by the mean gap voltage; see ``rtl.gap.removal`` "
             "and ``rtl.gap.feed_mode``. The converter has to run.", registers=_registers(
    ("control", "The feed mode, and the measurement that it needs.", (
        Field(name="mode", bits=2, doc="0 constant feed, or by counted pulse classes (G94, "
              "G95 P1); 1 zero feed at the reference (G95 P2); 2 feed F at the reference (G95 P3); "
              "3 constant removal (G95 P4, P5)."),
        Field(name="measure", bits=1, doc="The voltage is measured while the discharge is on."),
        Field(name="shares", bits=1, doc="Ex by the discharge per distance (G95 P5)."))),
    ("unit", "Unit distance; 0 for none.", _value(16, "Path pulses.", unit="pulse")),
    ("window", "Longest time of a mean; 0 for no bound.", _value(32, "Clocks.", unit="clock")),
    ("no_load", "Mean voltage without discharges.", _value(16, "Level.", unit=LEVEL)),
    ("reference", "References of the condition.", (
        Field(name="voltage", bits=16, doc="Vs of feed modes 1 and 2.", unit=LEVEL),
        Field(name="drop", bits=16, doc="Es of feed mode 3.", unit=LEVEL))),
    ("share", "Es of G95 P5, a share of the time.", _value(16, "Share.", unit="2**-16")),
    ("least", "Lowest Ex; a lower one counts as it.", _value(16, "Level.", unit=LEVEL, init=1)),
    ("bounds", "Bounds of Es/Ex.", (
        Field(name="lowest", bits=16, init=1 << 12, doc="Lowest ratio.", unit="1/4096"),
        Field(name="highest", bits=16, init=1 << 12, doc="Highest ratio. It has priority over the "
              "lowest.", unit="1/4096"))),
    ("gain", "K of feed modes 1 and 2.",
     _value(30, "Change of rate for 1/16 full scale.", unit=f"{RATE} per 1/16 full scale")),
    ("highest", "Highest feed of feed modes 2 and 3.", _value(30, "Rate.", unit=RATE)),
    ("voltage", "Last measurement.", (
        Field(name="mean", bits=16, access="r", doc="Mean voltage.", unit=LEVEL),
        Field(name="drop", bits=16, access="r", doc="Ex, or the share.", unit=LEVEL))),
    ("status", "Result of the last measurement.", (
        Field(name="ratio", bits=16, access="r", doc="Es/Ex within its bounds.", unit="1/4096"),
        Field(name="windows", bits=8, access="r", doc="Means taken, wraps."),
        Field(name="known", bits=1, access="r", doc="There is a mean."))),
    ("in_force", "Feed at the front in force.", _value(30, "Rate.", access="r", unit=RATE)),
))

CONDITION = Block(name="condition", base=0xB00, doc="The machining condition in force. Its words, "
                  "staged in the registers that ``rtl.power.condition`` names, come into force "
                  "together, between two pulses. They may not change while ``pending``. See "
                  "``rtl.power.condition_switch``.", registers=_registers(
    ("order", "Orders to the switch.", (
        Field(name="commit", bits=1, access="w", doc="Put the staged words in force; disarms."),
        Field(name="disarm", bits=1, access="w", doc="Do not switch at the depth."),
        Field(name="restart", bits=1, access="w", doc="Forget the depth reached.")), "write"),
    ("depth", "Put the staged words in force when the jump axis has reached this depth; arms.",
     _value(32, "Position.", access="w", signed=True, unit="pulse"), "write"),
    ("settle", "Shortest wait for power supply and comparators; see ``rtl.power.settling``.",
     _value(24, "Clocks.", unit="clock")),
    ("status", "State of the switch.", (
        Field(name="armed", bits=1, access="r", doc="It will switch at the depth."),
        Field(name="pending", bits=1, access="r", doc="Staged words wait for a pulse to end."),
        Field(name="count", bits=8, access="r", doc="Switches by depth since reset, wraps."),
        Field(name="settled", bits=1, access="r", doc="They follow the condition in force."))),
))

AUXILIARY = Block(name="auxiliary", base=0x900, doc="M, S and T functions of the machine side.",
                  registers=_registers(
    ("send", "Send a function.", (
        Field(name="code", bits=16, access="w", doc="The number after the letter."),
        Field(name="letter", bits=2, access="w", doc="0 M, 1 S, 2 T.")), "write"),
    ("timeout", "Longest wait for each edge of FIN.",
     _value(32, "Clocks.", unit="clock", init=1_000_000)),
    ("status", "State of the handshake.", (
        Field(name="busy", bits=1, access="r", doc="A function is under way."),
        Field(name="timed_out", bits=1, access="rw1c", doc="FIN did not come in time."))),
))


def _axis(index: int, letter: str) -> Block:
    return Block(name=f"axis_{letter}", base=0xA00 + 0x40 * index,
                 doc=f"Axis {letter.upper()}; see ``rtl.motion.axis``.", registers=_registers(
        ("command", "Commanded position: sum of the axis pulses Pi.",
         _value(32, "Position.", signed=True, access="r", unit="pulse")),
        ("position", "Position: sum of the feedback pulses FP.",
         _value(32, "Position.", signed=True, access="r", unit="pulse")),
        ("error", "Reversible error counter Er.",
         _value(32, "Sum of Pi less sum of FP.", signed=True, access="r", unit="pulse")),
        ("overshoot", "Furthest travel beyond the last mark (end of a retraction).",
         _value(32, "Distance.", access="r", unit="pulse")),
        ("follow_stopped", "Following error allowed at rest.",
         _value(18, "Error.", unit="pulse", init=(1 << 17) - 1, guarded=True)),
        ("follow_moving", "Following error allowed in motion.",
         _value(18, "Error.", unit="pulse", init=(1 << 17) - 1, guarded=True)),
        ("window", "Following error up to which the axis is in position.",
         _value(12, "Error.", unit="pulse", init=1)),
        ("mode", "Output of the axis.", (
            Field(name="step", bits=1, guarded=True,
                  doc="Step/direction; feedback is the step pulses."),
            Field(name="reverse", bits=1, guarded=True,
                  doc="Encoder counts the other way."),
            Field(name="swap", bits=1, guarded=True, doc="Drive turns the other way."),
            Field(name="offset", bits=12, guarded=True, unit="pulse of Er",
                  doc="Velocity command at which the axis stands still, in two's complement."),
            Field(name="friction", bits=8, guarded=True, unit="pulse of Er",
                  doc="Velocity command that friction takes."))),
        ("step_time", "Shape of step pulses.", (
            Field(name="width", bits=8, init=2, doc="Pulse width.", unit="clock"),
            Field(name="space", bits=8, init=2, doc="Shortest space.", unit="clock"),
            Field(name="setup", bits=8, init=2, doc="Direction before step.", unit="clock"))),
        ("adopt", "Take the position as command, clear Er and the faults. Only while safe.",
         _value(1, "Any value.", access="w"), "write"),
        ("status", "Faults.", (
            Field(name="saturated", bits=1, access="r", doc="Er is at its limit."),
            Field(name="illegal", bits=1, access="r", doc="The encoder has jumped."),
            Field(name="check", bits=3, access="r",
                  doc="Result of the coder's supervision: 0 nothing wrong, 1 the axis moves "
                      "differently from the model of its drive, 2 no edges, 3 no edges of phase A, "
                      "4 no edges of phase B, 5 counts against the command, 6 counts another "
                      "distance than commanded, 7 too fast."),
            Field(name="beyond_low", bits=1, access="r",
                  doc="A pulse beyond the lower soft limit was refused."),
            Field(name="beyond_high", bits=1, access="r",
                  doc="A pulse beyond the upper soft limit was refused."))),
        ("low", "Lower soft limit: no command goes below it.",
         _value(32, "Position.", signed=True, unit="pulse", guarded=True)),
        ("high", "Upper soft limit.",
         _value(32, "Position.", signed=True, unit="pulse", guarded=True)),
        ("model", "What the axis knows of its drive.", (
            Field(name="gain", bits=14, unit="2**-20 pulse/tick per pulse", guarded=True,
                  doc="Velocity gain of the position loop, for the supervision of the coder; see "
                      "``rtl.motion.supervision``."),
            Field(name="lag", bits=13, init=512, unit="2**-16", guarded=True,
                  doc="Part of its lag that it makes up in a tick; see ``rtl.motion.drive_lag``."),
            )),
        ("gear", "Electronic gear: n steps of the output, or n edges of the coder, for m pulses. "
         "Writing it begins the count anew; see ``rtl.motion.gear`` and "
         "``rtl.motion.coder_gear``.", (
            Field(name="steps", bits=16, init=1, guarded=True, doc="n.", unit="step"),
            Field(name="surplus", bits=16, guarded=True, doc="m - n.", unit="pulse")), "write"),
        ("backlash", "Compensation of backlash. After writing it the axis counts as having come "
         "up, and ``taken_up`` is 0; see ``rtl.motion.backlash``.", (
            Field(name="size", bits=13, guarded=True, doc="Backlash.", unit="pulse"),
            Field(name="taken_up", bits=15, access="r", unit="pulse",
                  doc="The drive stands so far further down than the axis, in two's "
                      "complement.")), "write"),
    ))


PITCH = Block(name="pitch", base=0xAC0, doc="Error of the screws' pitch at the places of the axes; "
              "see ``rtl.motion.backlash``.", registers=_registers(*(
    (axis, f"How far the screw takes {axis.upper()} too far up.",
     _value(13, "Error, in two's complement.", unit="pulse", guarded=True)) for axis in AXES)))


BLOCKS = (SYSTEM, FLASH, LINK, PATH, RAMP, RETRACTION, EVENT, GAP, POWER, SAFETY, AUXILIARY,
          *(_axis(index, letter) for index, letter in enumerate(AXES)), PITCH, CONDITION, SCOPE,
          SERVO, FLUID, FEED)
# Blocks of the gateware in ``rtl``. The others belong to the processor and the link.
OWNED = tuple(block for block in BLOCKS if block not in (SYSTEM, FLASH, LINK))
