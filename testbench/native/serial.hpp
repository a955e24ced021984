// SPDX-License-Identifier: Apache-2.0
// The host's end of the serial line: 8 data bits, no parity, 1 stop bit, at a whole number of
// clocks per bit.
#pragma once

#include <cstdint>
#include <deque>

namespace bench {

class Serial {
public:
    explicit Serial(unsigned divisor) : divisor_(divisor) {}

    std::deque<uint8_t> to_send, received;
    uint64_t framing_errors = 0;

    // One clock: the level of tx in it; returns whether a byte has become complete.
    bool take(bool tx) {
        if (bit_ == IDLE) {
            if (!tx) {
                bit_ = 0;
                wait_ = divisor_ + divisor_ / 2 - 1;  // to the middle of the first data bit
            }
            return false;
        }
        if (wait_-- != 0)
            return false;
        wait_ = divisor_ - 1;
        if (bit_ < 8) {
            byte_ = static_cast<uint8_t>(byte_ >> 1 | (tx ? 0x80 : 0));
            ++bit_;
            return false;
        }
        bit_ = IDLE;
        if (!tx) {
            ++framing_errors;
            return false;
        }
        received.push_back(byte_);
        return true;
    }

    // One clock: the level of rx in the next.
    bool give() {
        if (left_ == 0) {
            if (to_send.empty())
                return true;
            frame_ = 0x200u | static_cast<unsigned>(to_send.front()) << 1;
            to_send.pop_front();
            left_ = 10 * divisor_;
            held_ = divisor_;
        } else if (held_ == 0) {
            frame_ >>= 1;
            held_ = divisor_;
        }
        --left_;
        --held_;
        return frame_ & 1;
    }

private:
    static constexpr unsigned IDLE = 15;
    unsigned divisor_;
    unsigned bit_ = IDLE, wait_ = 0;
    uint8_t byte_ = 0;
    unsigned frame_ = 1, left_ = 0, held_ = 0;
};

}  // namespace bench
