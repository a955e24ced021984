# SPDX-License-Identifier: Apache-2.0
"""Signals that simulations can look at: inside the controller, and in the machine around it.

Those of the controller have the names of the register table: block, register, and field if there
are several. The table gives Verilator's list of public signals and the C++ that reads all of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from rtl.pads import INPUTS, OUTPUTS
from softcore.regmap import BLOCKS

__all__ = ["MEMORY", "PARITY", "PROBES", "TOP", "Probe", "header", "places", "plain",
           "public"]

TOP, SOC, CONTROLLER = "gapkeeper", "gapkeeper.soc", "gapkeeper.soc.controller"
CONDITION = f"{CONTROLLER}.condition"
MOTION, AXES = f"{CONTROLLER}.motion", f"{CONTROLLER}.drives"
# Arrays of the processor's memory: its words, and their parities.
MEMORY = [*SOC.split("."), "memory", "ram"]
PARITY = [*SOC.split("."), "memory", "parity"]
GAP = f"{CONTROLLER}.gap"
PINS = {name: width for name, (width, _) in (OUTPUTS | INPUTS).items()} | {"power_good": 1}


@dataclass(frozen=True)
class Probe:
    """A signal: its name, width and signedness, and where it is.

    ``scope`` is a module of the emitted Verilog, or an instance in it of ``module``; ``signal`` is
    the name there if it differs. For a signal of the machine ``scope`` is empty, and ``value`` is
    the C++ that reads it from the plant ``machine``. ``writable`` says that a test may change the
    signal; ``natively``, that it may in the native simulation only.
    """

    name: str
    bits: int
    signed: bool = False
    scope: str = SOC
    signal: str = ""
    module: str = ""
    value: str = ""
    writable: bool = False
    natively: bool = False

    @property
    def path(self) -> list[str]:
        """Names of the modules from the top, and of the signal."""
        return [*self.scope.split("."), self.signal or _register(self.name)]


def _register(name):
    """Name in the Verilog of the signal behind a register."""
    for block in BLOCKS:
        if name.startswith(f"{block.name}_"):
            return f"registers__{block.name}__{name.removeprefix(f'{block.name}_')}"
    return name


PROBES = (
    Probe("path_command", 32, signed=True),           # sum of Ps: Zc's coordinate
    Probe("path_position", 32, signed=True),          # sum of Pp
    Probe("path_front", 32, signed=True),
    Probe("path_ahead", 32, signed=True),
    Probe("path_slot", 8),
    Probe("path_status_state", 4),
    Probe("path_status_moving", 1),
    Probe("path_status_reverse", 1),
    *(Probe(f"axis_{axis}_{what}", 32, signed=True)
      for axis in "xyz" for what in ("command", "position", "error")),
    Probe("gap_status_shorted", 1),                   # Ss
    Probe("gap_open_count", 32), Probe("gap_ok_count", 32),
    Probe("gap_dame_count", 32), Probe("gap_short_count", 32),
    Probe("gap_status_last", 2),                      # class of the last main pulse
    Probe("servo_ups", 32), Probe("servo_downs", 32),
    Probe("up", 1, scope=GAP, signal="motion__up"),   # UP and DOWN as the motion gets them
    Probe("down", 1, scope=GAP, signal="motion__down"),
    # Counters 5, 6 and 7, and whether the first two are full.
    *(Probe(f"counter_{number}", 8, scope=f"{GAP}.counters", signal=f"{kind}_count")
      for number, kind in ((5, "dame"), (6, "open"), (7, "ok"))),
    Probe("servo_status_dame", 1), Probe("servo_status_open", 1),
    Probe("servo_control", 1),
    Probe("feed_control_mode", 2), Probe("feed_status_known", 1),
    Probe("fluid_voltage", 12), Probe("fluid_level", 12), Probe("fluid_status_class", 2),
    # These belong to the condition in force, not to the registers in which one is staged.
    *(Probe(name, bits, scope=CONDITION, signal=f"words__{name}") for name, bits in (
        *((f"servo_presets_{kind}", 8) for kind in ("dame", "open", "ok")),
        *((f"gap_reference_{kind}", 10) for kind in ("open", "arc", "short")),
        *((f"power_{time}", 20) for time in ("on_time", "off_time", "off_extra")),
        ("feed_no_load", 16), ("feed_reference_voltage", 16), ("feed_reference_drop", 16),
        ("power_level", 6), ("power_supply_voltage", 4), ("power_supply_negative", 1),
        ("servo_step", 16),
        ("servo_counting_mode", 3), ("servo_counting_window", 8), ("servo_counting_weight", 4),
        ("gap_criteria_delay", 1), ("gap_criteria_noise", 1), ("gap_delay_least", 16))),
    Probe("condition_switched", 1, scope=CONDITION, signal="switched"),     # by depth
    *(Probe(f"feed_{name}", 16) for name in ("voltage_mean", "voltage_drop", "status_ratio")),
    Probe("feed_status_windows", 8),
    Probe("feed_in_force", 30),                        # at the front, 2**-32 pulse/clock
    Probe("power_control_machining", 1),
    Probe("retraction_control_run", 1),
    Probe("retraction_control_hold", 1),
    Probe("safety_status_safe", 1),
    Probe("safety_latched", 18), Probe("safety_status_first", 5),
    Probe("safety_arming_armed", 1),
    Probe("power_limits_level", 6), Probe("power_limits_off", 20),
    Probe("safety_pet_strobe", 1), Probe("safety_pet", 8),  # a watchdog call, and its key
    Probe("retraction_first", 32, signed=True),
    Probe("event_head_valid", 1),
    Probe("index_found", 3, scope=f"{CONTROLLER}.index", signal="found"),
    Probe("pp", 1, scope=MOTION),                     # path pulse after the ramp
    Probe("completed", 1, scope=f"{CONTROLLER}.gap"),  # the sample that completed a short
    Probe("go", 1, scope=MOTION),                     # path pulses may come
    # Rate of the ramp less the start/stop speed, 2**-34 pulse/clock.
    Probe("ramp_above", 32, scope=f"{MOTION}.ramp", signal="above"),
    # Clocks until the processor's clock runs again; writing it stops the processor.
    Probe("sleep_left", 16, scope=f"{SOC}.sleep", signal="left", writable=True),
    Probe("safety_limits_leaving", 1),
    Probe("processor_held", 1, scope=f"{SOC}.notice", signal="held"),
    # Whether the processor takes interrupts.
    Probe("interrupts", 1, natively=True, signal="CsrPlugin_mstatus_MIE", module="VexRiscv",
          scope=f"{SOC}.cpu.core"),
    # Address of the instruction that has passed the processor's last stage but one.
    Probe("fetched", 32, natively=True, signal="memory_to_writeBack_PC", module="VexRiscv",
          scope=f"{SOC}.cpu.core"),
    # Soft limits and guarded registers, of which a test may invert a bit.
    Probe("axis_x_high", 32, signed=True, natively=True),
    Probe("axis_y_low", 32, signed=True, natively=True),
    Probe("fluid_parity", 1, natively=True, scope=f"{SOC}.registers",
          signal="safety_fluid_parity"),
    *(Probe(f"axis_{setting}_parity", 1, natively=True, scope=f"{SOC}.registers",
            signal=f"axis_{setting}_parity")
      for setting in ("x_mode_step", "y_mode_swap", "z_gear_steps", "x_backlash_size")),
    Probe("pitch_x_parity", 1, natively=True, scope=f"{SOC}.registers", signal="pitch_x_parity"),
    Probe("latch_double", 18, natively=True, scope=f"{CONTROLLER}.interlock", signal="double"),
    Probe("guard_command", 32, natively=True, signal="command_then",
          scope=f"{AXES}.axis_z.error_counter"),
    Probe("guard_apart", 32, natively=True, signal="apart", scope=f"{MOTION}.conservation"),
    Probe("window_offset", 30, natively=True, signal="offset", scope=f"{MOTION}.path"),
    Probe("window_parity", 1, natively=True, signal="segment_parity", scope=f"{MOTION}.path"),
    *(Probe(pin, bits, scope=TOP, signal=pin) for pin, bits in PINS.items()),

    Probe("gap_ma", 32, signed=True, scope="", value="machine.gap().current() * 1000"),
    Probe("gap_mv", 32, signed=True, scope="", value="machine.gap().voltage() * 1000"),
    Probe("gap_width_nm", 32, signed=True, scope="", value="machine.gap().gap_um() * 1000"),
    Probe("gap_state", 3, scope="", value="machine.gap().state()"),
    Probe("gap_bridged", 1, scope="", value="machine.gap().bridged()"),
    Probe("gap_debris_ppm", 32, scope="", value="machine.gap().debris() * 1e6"),
    *(Probe(f"level_{kind}_mv", 32, scope="", value=f"machine.reference_v({index}) * 1000")
      for index, kind in enumerate(("open", "arc", "short"))),     # behind the filters
    # Behind the filter of the DAC's pins; and of the motor.
    *(Probe(f"drive_{letter}_um_s", 32, signed=True, scope="",
            value=f"machine.command({axis}) * 1000") for axis, letter in enumerate("xyz")),
    *(Probe(f"motor_{letter}_um_s", 32, signed=True, scope="",
            value=f"machine.speed({axis}) * 1000") for axis, letter in enumerate("xyz")),
)


def public(*, writable: bool) -> str:
    """Verilator's configuration: what can be read, and with ``writable`` what can be written.

    A writable signal counts as an input, and all that depends on it is computed twice a clock, at a
    tenth of the speed. C++ can write any signal if it lets the model settle afterwards.
    """
    lines = ["`verilator_config"]
    for probe in PROBES:
        if probe.scope:
            access = "rw" if writable and probe.writable else "rd"
            lines.append(f'public_flat_{access} -module "{probe.module or probe.scope}" '
                         f'-var "{probe.path[-1]}"')
    access = "rw" if writable else "rd"
    lines += [f'public_flat_{access} -module "{".".join(path[:-1])}" -var "{path[-1]}"'
              for path in (MEMORY, PARITY)]
    return "\n".join(lines) + "\n"


def _value(probe):
    """C++ of a probe's value, as a signed number of 64 bits."""
    if not probe.scope:
        return f"static_cast<int64_t>({probe.value})"
    if not probe.signed:
        return f"static_cast<int64_t>(controller.probe_{probe.name}())"
    gap = 64 - probe.bits
    return f"static_cast<int64_t>(controller.probe_{probe.name}() << {gap}) >> {gap}"


