// SPDX-License-Identifier: Apache-2.0
// The supervision of a coder alone, with its inputs of every clock in a table.
#include <cstdint>

#include "Vtop.h"
#include "verilated.h"

extern "C" {

// `inputs` has a row of thirteen numbers a clock, in the order taken here. `outputs` gets what has
// been found, before the edge of the clock.
void supervision_run(uint64_t clocks, const int32_t* inputs, uint8_t* outputs) {
    VerilatedContext context;
    Vtop top{&context};
    top.clk = 0;
    top.rst = 1;
    top.eval();
    top.clk = 1;
    top.eval();
    top.rst = 0;
    for (uint64_t n = 0; n < clocks; ++n, inputs += 13) {
        top.tick = inputs[0];
        top.gain = inputs[1];
        top.size = inputs[2];
        top.negative = inputs[3];
        top.standing = inputs[4];
        top.resting = inputs[5];
        top.fp = inputs[6];
        top.fp_reverse = inputs[7];
        top.a = inputs[8];
        top.b = inputs[9];
        top.coarse = inputs[10];
        top.on = inputs[11];
        top.clear = inputs[12];
        top.clk = 0;
        top.eval();
        outputs[n] = static_cast<uint8_t>(top.check);
        top.clk = 1;
        top.eval();
    }
}

}  // extern "C"
