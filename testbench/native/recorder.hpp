// SPDX-License-Identifier: Apache-2.0
// Waveforms of a simulation, native or under cocotb: from values of probes to an FST file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace bench {

// The file is written by pylibfst's library, through the addresses of its functions.
class Recorder {
public:
    void open(void* writer, uint64_t time, uint64_t value, uint64_t step) {
        writer_ = writer;
        time_ = reinterpret_cast<void (*)(void*, uint64_t)>(time);
        value_ = reinterpret_cast<void (*)(void*, uint32_t, uint32_t, uint64_t)>(value);
        step_ = step;
    }

    // Adds a signal, some bits of a probe. Call it in the order of the signals in the file.
    void add(uint32_t probe, uint32_t low, uint32_t bits) {
        size_t at = 0;
        while (at < probes_.size() && probes_[at] != probe)
            ++at;
        if (at == probes_.size()) {
            probes_.push_back(probe);
            last_.push_back(0);
            signals_.emplace_back();
        }
        signals_[at].push_back({++handles_, low, bits});
    }

    // Probes whose values are wanted in every clock, each once, in the order of their first signal.
    const std::vector<uint32_t>& probes() const { return probes_; }

    // Their values in a clock. Clocks never go back.
    void take(uint64_t clock, const uint64_t* values) {
        constexpr size_t BLOCK = 8;  // compared without a branch between them
        size_t i = 0;
        if (known_)
            for (; i + BLOCK <= last_.size(); i += BLOCK) {
                uint64_t changed = 0;
                for (size_t j = i; j < i + BLOCK; ++j)
                    changed |= last_[j] ^ values[j];
                if (changed)
                    for (size_t j = i; j < i + BLOCK; ++j)
                        if (last_[j] != values[j])
                            change(j, clock, values[j]);
            }
        for (; i < last_.size(); ++i)
            if (last_[i] != values[i] || !known_)
                change(i, clock, values[i]);
        known_ = true;
    }

private:
    struct Signal {
        uint32_t handle, low, bits;
    };

    void change(size_t at, uint64_t clock, uint64_t value) {
        if (clock != now_ || !known_)
            time_(writer_, clock * step_);
        now_ = clock;
        const uint64_t changed = known_ ? last_[at] ^ value : ~0ull;
        last_[at] = value;
        for (const Signal& signal : signals_[at]) {
            const uint64_t mask = ~0ull >> (64 - signal.bits);
            if (changed >> signal.low & mask)
                value_(writer_, signal.handle, signal.bits, value >> signal.low & mask);
        }
    }

    void* writer_ = nullptr;
    void (*time_)(void*, uint64_t) = nullptr;
    void (*value_)(void*, uint32_t, uint32_t, uint64_t) = nullptr;
    uint64_t step_ = 1;  // of the file's time, per clock
    uint64_t now_ = 0;
    bool known_ = false;    // values have been written
    uint32_t handles_ = 0;  // of signals in the file, from 1 on
    std::vector<uint32_t> probes_;
    std::vector<uint64_t> last_;
    std::vector<std::vector<Signal>> signals_;  // by probe
};

}  // namespace bench
