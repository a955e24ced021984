# SPDX-License-Identifier: Apache-2.0
"""Models of two ECP5 cells that Yosys knows by their ports only: block RAM and multiplier.

They follow what Yosys promises itself of these cells when it maps a memory or a product onto them:
the contents' order, the byte enables on the lowest address bits, the reset of the output register.
Written from Lattice's ECP5 memory usage guide (FPGA-TN-02204) and sysDSP guide (FPGA-TN-02205); no
model of the maker's is used. The other cells have models in Yosys.
"""

__all__ = ["models"]

ROW = 36        # bits of the widest access; a block RAM has 512 of them
BITS = 18       # data pins of one port


def _pins(prefix: str, count: int) -> list[str]:
    return [f"{prefix}{index}" for index in range(count)]


def _joined(names: list[str]) -> str:
    return "{" + ", ".join(reversed(names)) + "}"


def _block_ram() -> str:
    """Verilog of ``DP16KD``: 512 rows of 36 bits behind two ports.

    A port of 1, 2 or 4 bits uses eight of each nine bits. With 36 bits port A only writes and port
    B only reads, and each has the upper half of its row on the data pins of the other.
    """
    starts = [f"INITVAL_{index:02X}" for index in range(64)]
    ports, wires, logic = [], [], []
    for side in "AB":
        data, out, address = (_pins(f"{kind}{side}", count)
                              for kind, count in (("DI", BITS), ("DO", BITS), ("AD", 14)))
        controls = [f"{name}{side}" for name in ("CE", "OCE", "CLK", "WE", "RST")]
        chosen = _pins(f"CS{side}", 3)
        ports += [f"  input {', '.join(data + address + controls + chosen)},",
                  f"  output {', '.join(out)},"]
        wires += [f"  wire [17:0] di_{side} = {_joined(data)};",
                  f"  wire [13:0] ad_{side} = {_joined(address)};"]
        logic += [f"""
  wire [8:0] place_{side} = ad_{side}[13:5];
  wire clock_{side} = CLK{side}MUX == "INV" ? ~CLK{side} : CLK{side};
  wire [{ROW - 1}:0] row_{side} = rows[place_{side}];
  // Where the bits of an access begin in their row, by its width: nine to a place, eight if narrow.
  wire [5:0] nines_{side} = {{1'b0, ad_{side}[4:3], 3'b0}} + {{4'b0, ad_{side}[4:3]}};
  wire [5:0] first_{side} =
      DATA_WIDTH_{side} == 36 ? 6'd0 :
      DATA_WIDTH_{side} == 18 ? (ad_{side}[4] ? 6'd18 : 6'd0) :
      DATA_WIDTH_{side} == 9 ? nines_{side} :
      nines_{side} + (DATA_WIDTH_{side} == 4 ? {{3'b0, ad_{side}[2], 2'b0}} :
                      DATA_WIDTH_{side} == 2 ? {{3'b0, ad_{side}[2:1], 1'b0}} :
                      {{3'b0, ad_{side}[2:0]}});
  wire [{ROW - 1}:0] bits_{side} =
      DATA_WIDTH_{side} == 36 ? {{{{9{{ad_{side}[3]}}}}, {{9{{ad_{side}[2]}}}},
                               {{9{{ad_{side}[1]}}}}, {{9{{ad_{side}[0]}}}}}} :
      DATA_WIDTH_{side} == 18 ? {{18'b0, {{9{{ad_{side}[1]}}}}, {{9{{ad_{side}[0]}}}}}} :
      (36'b1 << DATA_WIDTH_{side}) - 36'b1;
  wire [{ROW - 1}:0] wide_{side} = {{di_B, di_A}};
  wire [{ROW - 1}:0] data_{side} =
      DATA_WIDTH_{side} == 36 ? wide_{side} : {{18'b0, di_{side}}} << first_{side};
  wire [{ROW - 1}:0] mask_{side} = bits_{side} << first_{side};
  wire [{ROW - 1}:0] shown_{side} = DATA_WIDTH_{side} >= 18 ? {{{ROW}{{1'b1}}}} : bits_{side};
  wire [{ROW - 1}:0] read_{side} = (row_{side} >>> first_{side}) & shown_{side};
  wire writes_{side} = CE{side} & WE{side};
  wire [{ROW - 1}:0] written_{side} = (row_{side} & ~mask_{side}) | (data_{side} & mask_{side});
  always @(posedge clock_{side})
    if (writes_{side}) rows[place_{side}] <= written_{side};
  reg [{ROW - 1}:0] out_{side} = 0;
  always @(posedge clock_{side})
    if (RST{side}) out_{side} <= 0;
    else if (CE{side} & (~WE{side} | WRITEMODE_{side} == "READBEFOREWRITE"))
      out_{side} <= read_{side};
    else if (CE{side} & WRITEMODE_{side} == "WRITETHROUGH") out_{side} <= di_{side};"""]
    out_a, out_b = _joined(_pins("DOA", BITS)), _joined(_pins("DOB", BITS))
    outputs = f"""
  assign {out_a} = DATA_WIDTH_B == 36 ? out_B[17:0] : out_A[17:0];
  assign {out_b} = DATA_WIDTH_B == 36 ? out_B[35:18] : out_B[17:0];"""
    contents = [f"    for (i = 0; i < 8; i = i + 1) rows[{index * 8} + i] = "
                f"{{{name}[40 * i + 20 +: 18], {name}[40 * i +: 18]}};"
                for index, name in enumerate(starts)]
    ports[-1] = ports[-1].rstrip(",")
    return "\n".join([
        "module DP16KD(", *ports, ");",
        *(f"  parameter [319:0] {name} = 320'b0;" for name in starts),
        *(f"  parameter {name}_{side} = {value};" for side in "AB" for name, value in (
            ("DATA_WIDTH", 18), ("REGMODE", '"NOREG"'), ("CSDECODE", '"0b000"'),
            ("WRITEMODE", '"NORMAL"'))),
        '  parameter CLKAMUX = "CLKA", CLKBMUX = "CLKB", RESETMODE = "SYNC",',
        '      ASYNC_RESET_RELEASE = "SYNC", GSR = "AUTO";',
        f"  reg [{ROW - 1}:0] rows [0:511];", "  integer i;", "  initial begin",
        *contents, "  end", *wires, *logic, outputs, "endmodule", ""])


def _multiplier() -> str:
    """Verilog of ``MULT18X18D`` without registers: a product of 18 by 18 bits."""
    a, b, p = _pins("A", BITS), _pins("B", BITS), _pins("P", 2 * BITS)
    unused = _pins("C", BITS) + ["SOURCEA", "SOURCEB"]
    return f"""module MULT18X18D(
  input {', '.join(a + b + unused)}, SIGNEDA, SIGNEDB,
  output {', '.join(p)});
  wire signed [18:0] a = {{SIGNEDA & A17, {_joined(a)[1:]};
  wire signed [18:0] b = {{SIGNEDB & B17, {_joined(b)[1:]};
  wire signed [35:0] p = a * b;
  assign {_joined(p)} = p;
endmodule
"""


def models() -> str:
    """Verilog of both."""
    return _block_ram() + _multiplier()