def _row(probe):
    write = "nullptr"
    if probe.scope and (probe.writable or probe.natively):
        write = (f"[](Controller& controller, int64_t value) "
                 f"{{ controller.poke_{probe.name}(static_cast<uint64_t>(value)); }}")
    return (f'    {{"{probe.name}", {probe.bits}, [](const Controller& controller, '
            f"const plant::Plant& machine) -> int64_t "
            f"{{ (void)controller; (void)machine; return {_value(probe)}; }}, {write}}},")


def header(waves: Sequence[Probe]) -> str:
    """C++ that reads the probes, from a ``Controller`` of ``native.quick`` and its plant.

    ``snapshot`` reads those of ``waves`` at once: a call for each would take three times as long.
    """
    values = [f"    out[{index}] = static_cast<uint64_t>({_value(probe)});"
              for index, probe in enumerate(waves)]
    return "\n".join([
        "struct Probe {", "    const char* name;", "    uint32_t bits;",
        "    int64_t (*read)(const Controller&, const plant::Plant&);",
        "    void (*write)(Controller&, int64_t);", "};",
        "static const Probe PROBES[] = {", *map(_row, PROBES), "};",
        f"constexpr size_t WAVES = {len(values)};",
        "static void snapshot(const Controller& controller, const plant::Plant& machine, "
        "uint64_t* out) {", *values, "}", ""])


def places(waves: Sequence[Probe]) -> str:
    """C++ for a simulation that reads the controller's probes itself.

    ``PLACE`` has the place of every probe in ``waves``, or ``WAVES``; ``machine_values`` reads
    those of the machine.
    """
    place = {probe: index for index, probe in enumerate(waves)}
    values = [f"    out[{index}] = static_cast<uint64_t>({_value(probe)});"
              for probe, index in place.items() if not probe.scope]
    return "\n".join([
        f"constexpr size_t WAVES = {len(waves)};",
        "static const uint32_t PLACE[] = {",
        "    " + ", ".join(str(place.get(probe, len(waves))) for probe in PROBES), "};",
        "static void machine_values(const plant::Plant& machine, uint64_t* out) {", *values,
        "}", ""])


def plain(path: list[str]) -> str:
    """Name of a signal in Verilator's C++, which encodes two underscores in a row."""
    if path[:-1] == [TOP]:
        return path[-1]
    return "__DOT__".join(part.replace("__", "___05F") for part in path)
