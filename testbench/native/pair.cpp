// SPDX-License-Identifier: Apache-2.0
// Two classes of the same controller, clock for clock on the same inputs: Verilator's, and the one
// of native.controller or of native.synthesised.
#include <cstddef>
#include <cstdint>
#include <memory>

#include "Vtop.h"
#include "Vtop___024root.h"
#include "controller.hpp"
#include "pins.hpp"
#include "verilated.h"

#include "pair.inc"  // PINS, PROBES, MEMORY, PARITY: made by testbench/native/pair.py

namespace {

// Verilator's controller, with the methods of the other class.
struct Plain {
    Vtop model;

    uint64_t tx() const { return model.tx; }
#define PIN(name) \
    uint64_t name() const { return model.name; }
    PINS(PIN)
#undef PIN
#define INPUT(name) \
    void set_##name(uint64_t value) { model.name = static_cast<uint8_t>(value); }
    INPUTS(INPUT)
#undef INPUT

    void settle() {
        model.clk = 0;
        model.eval();
    }
    // A falling edge first, for the gate of the processor's clock, then a rising one.
    void edge() {
        settle();
        model.clk = 1;
        model.eval();
    }
};

struct Pair {
    Plain plain;
    Controller driven;
    uint64_t clock = 0;
    const char* name = "";  // of what differs

    void apply(const plant::ToController& to, uint8_t rx) {
        bench::apply(plain, to, rx);
        bench::apply(driven, to, rx);
    }

    bool same() {
        const Vtop___024root* root = plain.model.rootp;
        const auto differ = [this](const char* what, uint64_t one, uint64_t other, uint64_t mask) {
            if ((one & mask) == (other & mask))
                return false;
            name = what;
            return true;
        };
        if (differ("tx", plain.tx(), driven.tx(), ~0ull))
            return false;
#define PIN(what)                                             \
    if (differ(#what, plain.what(), driven.what(), ~0ull)) \
        return false;
        PINS(PIN)
#undef PIN
#define PROBE(what, member, mask)                                      \
    if (differ(#what, root->member, driven.probe_##what(), mask)) \
        return false;
        PROBES(PROBE)
#undef PROBE
        return true;
    }

    // Clocks until something differs, at most to `end`.
    bool run(uint64_t end) {
        while (clock < end) {
            plain.edge();
            driven.edge();
            ++clock;
            if (!same())
                return false;
        }
        return true;
    }
};

}  // namespace

extern "C" {

Pair* pair_create() {
    auto pair = std::make_unique<Pair>();
    pair->apply(plant::ToController{}, 1);
    pair->plain.settle();
    pair->driven.settle();
    return pair.release();
}
void pair_free(Pair* pair) { delete pair; }
void pair_load(Pair* pair, const uint32_t* words, const uint8_t* parities, uint64_t count) {
    for (size_t at = 0; at < count; ++at) {
        MEMORY(pair->plain.model.rootp)[at] = words[at];
        PARITY(pair->plain.model.rootp)[at] = parities[at];
#ifndef LOADED  // which has it as the contents of its block RAMs
        pair->driven.memory()[at] = words[at];
        pair->driven.parity()[at] = parities[at];
#endif
    }
    pair->driven.touch();
    pair->driven.settle();
}
// Runs on the inputs that a session has kept; returns whether all was the same.
int pair_run(Pair* pair, const bench::Inputs* kept, uint64_t count, uint64_t clocks) {
    for (const bench::Inputs* inputs = kept; inputs != kept + count; ++inputs) {
        if (!pair->run(inputs->clock < clocks ? inputs->clock : clocks))
            return 0;
        pair->apply(inputs->to, inputs->rx);
    }
    return pair->run(clocks);
}
uint64_t pair_clock(const Pair* pair) { return pair->clock; }
const char* pair_name(const Pair* pair) { return pair->name; }

}  // extern "C"
