// SPDX-License-Identifier: Apache-2.0
// The way of the electrode after each short, sampled so finely that times can be read from it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace bench {

// Call `look` in every clock in which `sees` says so. A way begins when the machine comes to rest
// for a short; it ends with the next one, or after so many clocks. `contact`: tool and work truly
// touch.
class Shorts {
public:
    static constexpr size_t COLUMNS = 8;  // see testbench/native/simulation.py

    // A sample every `period` clocks, for `length` clocks.
    void configure(uint64_t period, uint64_t length) {
        period_ = period;
        length_ = length;
    }

    // Whether there is anything to look at.
    bool sees(bool contact, bool stopping) const {
        return contact | contact_ | stopping | stopping_ | active_;
    }

    // `stopping`: the machine comes to rest for a retraction. `path` gives the path coordinate and
    // `place` the coder's count of an axis; both are called only when they are needed.
    template <typename Path, typename Place>
    void look(uint64_t clock, bool contact, bool stopping, bool shorted, Path path, Place place) {
        if (contact && !contact_)
            touched_ = clock;
        contact_ = contact;
        contact_clocks += contact;
        if (stopping && !stopping_ && shorted) {
            ++number_;
            begin_ = clock;
            next_ = clock + period_;
            front_ = path();
            forward_ = active_ = true;
            since_ = contact ? static_cast<double>(touched_) : NONE;
            last_ = NONE;
            put(clock, front_, place);
        } else if (active_) {
            follow(clock, path, place);
        }
        stopping_ = stopping;
    }

    std::vector<double> rows;
    uint64_t contact_clocks = 0;

private:
    template <typename Path, typename Place>
    void follow(uint64_t clock, Path path, Place place) {
        if (forward_) {  // until the first pulse back, in every clock
            const int64_t at = path();
            const auto moved = static_cast<int32_t>(at - front_);  // the coordinate wraps
            forward_ = moved >= 0;
            if (moved > 0) {
                front_ = at;
                last_ = static_cast<double>(clock);
            }
            if (moved < 0)
                put(clock, at, place);
        }
        if (clock < next_)
            return;
        put(clock, path(), place);
        next_ += period_;
        active_ = clock < begin_ + length_;
    }

    template <typename Place>
    void put(uint64_t clock, int64_t path, Place place) {
        const double row[COLUMNS] = {static_cast<double>(number_), static_cast<double>(clock),
                                     static_cast<double>(path), place(0), place(1), place(2),
                                     since_, last_};
        rows.insert(rows.end(), row, row + COLUMNS);
    }

    static constexpr double NONE = -1;

    uint64_t period_ = 1, length_ = 0, begin_ = 0, next_ = 0, number_ = 0, touched_ = 0;
    double since_ = NONE, last_ = NONE;  // clocks: contact of this short; its last pulse forward
    int64_t front_ = 0;
    bool active_ = false, forward_ = false, stopping_ = false, contact_ = false;
};

}  // namespace bench
