# SPDX-License-Identifier: Apache-2.0
"""The signals of a waveform file: pins and registers of the controller, and the machine around it.

Every signal is a probe, or one bit of it: nothing is computed for the file. The scopes are the
folders of ``rtl``. ``testbench.native.page`` makes ``docs/reference/waveforms.md`` of this table.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from rtl.gap.discriminator import PulseClass
from rtl.gap.feed_mode import FeedMode
from rtl.gap.preset_counter import Mode
from rtl.members import AXES
from rtl.states import State
from softcore.tables.causes import CAUSES
from testbench.native.probes import PROBES, Probe

__all__ = ["NAMES", "RECORDED", "SCOPE", "SIGNALS", "Signal"]

SCOPE = "gapkeeper"
OF_NAME = {probe.name: probe for probe in PROBES}


def _names(enumeration: type) -> tuple[str, ...]:
    """Names of an enumeration's values 0, 1, 2 and so on, as the pages write them."""
    members = {member.value: member.name for member in enumeration}
    return tuple(members[value].lower() for value in range(len(members)))


# Names of the values of a signal, by the enumeration's name in the file.
NAMES = {
    "state": _names(State),
    "pulse": tuple(member.name for member in PulseClass),
    "counting": _names(Mode),
    "feed": _names(FeedMode),
    "cause": tuple(cause.name for cause in CAUSES),
    "gap": ("off", "open", "burning", "arcing", "shorted"),
}


@dataclass(frozen=True)
class Signal:
    """A signal of the file.

    ``scope`` is its place below ``SCOPE``, ``probe`` the name of the probe, and ``bit`` the bit of
    it, or None for all. ``pin`` says that it is a pin of the controller. ``names`` is an
    enumeration of ``NAMES``, or empty.
    """

    scope: str
    name: str
    probe: str
    meaning: str
    bit: int | None = None
    names: str = ""
    pin: bool = False

    def __post_init__(self):
        if self.names and len(NAMES[self.names]) > 1 << self.bits:
            raise ValueError(f"{self.path} has {self.bits} bits, too few for its names")

    @property
    def bits(self) -> int:
        """Width in the file."""
        return self.of.bits if self.bit is None else 1

    @property
    def of(self) -> Probe:
        """The probe."""
        return OF_NAME[self.probe]

    @property
    def path(self) -> str:
        """Full name, as the viewers write it."""
        return f"{SCOPE}.{self.scope}.{self.name}"


def _pins(scope: str, **meanings: str) -> Iterator[Signal]:
    for name, meaning in meanings.items():
        yield Signal(scope, name, name, meaning, pin=True)


def _axis(index: int, letter: str) -> Iterator[Signal]:
    scope = f"motion.{letter}"
    for name, register, meaning in (
            ("Pi", "command", "axis pulses commanded, sum"),
            ("FP", "position", "feedback pulses of the coder, sum"),
            ("Er", "error", "error counter, pulses: sum of Pi less sum of FP")):
        yield Signal(scope, name, f"axis_{letter}_{register}", meaning)
    for name, meaning in (
            ("dac", "velocity command to the drive, as the density of ones"),
            ("dac_negative", "its sign"),
            ("step", "step pulse, for a drive that takes steps"),
            ("dir", "its direction, high for down"),
            ("enc_a", "coder, phase A"), ("enc_b", "coder, phase B"),
            ("enc_index", "its index"),
            ("drive_enable", "the drive may move"), ("drive_fault", "the drive reports a fault"),
            ("limit_low", "lower limit switch"), ("limit_high", "upper limit switch")):
        yield Signal(scope, name, name, meaning, bit=index, pin=True)


def _words() -> Iterator[Signal]:
    """Words of the condition in force."""
    for name, probe, meaning in (
            ("level", "power_level", "current, in steps"),
            ("on_time", "power_on_time", "on-time, clocks"),
            ("off_time", "power_off_time", "off-time, clocks"),
            ("off_extra", "power_off_extra", "longer off-time after an abnormal pulse, clocks"),
            ("supply_voltage", "power_supply_voltage", "open voltage, in steps"),
            ("supply_negative", "power_supply_negative", "the electrode is negative"),
            ("reference_open", "gap_reference_open", "open level, of 1024"),
            ("reference_arc", "gap_reference_arc", "arc level, of 1024"),
            ("reference_short", "gap_reference_short", "short level, of 1024"),
            ("preset_5", "servo_presets_dame", "preset of counter 5"),
            ("preset_6", "servo_presets_open", "preset of counter 6"),
            ("preset_7", "servo_presets_ok", "preset of counter 7"),
            ("step", "servo_step", "length of a step by UP or DOWN, path pulses"),
            ("no_load", "feed_no_load", "mean voltage without discharges, of 65536"),
            ("Vs", "feed_reference_voltage", "reference of P2 and P3, of 65536"),
            ("Es", "feed_reference_drop", "reference of P4, of 65536")):
        yield Signal("power.condition", name, probe, meaning)
    yield Signal("power.condition", "switched", "condition_switched",
                 "the condition was switched by depth: high for one clock")


