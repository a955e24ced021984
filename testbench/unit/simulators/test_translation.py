# SPDX-License-Identifier: Apache-2.0
"""The C++ of small netlists beside what they mean, in every clock.

The netlists go through the passes of the controller's. Each stands for one rule, with its meaning
in Python. Their modules' names are those of the controller's, since they decide what is computed
together.
"""

import pytest

from testbench.unit.simulators.translation import CLOCKS, drawn, outputs, translated


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


def test_a_register_that_takes_a_busy_counter_at_times(tmp_path):
    """While its condition holds it is computed in every clock, though nothing else changes."""
    def meaning(rows):
        cycle = stamp = slow = on = run = 0
        for row in rows:
            if on:
                stamp = cycle if run else stamp
                slow = cycle + 3 >> 2 & 255
            cycle = cycle + 1 & 65535
            on, run = row["a"] != 0, row["b"] == 0
            yield stamp, slow

    check(tmp_path, """
module taker(input clk, input on, input run, input [15:0] cycle, output reg [15:0] stamp,
    output reg [7:0] slow);
  initial begin stamp = 0; slow = 0; end
  wire [16:0] more = cycle + 3;
  always @(posedge clk) if (on) begin if (run) stamp <= cycle; slow <= more[9:2]; end
endmodule
module soc(input clk, input [2:0] a, input [2:0] b, output [15:0] stamp, output [7:0] slow);
  reg [15:0] cycle = 0; reg on = 0, run = 0;
  always @(posedge clk) begin cycle <= cycle + 1; on <= a != 0; run <= b == 0; end
  taker taker(clk, on, run, cycle, stamp, slow);
endmodule
module gapkeeper(input clk, input [2:0] a, input [2:0] b, output [15:0] stamp,
    output [7:0] slow);
  soc soc(clk, a, b, stamp, slow);
endmodule
""", ["stamp", "slow"], drawn(6, a=3, b=3), meaning)


def test_a_busy_counter_that_chooses_what_a_register_takes_at_times(tmp_path):
    def meaning(rows):
        cycle = x = go = a = b = 0
        for row in rows:
            x = (a if cycle >> 1 & 1 else b) if go else x
            cycle, go, a, b = cycle + 1 & 65535, row["g"], row["a"], row["b"]
            yield (x,)

    check(tmp_path, """
module taker(input clk, input go, input [7:0] a, input [7:0] b, input [15:0] cycle,
    output reg [7:0] x); initial x = 0;
  always @(posedge clk) if (go) begin if (cycle[1]) x <= a; else x <= b; end
endmodule
module soc(input clk, input g, input [7:0] p, input [7:0] q, output [7:0] x);
  reg [15:0] cycle = 0; reg go = 0; reg [7:0] a = 0, b = 0;
  always @(posedge clk) begin cycle <= cycle + 1; go <= g; a <= p; b <= q; end
  taker taker(clk, go, a, b, cycle, x);
endmodule
module gapkeeper(input clk, input g, input [7:0] a, input [7:0] b, output [7:0] x);
  soc soc(clk, g, a, b, x);
endmodule
""", ["x"], drawn(10, quiet=0.9, g=1, a=8, b=8), meaning)


def test_a_register_whose_condition_is_a_busy_counter(tmp_path):
    def meaning(rows):
        cycle = x = a = 0
        for row in rows:
            x = x + a & 255 if cycle & 15 == 5 else x
            cycle, a = cycle + 1 & 65535, row["a"]
            yield (x,)

    check(tmp_path, """
module timed(input clk, input [15:0] cycle, input [7:0] a, output reg [7:0] x); initial x = 0;
  always @(posedge clk) if (cycle[3:0] == 5) x <= x + a;
endmodule
module soc(input clk, input [7:0] b, output [7:0] x);
  reg [15:0] cycle = 0; reg [7:0] a = 0;
  always @(posedge clk) begin cycle <= cycle + 1; a <= b; end
  timed timed(clk, cycle, a, x);
endmodule
module gapkeeper(input clk, input [7:0] a, output [7:0] x); soc soc(clk, a, x); endmodule
""", ["x"], drawn(9, quiet=0.97, a=8), meaning)


