// SPDX-License-Identifier: Apache-2.0
// Random numbers that are the same on every machine, from one seed.
#pragma once

#include <cmath>
#include <cstdint>

namespace plant {

// xoshiro256**, seeded through SplitMix64.
// Ref: D. Blackman, S. Vigna, "Scrambled linear pseudorandom number generators", doi
// 10.1145/3460772 (public-domain reference code).
class Random {
public:
    // Streams of one seed are independent, so that one process of the plant does not disturb the
    // draws of another.
    explicit Random(uint64_t seed, uint64_t stream = 0) {
        uint64_t mixed = seed * 0x2545f4914f6cdd1dull + stream;
        for (auto& word : state_) {
            mixed += 0x9e3779b97f4a7c15ull;
            uint64_t z = mixed;
            z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
            z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
            word = z ^ (z >> 31);
        }
    }

    uint64_t bits() {
        const uint64_t result = rotated(state_[1] * 5, 7) * 9;
        const uint64_t shifted = state_[1] << 17;
        state_[2] ^= state_[0];
        state_[3] ^= state_[1];
        state_[1] ^= state_[2];
        state_[0] ^= state_[3];
        state_[2] ^= shifted;
        state_[3] = rotated(state_[3], 45);
        return result;
    }

    // In (0, 1): neither end, so that a logarithm is finite.
    double uniform() { return (static_cast<double>(bits() >> 11) + 0.5) * 0x1p-53; }

    // Mean 1.
    double exponential() { return -std::log(uniform()); }

    // Mean 0, variance 1 (Box and Muller).
    double normal() {
        const double radius = std::sqrt(2 * exponential());
        return radius * std::cos(6.283185307179586 * uniform());
    }

    // Mean 1: sum of `shape` exponential ones.
    double gamma(int shape) {
        double sum = 0;
        for (int i = 0; i < shape; ++i)
            sum += exponential();
        return sum / shape;
    }

private:
    static uint64_t rotated(uint64_t x, int by) { return (x << by) | (x >> (64 - by)); }
    uint64_t state_[4];
};

}  // namespace plant
