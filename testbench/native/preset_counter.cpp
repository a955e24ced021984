// SPDX-License-Identifier: Apache-2.0
// The preset counters alone, with their inputs of every clock in a table.
#include <cstdint>

#include "Vtop.h"
#include "verilated.h"

extern "C" {

// `inputs` has a row of ten numbers for each clock, in the order taken here; the last row holds for
// all later clocks.
// `outputs` gets the outputs of the same clock, before its edge: bits 0 to 5 are up, down, strobe,
// dame_full, open_full and ok_full.
void preset_run(uint64_t clocks, uint64_t rows, const uint32_t* inputs, uint8_t* outputs) {
    VerilatedContext context;
    Vtop top{&context};
    top.clk = 0;
    top.rst = 1;
    top.eval();
    top.clk = 1;
    top.eval();
    top.rst = 0;
    for (uint64_t n = 0; n < clocks; ++n, inputs += n < rows ? 10 : 0) {
        top.sample = inputs[0] & 1;
        top.kind = inputs[1] & 3;
        top.dame = inputs[2] & 0xFF;
        top.open = inputs[3] & 0xFF;
        top.ok = inputs[4] & 0xFF;
        top.mode = inputs[5] & 7;
        top.window = inputs[6] & 0xFF;
        top.weight = inputs[7] & 0xF;
        top.period = inputs[8] & 0xFFFFFF;
        top.freeze = inputs[9] & 1;
        top.clk = 0;
        top.eval();
        outputs[n] = static_cast<uint8_t>(top.up | top.down << 1 | top.strobe << 2 |
                                          top.dame_full << 3 | top.open_full << 4 |
                                          top.ok_full << 5);
        top.clk = 1;
        top.eval();
    }
}

}  // extern "C"