def test_what_follows_from_a_narrow_busy_counter_is_looked_up(tmp_path):
    def meaning(rows):
        left = seen = last = 0
        for row in rows:
            first, middle, late = left == 0, left in (3, 5), left >= 6
            seen = seen + first + 2 * middle + 4 * late & 255
            last = left if middle else last
            left = row["a"] & 7 if row["a"] >> 6 == 0 else left - 1 if left else 7
            yield seen, last

    text = """
module looker(input clk, input [2:0] left, output reg [7:0] seen, output reg [2:0] last);
  initial begin seen = 0; last = 0; end
  wire first = left == 0, middle = left == 3 || left == 5, late = left >= 6;
  always @(posedge clk) begin
    seen <= seen + {late, middle, first}; if (middle) last <= left;
  end
endmodule
module soc(input clk, input [7:0] a, output [7:0] seen, output [2:0] last);
  reg [2:0] cycle = 0; looker looker(clk, cycle, seen, last);
  always @(posedge clk)
    if (a[7:6] == 0) cycle <= a[2:0]; else cycle <= cycle == 0 ? 7 : cycle - 1;
endmodule
module gapkeeper(input clk, input [7:0] a, output [7:0] seen, output [2:0] last);
  soc soc(clk, a, seen, last);
endmodule
"""
    check(tmp_path, text, ["seen", "last"], drawn(7, a=8), meaning)
    made = "".join(path.read_text() for path in tmp_path.glob("parts_*.cpp"))
    assert "constexpr auto t" in made, "a table of comparisons"
    assert "constexpr auto step" in made, "a table of next values"


def test_a_condition_that_ends_is_no_reason_to_compute_but_its_change_counts(tmp_path):
    """Nested conditions, with and without an update in the other branch."""
    def meaning(rows):
        x = y = z = p = q = r = 0
        for row in rows:
            one, two, three = x, y, z
            if p:
                x = two + 1 & 255 if q else three
            else:
                y = row["a"] if q else y
            if r:
                z = one ^ row["a"]
            p, q, r = row["c"] & 1, row["c"] >> 1 & 1, row["c"] >> 2 & 1
            yield x, y, z

    check(tmp_path, """
module gapkeeper(input clk, input [2:0] c, input [7:0] a, output reg [7:0] x, output reg [7:0] y,
    output reg [7:0] z);
  initial begin x = 0; y = 0; z = 0; end
  reg p = 0, q = 0, r = 0;
  always @(posedge clk) begin
    {r, q, p} <= c;
    if (p) x <= q ? y + 1 : z; else if (q) y <= a;
    if (r) z <= x ^ a;
  end
endmodule
""", ["x", "y", "z"], drawn(8, quiet=0.7, c=3, a=8), meaning)


@pytest.mark.parametrize(("bits", "value"), [("r[0] & r[1]", 3), ("~r[0] & ~r[1]", 0)])
def test_two_bits_of_a_register_that_change_together(tmp_path, bits, value):
    """Neither of them alone says when the other one does not matter."""
    def meaning(rows):
        r = 0
        for row in rows:
            yield (r & 3 != value,)
            r = row["a"]

    check(tmp_path, f"""
module first(input clk, input [2:0] a, output reg [2:0] r); initial r = 0;
  always @(posedge clk) r <= a;
endmodule
module second(input clk, input [2:0] r, output y); reg both = 0; assign y = ~both;
  always @(posedge clk) both <= {bits};
endmodule
module gapkeeper(input clk, input [2:0] a, output y);
  wire [2:0] r; first first(clk, a, r); second second(clk, r, y);
endmodule
""", ["y"], drawn(9, quiet=0.5, a=3), meaning)


