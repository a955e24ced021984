// SPDX-License-Identifier: Apache-2.0
// The lines of the pulse coders on their way to the controller, and their faults.
#pragma once

#include <cmath>
#include <cstdint>

#include "random.hpp"

namespace plant {

// Masks by axis, X lowest.
struct CoderForces {
    double cut = 0;                      // both phases keep their level
    double jump = 0;                     // both phases are inverted: they change together
    double a_low = 0, a_high = 0, b_low = 0, b_high = 0;  // a phase is stuck
    double swap = 0;                     // the phases are exchanged
    double open = 0;                     // the plug is off: the receivers pull up, A first
    double a_noise = 0;                  // phase A is lost, and its line picks up edges,
    double noise_hz = 10e3;              // with this mean rate
    double index_cut = 0, index_high = 0;   // the line of the index is low, or high
};

class CoderLines {
public:
    explicit CoderLines(uint64_t seed) : random_(seed, 6) {}

    CoderForces force;

    void configure(double clock_hz) {
        auto mask = [](double value) { return static_cast<unsigned>(value); };
        cut_ = mask(force.cut);
        jump_ = mask(force.jump);
        swap_ = mask(force.swap);
        noise_ = mask(force.a_noise);
        if (const unsigned open = mask(force.open); open != open_) {
            open_ = open;
            until_ = static_cast<unsigned>(LATE_US * 1e-6 * clock_hz);
        }
        a_low_ = mask(force.a_low);
        b_low_ = mask(force.b_low);
        a_high_ = mask(force.a_high) | open_;
        b_high_ = mask(force.b_high);
        index_cut_ = mask(force.index_cut);
        index_high_ = mask(force.index_high);
        mean_clocks_ = clock_hz / force.noise_hz;
        sound_ = !(cut_ | jump_ | swap_ | noise_ | open_ | a_low_ | b_low_ | a_high_ | b_high_);
    }

    bool sound() const { return sound_; }

    // One clock: from the phases at the coders to the lines; a cut line keeps its level.
    void clock(unsigned a, unsigned b, uint8_t& line_a, uint8_t& line_b) {
        if (!sound_)
            damage(a, b);
        line_a = static_cast<uint8_t>((a & ~cut_) | (line_a & cut_));
        line_b = static_cast<uint8_t>((b & ~cut_) | (line_b & cut_));
    }

    uint8_t index(unsigned level) const {
        return static_cast<uint8_t>((level & ~index_cut_) | index_high_);
    }

private:
    static constexpr double LATE_US = 10;  // from one line of an open plug to the other

    void damage(unsigned& a, unsigned& b) {
        const unsigned crossed = (a ^ b) & swap_;
        a ^= crossed ^ jump_;
        b ^= crossed ^ jump_;
        if (noise_ && --edge_ <= 0) {
            edge_ = mean_clocks_ * random_.exponential();
            picked_ ^= 1;
        }
        a = (a & ~noise_) | (picked_ ? noise_ : 0);
        if (until_)
            --until_;
        a = (a | a_high_) & ~a_low_;
        b = (b | b_high_ | (until_ ? 0 : open_)) & ~b_low_;
    }

    Random random_;
    unsigned cut_ = 0, jump_ = 0, swap_ = 0, noise_ = 0, open_ = 0;
    unsigned a_low_ = 0, a_high_ = 0, b_low_ = 0, b_high_ = 0;
    unsigned index_cut_ = 0, index_high_ = 0;
    unsigned until_ = 0, picked_ = 0;
    double mean_clocks_ = 200, edge_ = 0;
    bool sound_ = true;
};

}  // namespace plant
