// SPDX-License-Identifier: Apache-2.0
// The serial converter at the controller's pins, and the cell that measures the fluid.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "parameters.hpp"

namespace plant {

constexpr int CODE_MAX = 4095;  // of 12 bits

inline unsigned code(double share) {
    return static_cast<unsigned>(std::lround(CODE_MAX * std::clamp(share, 0.0, 1.0)));
}

// What the converter reads of the fluid: a divider of the cell, with a resistor parallel to it where
// it is, and a resistor at the converter. Fault: 0 none, 1 broken wire, 2 shorted one.
inline unsigned cell_code(const FluidParameters& p, double ohm_cm, int fault) {
    if (fault != 0)
        return fault == 1 ? CODE_MAX : 0;
    const double fluid = ohm_cm * p.cell_per_cm;
    const double cell = fluid * p.cell_parallel_ohm / (fluid + p.cell_parallel_ohm);
    return code(cell / (cell + p.cell_series_ohm));
}

// 12 bits, 8 channels, frames of 16 clocks, MSB first, as MAX11125 and its family do it in manual
// mode on an external clock: of the command, bit 15 = 0 and 14..11 = 0001 choose manual mode,
// 10..7 the channel, bit 2 that results carry its number in their upper four bits. Other commands
// set what is not modelled, and change nothing here. Bits are taken at the rising edge of the
// serial clock and given at the falling one, whichever its level at rest; the first one is there
// when the converter is selected. Assumed, as no data sheet was at hand: the sample is taken when
// the converter is selected, of the channel that the last whole frame asked for, and it is this
// frame that gives it; channel 0 before any.
class Converter {
public:
    // Where the select or clock pin has changed. `sample` gives the code of a channel.
    template <class Sample>
    void change(bool select, bool clock, bool command, const Sample& sample) {
        if (select != select_) {
            select_ = select;
            if (select) {
                bits_ = 0;
                word_ = static_cast<uint16_t>(channel_ << 12 | sample(channel_));
                data_ = word_ >> 15;
            } else {
                if (bits_ == 16 && (command_ & 0xf804) == 0x0804)
                    channel_ = command_ >> 7 & 15;
                data_ = false;
            }
        } else if (select && clock && bits_ < 16) {
            command_ = static_cast<uint16_t>(command_ << 1 | command);
            ++bits_;
        } else if (select && !clock) {
            data_ = bits_ < 16 && (word_ >> (15 - bits_) & 1);
        }
    }

    bool data() const { return data_; }

private:
    bool select_ = false, data_ = false;
    unsigned bits_ = 0, channel_ = 0;
    uint16_t command_ = 0, word_ = 0;
};

}  // namespace plant
