# SPDX-License-Identifier: Apache-2.0
"""Signals that simulations can look at: inside the controller, and in the machine around it.

Those of the controller have the names of the register table: block, register, and field if there
are several. The table gives Verilator's list of public signals and the C++ that reads all of them.
"""

from dataclasses import dataclass

from softcore.regmap import BLOCKS

__all__ = ["MEMORY", "PARITY", "PROBES", "Probe", "header", "plain", "public"]

TOP, SOC, CONTROLLER = "gapkeeper", "gapkeeper.soc", "gapkeeper.soc.controller"
CONDITION = f"{CONTROLLER}.condition"
MOTION, AXES = f"{CONTROLLER}.motion", f"{CONTROLLER}.drives"
# Arrays of the processor's memory: its words, and their parities.
MEMORY = [*SOC.split("."), "memory", "ram"]
PARITY = [*SOC.split("."), "memory", "parity"]
ERROR_Z = "controller.probe_axis_z_error()"


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
    Probe("servo_ups", 32), Probe("servo_downs", 32),
    # These belong to the condition in force, not to the registers in which one is staged.
    *(Probe(name, bits, scope=CONDITION, signal=f"words__{name}") for name, bits in (
        *((f"servo_presets_{kind}", 8) for kind in ("dame", "open", "ok")),
        ("servo_counting_mode", 3), ("servo_counting_window", 8), ("servo_counting_weight", 4),
        ("gap_criteria_delay", 1), ("gap_criteria_noise", 1), ("gap_delay_least", 16),
        ("feed_no_load", 16), ("power_level", 6))),
    Probe("condition_switched", 1, scope=CONDITION, signal="switched"),     # by depth
    *(Probe(f"feed_{name}", 16) for name in ("voltage_mean", "voltage_drop", "status_ratio")),
    Probe("feed_status_windows", 8),
    Probe("feed_in_force", 30),                        # at the front, 2**-32 pulse/clock
    Probe("power_control_machining", 1),
    Probe("retraction_control_run", 1),
    Probe("retraction_control_hold", 1),
    Probe("safety_status_safe", 1),
    Probe("safety_latched", 18),
    Probe("safety_pet_strobe", 1), Probe("safety_pet", 8),  # a watchdog call, and its key
    Probe("retraction_first", 32, signed=True),
    Probe("event_head_valid", 1),
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
    # Soft limits and guarded registers, of which a test may invert a bit.
    Probe("axis_x_high", 32, signed=True, natively=True),
    Probe("axis_y_low", 32, signed=True, natively=True),
    Probe("fluid_parity", 1, natively=True, scope=f"{SOC}.registers",
          signal="safety_fluid_parity"),
    Probe("latch_double", 18, natively=True, scope=f"{CONTROLLER}.interlock", signal="double"),
    Probe("guard_command", 32, natively=True, signal="command_then",
          scope=f"{AXES}.axis_z.error_counter"),
    Probe("guard_apart", 32, natively=True, signal="apart", scope=f"{MOTION}.conservation"),
    Probe("window_offset", 30, natively=True, signal="offset", scope=f"{MOTION}.path"),
    Probe("window_parity", 1, natively=True, signal="segment_parity", scope=f"{MOTION}.path"),
    *(Probe(pin, bits, scope=TOP, signal=pin) for pin, bits in (
        ("gap_on", 1), ("gap_sense", 1), ("gap_level", 6), ("dac", 3), ("step", 3),
        ("drive_enable", 3), ("contactor", 1), ("auxiliary_strobe", 3), ("safe", 1))),

    Probe("dac_z", 16, signed=True, scope="",
          value=f"std::clamp(static_cast<int32_t>({ERROR_Z}), -32767, 32767)"),
    Probe("gap_ma", 32, signed=True, scope="", value="machine.gap().current() * 1000"),
    Probe("gap_mv", 32, signed=True, scope="", value="machine.gap().voltage() * 1000"),
    Probe("gap_width_nm", 32, signed=True, scope="", value="machine.gap().gap_um() * 1000"),
    Probe("motor_z_um_s", 32, signed=True, scope="", value="machine.speed(plant::Z) * 1000"),
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


def _row(probe):
    write = "nullptr"
    value = f"static_cast<int64_t>({probe.value})"
    if probe.scope:
        value = f"static_cast<int64_t>(controller.probe_{probe.name}())"
        if probe.signed:
            gap = 64 - probe.bits
            value = f"static_cast<int64_t>(controller.probe_{probe.name}() << {gap}) >> {gap}"
        if probe.writable or probe.natively:
            write = (f"[](Controller& controller, int64_t value) "
                     f"{{ controller.poke_{probe.name}(static_cast<uint64_t>(value)); }}")
    return (f'    {{"{probe.name}", {probe.bits}, [](const Controller& controller, '
            f"const plant::Plant& machine) -> int64_t "
            f"{{ (void)controller; (void)machine; return {value}; }}, {write}}},")


def header() -> str:
    """C++ that reads the probes, from a ``Controller`` of ``native.quick`` and its plant."""
    return "\n".join([
        "struct Probe {", "    const char* name;", "    uint32_t bits;",
        "    int64_t (*read)(const Controller&, const plant::Plant&);",
        "    void (*write)(Controller&, int64_t);", "};",
        "static const Probe PROBES[] = {", *map(_row, PROBES), "};", ""])


def plain(path: list[str]) -> str:
    """Name of a signal in Verilator's C++, which encodes two underscores in a row."""
    if path[:-1] == [TOP]:
        return path[-1]
    return "__DOT__".join(part.replace("__", "___05F") for part in path)
