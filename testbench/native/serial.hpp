// SPDX-License-Identifier: Apache-2.0
// The host's end of the serial line: 8 data bits, no parity, 1 stop bit, at a whole number of
// clocks per bit. Bytes on their way to the controller may be damaged.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "random.hpp"

namespace bench {

constexpr unsigned BROKEN = 0x100;  // flag of a byte that is sent without its stop bit

// Damage of a byte: one bit is inverted, it is lost, comes twice, or has no stop bit.
enum Harm { BENT, DROPPED, DOUBLED, UNSTOPPED, HARMS };

struct Hit {
    unsigned harm, sent, came;
};

class Serial {
public:
    explicit Serial(unsigned divisor) : divisor_(divisor) {}

    std::deque<uint16_t> to_send;
    std::deque<uint8_t> received;
    uint64_t framing_errors = 0;
    std::vector<Hit> hits;

    // From now on these shares of the bytes are damaged, by kind.
    void damage(uint64_t seed, const double* shares) {
        random_ = plant::Random(seed);
        for (unsigned harm = 0; harm < HARMS; ++harm)
            shares_[harm] = shares[harm];
    }

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
            const unsigned next = harmed();
            if (next == NOTHING)
                return true;
            // After a missing stop bit the line is high for a bit, so that the next start shows.
            const bool stops = !(next & BROKEN);
            frame_ = (stops ? 0x200u : 0x400u) | (next & 0xff) << 1;
            left_ = (stops ? 10 : 11) * divisor_;
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
    static constexpr unsigned NOTHING = ~0u;

    // The next byte to be sent, after any damage.
    unsigned harmed() {
        while (!to_send.empty()) {
            const unsigned sent = to_send.front();
            to_send.pop_front();
            const unsigned harm = draw();
            if (harm == HARMS)
                return sent;
            const unsigned came = harm == BENT ? sent ^ 1u << (random_.bits() >> 61) : sent;
            hits.push_back({harm, sent, came});
            if (harm == DOUBLED)
                to_send.push_front(static_cast<uint16_t>(sent));
            if (harm != DROPPED)
                return harm == UNSTOPPED ? came | BROKEN : came;
        }
        return NOTHING;
    }

    unsigned draw() {
        if (shares_[BENT] + shares_[DROPPED] + shares_[DOUBLED] + shares_[UNSTOPPED] == 0)
            return HARMS;
        double left = random_.uniform();
        for (unsigned harm = 0; harm < HARMS; ++harm) {
            left -= shares_[harm];
            if (left < 0)
                return harm;
        }
        return HARMS;
    }

    unsigned divisor_;
    unsigned bit_ = IDLE, wait_ = 0;
    uint8_t byte_ = 0;
    unsigned frame_ = 1, left_ = 0, held_ = 0;
    double shares_[HARMS] = {};
    plant::Random random_{0};
};

}  // namespace bench
