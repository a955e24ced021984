// SPDX-License-Identifier: Apache-2.0
// The surroundings of the controller in every simulation: the machine and the host's serial line.
#pragma once

#include <algorithm>
#include <cstdint>

#include "plant.hpp"
#include "serial.hpp"

namespace bench {

constexpr unsigned DIVISOR = 8;  // softcore.top.SIMULATED_DIVISOR

// After a byte the caller waits for a pause on the line, so that it gets whole lines; but no longer
// than this.
constexpr uint64_t PAUSE = 12 * DIVISOR;
constexpr size_t ENOUGH = 256;

class Station {
public:
    explicit Station(uint64_t seed) : machine(seed), serial(DIVISOR) {}

    plant::Plant machine;
    Serial serial;
    uint64_t clock = 0;    // clocks so far
    uint64_t stop_at = 0;  // the caller gets control back here

    // Runs for a number of clocks, or until the controller has sent something.
    void arm(uint64_t clocks, bool until_byte) {
        limit_ = clock + clocks;
        until_byte_ = until_byte;
        stop_at = limit_;
        if (until_byte && !serial.received.empty())
            said();
    }

    // One clock: the controller's outputs in it, its inputs in the next. This is the order of a
    // nonblocking assignment at the clock edge, in both simulations. Returns whether the inputs
    // besides rx may have changed.
    [[gnu::always_inline]] bool step(const plant::FromController& from, bool tx,
                                     plant::ToController& to, uint8_t& rx) {
        const bool changed = machine.clock(from, to);
        rx = serial.give();
        ++clock;
        if (serial.take(tx) && until_byte_)
            said();
        return changed;
    }

private:
    void said() {
        const uint64_t pause = serial.received.size() < ENOUGH ? PAUSE : 0;
        stop_at = std::min(limit_, clock + pause);
    }

    uint64_t limit_ = 0;
    bool until_byte_ = false;
};

}  // namespace bench
