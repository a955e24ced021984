// SPDX-License-Identifier: Apache-2.0
// The electronic gear alone, with the counter that it serves, under random pulses.
#include <cstdint>
#include <random>

#include "Vtop.h"
#include "verilated.h"

namespace {

// What the steps are to be, from the count of pulses alone: P n/m, to the nearest, a half upwards.
int64_t steps_of(int64_t pulses, int64_t n, int64_t m) {
    const int64_t sum = pulses * n + m / 2;
    return sum >= 0 ? sum / m : -((-sum + m - 1) / m);
}

// Clocks for which a pin has had its level, and whether the pins keep the times of the drive.
struct Pins {
    uint64_t step_for = 1000, dir_for = 1000, fell_for = 1000;
    bool step = false, dir = false;

    bool clock(bool next_step, bool next_dir, uint64_t width, uint64_t space, uint64_t setup) {
        bool good = true;
        if (next_dir != dir) {
            good &= !step && !next_step && fell_for >= space;
            dir_for = 0;
        }
        if (next_step != step) {
            good &= step_for >= (step ? width : space);
            good &= !next_step || (dir_for >= setup && next_dir == dir);
            if (step)
                fell_for = 0;
            step_for = 0;
        }
        step = next_step;
        dir = next_dir;
        ++step_for;
        ++dir_for;
        ++fell_for;
        return good;
    }
};

}  // namespace

extern "C" {

// Takes `pulses` pulses, with random reversals, through the gear n/m. `found` gets the pulses taken,
// reversals of the steps, clocks, clocks with a wrong count, clocks with a wrong time, and the first
// clock with either.
void gear_run(uint32_t n, uint32_t m, uint64_t pulses, uint32_t seed, uint64_t* found) {
    VerilatedContext context;
    Vtop top{&context};
    std::mt19937 random(seed);
    const uint32_t width = 1 + random() % 4, space = 1 + random() % 4, setup = 1 + random() % 6;
    top.clk = 0;
    top.rst = 1;
    top.eval();
    top.clk = 1;
    top.eval();
    top.rst = 0;
    top.steps = n;
    top.surplus = m - n;
    top.width = width;
    top.space = space;
    top.setup = setup;
    Pins pins;
    int64_t held = 0, taken = 0, sent = 0, last = 0;
    int way = 1;
    uint64_t count = 0, clock = 0;
    for (unsigned i = 0; i < 6; ++i)
        found[i] = 0;
    for (; count < pulses; ++clock) {
        top.clear = clock == 0;
        top.pending = held != 0;
        top.negative = held < 0;
        top.safe = random() % 4096 == 0;
        top.clk = 0;
        top.eval();
        const int fp = top.fp ? (top.fp_reverse ? -1 : 1) : 0;
        // The pulse of this clock and the step that begins in it belong together.
        taken += fp;
        count += fp != 0;
        const bool was = pins.step;
        const bool timely = top.safe || pins.clock(top.step, top.dir, width, space, setup);
        if (top.safe) {         // it may cut a pulse short: times begin again
            pins = Pins{1000, 1000, 0, static_cast<bool>(top.step), static_cast<bool>(top.dir)};
        }
        if (top.step && !was) {
            const int64_t one = top.dir ? -1 : 1;
            sent += one;
            found[1] += last == -one;
            last = one;
        }
        const bool right = sent == steps_of(taken, n, m);
        found[3] += !right;
        found[4] += !timely;
        if ((!right || !timely) && !found[5])
            found[5] = clock;
        if (random() % (random() % 64 ? 512 : 16) == 0)
            way = -way;
        held -= fp;
        if (random() % 3 == 0 && held < 1000 && held > -1000)
            held += way;
        top.clk = 1;
        top.eval();
    }
    found[0] = count;
    found[2] = clock;
}

}  // extern "C"
