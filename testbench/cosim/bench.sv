// SPDX-License-Identifier: Apache-2.0
// Top of the cocotb simulation: the clock, the controller, and its station in C++.
`timescale 1ns / 1ps

module bench;
  // One clock of the station: the controller's outputs in it give its inputs in the next. Bit 63
  // of the result says that Python wants control back.
  import "DPI-C" function longint unsigned bench_clock(input longint unsigned from);
  import "DPI-C" function longint unsigned bench_begin();
  // What Python watches, by 64 probes in a word, and one value of it in this clock. They are
  // arguments, so that they are read before the edge changes them.
  import "DPI-C" function longint unsigned bench_watched(input int word);
  import "DPI-C" function void bench_probe(input int index, input longint unsigned value);

  bit clk = 0;
  bit stopped /* verilator public_flat_rd */ = 0;  // changes where Python gets control back
  string firmware, parity;

  longint unsigned to, result, watched;
  wire [2:0] dac, dac_negative, step, dir, drive_enable, auxiliary_strobe;
  wire [5:0] gap_level;
  wire [4:0] gap_supply;
  wire [2:0] gap_reference;
  wire [15:0] auxiliary_code;
  wire gap_on, gap_sense, contactor, adc_select, adc_clock, adc_command, safe, tx;
  wire flash_select, flash_clock, flash_command;

  gapkeeper controller(
    .clk(clk), .tx(tx), .rx(to[0]),
    .enc_a(to[3:1]), .enc_b(to[6:4]), .enc_index(to[30:28]),
    .gap_high(to[7]), .gap_arc(to[8]), .gap_short(to[9]), .gap_current(to[10]),
    .estop(to[11]), .fluid_low(to[12]), .fin(to[13]),
    .drive_fault(to[16:14]), .limit_low(to[19:17]), .limit_high(to[22:20]),
    .gap_noise(to[23]), .adc_data(to[24]), .arm(to[25]), .power_good(to[26]), .flash_data(to[27]),
    .dac(dac), .dac_negative(dac_negative), .step(step), .dir(dir), .drive_enable(drive_enable),
    .contactor(contactor), .gap_on(gap_on), .gap_level(gap_level), .gap_sense(gap_sense),
    .gap_reference(gap_reference), .gap_supply(gap_supply),
    .adc_select(adc_select), .adc_clock(adc_clock), .adc_command(adc_command),
    .flash_select(flash_select), .flash_clock(flash_clock), .flash_command(flash_command),
    .auxiliary_code(auxiliary_code), .auxiliary_strobe(auxiliary_strobe), .safe(safe));

  wire [63:0] from = {5'b0, flash_command, flash_clock, flash_select, contactor, adc_command, adc_clock, adc_select, gap_supply, gap_reference, tx, safe,
                      auxiliary_code, auxiliary_strobe, gap_level, gap_sense, gap_on, drive_enable,
                      dir, step, dac_negative, dac};

  initial begin
    to = bench_begin();
    #1;  // after the memory's own initial values
    if (!$value$plusargs("firmware=%s", firmware)) $fatal(1, "there is no +firmware=");
    if (!$value$plusargs("parity=%s", parity)) $fatal(1, "there is no +parity=");
    $readmemh(firmware, controller.soc.memory.ram);
    $readmemh(parity, controller.soc.memory.parity);
    #19;
    forever #5 clk = ~clk;
  end

  always @(posedge clk) begin
    `include "probes.svh"
    result = bench_clock(from);
    to <= result;
    if (result[63]) stopped <= ~stopped;
  end
endmodule
