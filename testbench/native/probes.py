# SPDX-License-Identifier: Apache-2.0
"""Signals that simulations can look at: inside the controller, and in the machine around it.

Those of the controller have the names of the register table. The table gives Verilator's list of
public signals and the C++ that reads all of them.
"""

from dataclasses import dataclass

__all__ = ["MEMORY", "PROBES", "Probe", "header", "public"]

SOC, MACHINE = "gapkeeper.soc", "gapkeeper.soc.machine"
MEMORY = "gapkeeper.soc.memory", "ram"


@dataclass(frozen=True)
class Probe:
    """A signal: its name, width and signedness, and where it is.

    ``scope`` is a module of the emitted Verilog; for a signal of the machine it is empty, and
    ``value`` is the C++ that reads it from the plant ``machine``.
    """

    name: str
    bits: int
    signed: bool = False
    scope: str = SOC
    value: str = ""


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
    Probe("power_control_machining", 1),
    Probe("power_level", 6),
    Probe("retraction_control_run", 1),
    Probe("retraction_control_hold", 1),
    Probe("safety_status_safe", 1),
    Probe("safety_latched", 12),
    Probe("event_head_valid", 1),
    Probe("pp", 1, scope=MACHINE),                    # path pulse after the ramp
    Probe("completed", 1, scope=MACHINE),             # the sample that completed a short

    Probe("dac_z", 16, signed=True, scope="",
          value="std::clamp(static_cast<int32_t>(root->gapkeeper__DOT__soc__DOT__axis_z_error), "
                "-32767, 32767)"),
    Probe("gap_mv", 32, signed=True, scope="", value="machine.gap().voltage() * 1000"),
    Probe("gap_width_nm", 32, signed=True, scope="", value="machine.gap().gap_um() * 1000"),
    Probe("motor_z_um_s", 32, signed=True, scope="", value="machine.speed(plant::Z) * 1000"),
)


def public() -> str:
    """Verilator's configuration: the probes can be read, the memory can be written."""
    lines = ["`verilator_config"]
    lines += [f'public_flat_rd -module "{probe.scope}" -var "{probe.name}"' for probe in PROBES
              if probe.scope]
    lines.append(f'public_flat_rw -module "{MEMORY[0]}" -var "{MEMORY[1]}"')
    return "\n".join(lines) + "\n"


def _member(scope, name):
    return "__DOT__".join([*scope.split("."), name])


def _row(probe):
    if probe.scope:
        member = f"root->{_member(probe.scope, probe.name)}"
        value = f"static_cast<int32_t>({member})" if probe.signed else member
    else:
        value = f"static_cast<int64_t>({probe.value})"
    return (f'    {{"{probe.name}", {probe.bits}, [](Vtop___024root* root, '
            f"const plant::Plant& machine) -> int64_t "
            f"{{ (void)root; (void)machine; return {value}; }}}},")


def header() -> str:
    """C++ that reads the probes, from a model flattened under ``Vtop___024root`` and its plant."""
    return "\n".join([
        "struct Probe {", "    const char* name;", "    uint32_t bits;",
        "    int64_t (*read)(Vtop___024root*, const plant::Plant&);", "};",
        "static const Probe PROBES[] = {", *map(_row, PROBES), "};",
        f"#define MEMORY(root) ((root)->{_member(*MEMORY)})", ""])