SIGNALS: tuple[Signal, ...] = (
    *(Signal("motion", *row) for row in (
        ("Zc", "path_ahead", "end of what firmware has commanded, path pulses"),
        ("Ps", "path_command", "path pulses before the ramp, sum"),
        ("Pp", "path_position", "path pulses behind the ramp, sum"),
        ("front", "path_front", "furthest point of the path so far"),
        ("BS", "retraction_first", "start point of the retraction: the first of a burst"))),
    Signal("motion", "state", "path_status_state", "of the retraction", names="state"),
    *(Signal("motion", *row) for row in (
        ("moving", "path_status_moving", "the path goes on, either way"),
        ("reverse", "path_status_reverse", "it goes backwards"),
        ("hold", "retraction_control_hold", "feed hold by firmware"))),
    *(signal for index, letter in enumerate(AXES) for signal in _axis(index, letter)),

    Signal("gap", "Ss", "gap_status_shorted", "short"),
    *_pins("gap", gap_high="the voltage is above the open level",
           gap_arc="... below the arc level", gap_short="... below the short level",
           gap_current="current flows", gap_noise="the discharge has high frequencies"),
    Signal("gap", "pulse", "gap_status_last", "class of the last main pulse", names="pulse"),
    *(Signal("gap", f"{kind}_count", f"gap_{kind}_count", f"{kind.upper()} pulses so far")
      for kind in ("open", "ok", "dame", "short")),
    *(Signal("gap", *row) for row in (
        ("counter_5", "counter_5", "counter 5: DAME or SHORT"),
        ("counter_6", "counter_6", "counter 6: OPEN"),
        ("counter_7", "counter_7", "counter 7: OK"),
        ("full_5", "servo_status_dame", "counter 5 is full"),
        ("full_6", "servo_status_open", "counter 6 is full"),
        ("UP", "up", "widen the gap by a step: high for one clock"),
        ("DOWN", "down", "narrow the gap by a step: high for one clock"),
        ("ups", "servo_ups", "UP of the preset counters so far"),
        ("downs", "servo_downs", "DOWN of the preset counters so far"),
        ("counting_on", "servo_control", "the preset counters are in use (G95 P1)"))),
    Signal("gap", "counting", "servo_counting_mode", "how pulses are counted",
           names="counting"),
    Signal("gap", "feed_mode", "feed_control_mode",
           "constant: G94 and G95 P1; zero: P2; offset: P3; removal: P4, P5", names="feed"),
    *(Signal("gap", *row) for row in (
        ("voltage", "fluid_voltage", "last sample of the gap voltage, of 4096"),
        ("mean", "feed_voltage_mean", "mean gap voltage of the last window, of 65536"),
        ("Ex", "feed_voltage_drop", "its drop below the voltage without discharges, of 65536"),
        ("ratio", "feed_status_ratio", "Es/Ex, of 4096"),
        ("windows", "feed_status_windows", "means taken so far, wraps at 256"),
        ("feed", "feed_in_force", "feed at the front, 2⁻³² pulses per clock"),
        ("fluid_level", "fluid_level", "last mean of the fluid's cell, of 4096"),
        ("fluid_class", "fluid_status_class", "class of the fluid: 0 highest resistance"))),

    Signal("power", "machining", "power_control_machining", "firmware wants the discharge (M03)"),
    *_pins("power", gap_on="gate of the main source", gap_sense="gate of the sensing source",
           gap_level="current of the main source, in steps",
           gap_supply="order to the power supply: voltage, and bit 4 the polarity"),
    Signal("power", "limit_level", "power_limits_level", "current that the limiter allows"),
    Signal("power", "limit_off", "power_limits_off", "least off-time of the limiter, clocks"),
    *_words(),

    *_pins("safety", safe="the outputs are in their safe state"),
    Signal("safety", "latched", "safety_latched", "causes since the interlock was cleared, by bit"),
    Signal("safety", "first", "safety_status_first", "the first of them, or of those before",
           names="cause"),
    Signal("safety", "armed", "safety_arming_armed", "the discharge is allowed"),
    *_pins("safety", estop="emergency stop", fluid_low="low fluid", arm="button `arm`",
           contactor="coil of the main contactor", power_good="the supply is good"),

    *_pins("auxiliary", auxiliary_code="number of an M, S or T function",
           auxiliary_strobe="bit 0 M, 1 S, 2 T", fin="the machine side has finished it"),
    *_pins("link", rx="serial line to the controller", tx="serial line from the controller"),

    Signal("machine", "gap_mv", "gap_mv", "gap voltage, mV"),
    Signal("machine", "gap_ma", "gap_ma", "gap current, mA"),
    Signal("machine", "gap_state", "gap_state", "what goes on in the gap", names="gap"),
    Signal("machine", "gap_width_nm", "gap_width_nm", "true width of the gap, nm"),
    Signal("machine", "bridged", "gap_bridged", "a bridge shorts the gap"),
    Signal("machine", "debris_ppm", "gap_debris_ppm", "debris in the gap, by volume, 10⁻⁶"),
    *(Signal("machine", f"command_{letter}", f"drive_{letter}_um_s",
             f"velocity command of {letter.upper()} behind the drive's filter, µm/s")
      for letter in AXES),
    *(Signal("machine", f"speed_{letter}", f"motor_{letter}_um_s",
             f"true speed of {letter.upper()}, µm/s") for letter in AXES),
)

# Probes of the file, in the order of their first signals.
RECORDED: tuple[Probe, ...] = tuple(dict.fromkeys(signal.of for signal in SIGNALS))
