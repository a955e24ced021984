// SPDX-License-Identifier: Apache-2.0
// The velocity converter alone, at a constant magnitude.
#include <cstdint>

#include "Vtop.h"
#include "verilated.h"

extern "C" void dac_run(uint64_t clocks, uint32_t magnitude, uint8_t* pulses) {
    VerilatedContext context;
    Vtop top{&context};
    top.clk = 0;
    top.rst = 1;
    top.eval();
    top.clk = 1;
    top.eval();
    top.rst = 0;
    top.magnitude = magnitude & 0x7FFF;
    for (uint64_t n = 0; n < clocks; ++n) {
        top.clk = 0;
        top.eval();
        pulses[n] = top.pulse;
        top.clk = 1;
        top.eval();
    }
}
