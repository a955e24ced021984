// SPDX-License-Identifier: Apache-2.0
// Pulse generator and discriminator with a gap that ignites so many clocks after the pin rose.
#include <cstdint>

#include "Vtop.h"
#include "verilated.h"

extern "C" {

// `pulses` has a row of six numbers for each pulse, in the order taken here; the last one is the
// clock of the pin in which the gap ignites. `found` gets a row of three: clocks that the pin was
// high; of these, clocks from the ignition on; and the class, or 4 if no sample came in the clock
// in which the pin was low again. Settings change in the clock after that.
void ignition_run(uint64_t count, const uint32_t* pulses, uint32_t* found) {
    VerilatedContext context;
    Vtop top{&context};
    top.clk = 0;
    top.rst = 1;
    top.eval();
    top.clk = 1;
    top.eval();
    top.rst = 0;
    top.high = 0;
    top.current = 0;
    for (uint64_t n = 0; n < count; ++n, pulses += 6, found += 3) {
        top.on_time = pulses[0] & 0xFFFFF;
        top.wait_time = pulses[1] & 0xFFFFF;
        top.off_time = pulses[2] & 0xFFFFF;
        top.blanking = pulses[3] & 0xFFFF;
        top.use_current = pulses[4] & 1;
        uint32_t length = 0, burnt = 0;
        for (bool over = false; !over;) {
            top.clk = 0;
            top.eval();
            over = length != 0 && !top.pin;
            const bool lit = top.pin && length >= pulses[5];
            top.high = top.pin && !lit;
            top.current = lit;
            length += top.pin;
            burnt += lit;
            top.eval();
            if (over)
                found[2] = top.sample ? top.kind : 4;
            top.clk = 1;
            top.eval();
        }
        found[0] = length;
        found[1] = burnt;
    }
}

}  // extern "C"