def test_a_part_whose_register_changes_at_the_clocks_end_has_not_settled(tmp_path):
    """A busy counter sets it off; another part, which comes after it, reads its register."""
    def meaning(rows):
        cycle = d = e = q = 0
        for row in rows:
            cycle, d, e, q = (cycle + 1) % 8, (cycle == 3) & row["a"], \
                ((cycle & 5) == 1) ^ (cycle < 2), d ^ e
            yield not d, not e, not q

    check(tmp_path, """
module first(input clk, input a, input [2:0] t, output x, output y);
  reg d = 0, e = 0; assign x = ~d, y = ~e;
  always @(posedge clk) begin d <= t[0] & a; e <= t[1] ^ t[2]; end
endmodule
module second(input clk, input x, input y, output z); reg q = 0; assign z = ~q;
  always @(posedge clk) q <= x ^ y;
endmodule
module soc(input clk, input a, output x, output y, output z);
  reg [2:0] cycle = 0; always @(posedge clk) cycle <= cycle + 1;
  wire [2:0] t = {cycle < 2, (cycle & 5) == 1, cycle == 3};
  first first(clk, a, t, x, y); second second(clk, x, y, z);
endmodule
module gapkeeper(input clk, input a, output x, output y, output z);
  soc soc(clk, a, x, y, z);
endmodule
""", ["x", "y", "z"], drawn(10, quiet=0.9, a=1), meaning)
    made = "".join(path.read_text() for path in tmp_path.glob("parts_*.cpp"))
    assert "changed = true; s.pending" in made


def test_parities_of_a_narrow_busy_counter(tmp_path):
    """They are looked up, as all that follows from it."""
    def meaning(rows):
        cycle = q = 0
        for row in rows:
            word = cycle * 0x1357 & 0xfffff
            parities = sum((word >> 4 * at & 15).bit_count() % 2 << at for at in range(5))
            cycle, q = cycle + 1 & 31, (parities == 7 or cycle == 3) & row["a"]
            yield (q,)

    check(tmp_path, """
module reader(input clk, input a, input g, input t, output reg q); initial q = 0;
  always @(posedge clk) q <= (g | t) & a;
endmodule
module soc(input clk, input a, output q);
  reg [4:0] cycle = 0; always @(posedge clk) cycle <= cycle + 1;
  wire [19:0] x = cycle * 20'h1357;
  wire [4:0] p = {^x[19:16], ^x[15:12], ^x[11:8], ^x[7:4], ^x[3:0]};
  reader reader(clk, a, p == 7, cycle == 3, q);
endmodule
module gapkeeper(input clk, input a, output q); soc soc(clk, a, q); endmodule
""", ["q"], drawn(11, a=1), meaning)


@pytest.mark.parametrize("bits", [65, 70, 127, 128])
def test_words_wider_than_64_bits(tmp_path, bits):
    """Comparisons with and without a sign, a bit repeated as often, and the parity of a sum."""
    high = bits - 64
    most = (1 << 64) - 1

    def meaning(rows):
        x = z = bit = 0
        for row in rows:
            one, two = (value - (1 << bits) if value >> bits - 1 else value for value in (x, z))
            repeated = ((1 << bits) - 1 if bit else 0) - x & (1 << bits) - 1
            parity = (x + z & (1 << bits) - 1).bit_count() % 2
            yield one < two, x < z, one >= two, x >= z, repeated & most, repeated >> 64, parity
            x, z = (row[f"{name}h"] << 64 | row[f"{name}l"] for name in "xz")
            bit = row["b"]

    inputs = drawn(bits, xh=high, xl=64, zh=high, zl=64, b=1)
    for row in inputs[::2]:     # equal but for the highest bit, sometimes, and the lowest
        row |= {"zh": row["xh"] ^ row["b"] << high - 1, "zl": row["xl"] ^ 1}
    check(tmp_path, f"""
module gapkeeper(input clk, input [{high - 1}:0] xh, input [63:0] xl, input [{high - 1}:0] zh,
    input [63:0] zl, input b, output reg l, output reg ul, output reg g, output reg ug,
    output reg [63:0] rl, output reg [{high - 1}:0] rh, output reg p);
  initial begin l = 0; ul = 0; g = 0; ug = 0; rl = 0; rh = 0; p = 0; end
  reg [{bits - 1}:0] x = 0, z = 0; reg n = 0; wire [{bits - 1}:0] sum = x + z;
  always @(posedge clk) begin
    x <= {{xh, xl}}; z <= {{zh, zl}}; n <= b;
    l <= $signed(x) < $signed(z); ul <= x < z; g <= $signed(x) >= $signed(z); ug <= x >= z;
    {{rh, rl}} <= {{{bits}{{n}}}} - x; p <= ^sum;
  end
endmodule
""", ["l", "ul", "g", "ug", "rl", "rh", "p"], inputs, meaning)
