// SPDX-License-Identifier: Apache-2.0
// What stands between the controller's pins and the machine: filters and shift registers.
#pragma once

#include <cmath>
#include <cstdint>

namespace plant {

// An RC filter behind a bit stream, in steps of a fixed time.
class Filter {
public:
    void configure(double step_us, double rc_us) { share_ = 1 - std::exp(-step_us / rc_us); }
    // One step, with the mean voltage at the input in it.
    void step(double volts) { volts_ += (volts - volts_) * share_; }
    double volts() const { return volts_; }

private:
    double share_ = 1, volts_ = 0;
};

// A chain of shift registers with output latches, such as 74HC595: it shifts at the rising edge of
// the clock and latches at that of the latch. Bit 0 is the output nearest to the controller. The
// outputs come up at random.
class ShiftRegisters {
public:
    explicit ShiftRegisters(uint32_t outputs = 0) : outputs_(outputs) {}
    void clock(bool serial, bool clock, bool latch) {
        if (clock && !clock_)
            shifted_ = shifted_ << 1 | static_cast<uint32_t>(serial);
        if (latch && !latch_)
            outputs_ = shifted_;
        clock_ = clock;
        latch_ = latch;
    }
    uint32_t outputs() const { return outputs_; }

private:
    bool clock_ = false, latch_ = false;
    uint32_t shifted_ = 0, outputs_;
};

}  // namespace plant
