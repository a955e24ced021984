// SPDX-License-Identifier: Apache-2.0
// The serial converter at the controller's pins, and the conductivity cell.
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

// The converter's code for the fluid. The cell, with a resistor parallel to it at its place, forms
// a divider with a resistor at the converter. Fault: 0 none, 1 broken wire, 2 shorted wire.
inline unsigned cell_code(const FluidParameters& p, double ohm_cm, int fault) {
    if (fault != 0)
        return fault == 1 ? CODE_MAX : 0;
    const double fluid = ohm_cm * p.cell_per_cm;
    const double cell = fluid * p.cell_parallel_ohm / (fluid + p.cell_parallel_ohm);
    return code(cell / (cell + p.cell_series_ohm));
}

// 12 bits, 8 channels, frames of 16 clocks, MSB first, like MAX11125 and its family in manual mode
// on an external clock. In the command, bit 15 = 0 and bits 14..11 = 0001 choose manual mode, bits
// 10..7 the channel, and bit 2 puts the channel's number into the upper four bits of results. Other
// commands set functions that are not modelled, and change nothing here. Bits are read at the
// rising edge of the serial clock and written at the falling one, whatever its idle level; the
// first one is written when the converter is selected. Assumed, as no data sheet was at hand: the
// sample is taken at the selection, from the channel that the last whole frame asked for (channel 0
// before any), and the same frame gives it.
class Converter {
public:
    // Called when the select or clock pin has changed. `sample` gives the code of a channel.
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
        } else if (select && !clock) {
            data_ = word_ >> 15;
        } else if (select && bits_ < 16) {
            command_ = static_cast<uint16_t>(command_ << 1 | command);
            word_ = static_cast<uint16_t>(word_ << 1);
            ++bits_;
        }
    }

    bool data() const { return data_; }

private:
    bool select_ = false, data_ = false;
    unsigned bits_ = 0, channel_ = 0;
    uint16_t command_ = 0, word_ = 0;   // so far, and what is left of the result
};

}  // namespace plant
