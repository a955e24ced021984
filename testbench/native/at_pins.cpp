// SPDX-License-Identifier: Apache-2.0
// Switches of the condition, seen from behind the shift registers and filters of a board.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "Vtop.h"
#include "outside.hpp"
#include "verilated.h"

namespace {

constexpr double FULL_V = 100, LEFT = 0.01;
constexpr unsigned SUPPLY_AT = 19;   // its place in the chain
constexpr int REFERENCES = 3;

struct Words {
    unsigned level = 0, on = 0, off = 0, supply = 0;
    unsigned reference[REFERENCES] = {0, 0, 122};   // after reset
};

struct Figures {
    uint64_t switches, skipped, pulses, mixed, sensing, early, longest, longest_latch, shortest,
        clocks;
};

class Bench {
public:
    Bench(uint64_t seed, double clock_us, double rc_us)
        : random_(seed), chain_(static_cast<uint32_t>(random_())),
          ripple_(FULL_V * clock_us / rc_us) {
        for (auto& filter : filters_)
            filter.configure(clock_us, rc_us);
        top_.rst = 1;
        edge();
        top_.rst = 0;
        top_.machining = 1;
        changed({});
    }

    Figures run(uint64_t switches) {
        figures_.shortest = ~0ull;
        for (uint64_t n = 0; n < switches; ++n) {
            stage();
            for (uint64_t wait = phase(); wait; --wait)
                clock();
            top_.commit = 1;
            clock();
            top_.commit = 0;
            while (taken_ == n)
                clock();
            // The next one comes while this one is on its way, or at least a pulse later.
            if (below(4) == 0)
                continue;
            while (first_)
                clock();
        }
        while (first_)
            clock();
        figures_.switches = taken_;
        figures_.skipped -= 1;     // what was in force after reset
        return figures_;
    }

private:
    uint64_t below(uint64_t end) { return random_() % end; }

    // At times of all lengths that matter: a pulse, a frame of the chain, the filters.
    uint64_t phase() {
        static const uint64_t ENDS[] = {8, 600, 5000, 60'000};
        return below(ENDS[below(100) < 5 ? 3 : below(3)]);
    }

    void stage() {
        staged_ = in_force_;
        staged_.level = 1 + static_cast<unsigned>(below(20));
        staged_.on = 20 + static_cast<unsigned>(below(500));
        staged_.off = 1 + static_cast<unsigned>(below(700));
        const uint64_t kind = below(8);
        if (kind & 1)
            staged_.supply = static_cast<unsigned>(below(32));
        if (kind & 2)
            for (auto& level : staged_.reference)
                level = static_cast<unsigned>(below(1024));
        if (kind == 4)
            staged_.reference[below(REFERENCES)] ^= 1;
        top_.level = staged_.level;
        top_.on_time = staged_.on;
        top_.off_time = staged_.off;
        top_.supply_voltage = staged_.supply & 15;
        top_.supply_negative = staged_.supply >> 4;
        top_.reference_open = staged_.reference[0];
        top_.reference_arc = staged_.reference[1];
        top_.reference_short = staged_.reference[2];
    }

    // These words come into force in the next clock.
    void changed(const Words& words) {
        supply_changed_ = words.supply != in_force_.supply;
        reference_changed_ = false;
        for (int i = 0; i < REFERENCES; ++i) {
            const double level = words.reference[i] * FULL_V / 1024;
            if (words.reference[i] != in_force_.reference[i] || figures_.clocks == 0) {
                reference_changed_ = true;
                allowed_[i] = LEFT * std::abs(filters_[i].volts() - level) + ripple_;
            }
            target_[i] = level;
        }
        if (first_)
            ++figures_.skipped;
        waits_ = first_ && waits_ ? waits_ : supply_changed_ || reference_changed_;
        follows_ = first_;
        in_force_ = words;
        first_ = true;
        since_ = figures_.clocks;
    }

    bool whole() const {
        if (top_.gap_level != in_force_.level || !supplied())
            return false;
        for (int i = 0; i < REFERENCES; ++i)
            if (std::abs(filters_[i].volts() - target_[i]) > allowed_[i])
                return false;
        return true;
    }

    bool supplied() const { return (chain_.outputs() >> SUPPLY_AT & 31) == in_force_.supply; }

    void edge() {
        top_.clk = 1;
        top_.eval();
        top_.clk = 0;
        top_.eval();
    }

    void clock() {
        const bool take = top_.take;
        if (take) {
            changed(staged_);
            ++taken_;
        }
        edge();
        ++figures_.clocks;
        chain_.clock(top_.chain & 1, top_.chain >> 1 & 1, top_.chain >> 2 & 1);
        for (int i = 0; i < REFERENCES; ++i)
            filters_[i].step(top_.gap_reference >> i & 1 ? FULL_V : 0);
        if (top_.gap_on)
            discharge();
        else if (on_)
            ended();
        if (top_.gap_sense && !sense_)
            ++figures_.sensing, figures_.early += !supplied();
        on_ = top_.gap_on;
        sense_ = top_.gap_sense;
    }

    void discharge() {
        if (!on_) {
            ++figures_.pulses;
            length_ = 0;
            wanted_ = std::max(1u, in_force_.on);
            poor_ = false;
            const uint64_t waited = figures_.clocks - since_;
            if (first_ && !follows_) {
                auto& longest = reference_changed_ ? figures_.longest : figures_.longest_latch;
                if (waits_)
                    longest = std::max(longest, waited);
                else
                    figures_.shortest = std::min(figures_.shortest, waited);
            }
            first_ = false;
        }
        ++length_;
        poor_ |= !whole();
    }

    // The pins are a clock late: the next words may have been taken by now.
    void ended() { figures_.mixed += poor_ || length_ != wanted_; }

    VerilatedContext context_;
    Vtop top_{&context_};
    std::mt19937_64 random_;
    plant::ShiftRegisters chain_;
    plant::Filter filters_[REFERENCES];
    double ripple_;     // of a first-order modulator: a clock's share of the time constant
    double target_[REFERENCES] = {}, allowed_[REFERENCES] = {};
    Words in_force_, staged_;
    Figures figures_{};
    uint64_t taken_ = 0, since_ = 0, length_ = 0, wanted_ = 0;
    bool first_ = false, follows_ = false, waits_ = false, on_ = false, sense_ = false,
         poor_ = false, supply_changed_ = false, reference_changed_ = false;
};

}  // namespace

extern "C" void at_pins_run(uint64_t switches, uint64_t seed, double clock_us, double rc_us,
                            uint64_t* out) {
    const Figures found = Bench(seed, clock_us, rc_us).run(switches);
    const uint64_t list[] = {found.switches, found.skipped, found.pulses, found.mixed,
                             found.sensing, found.early, found.longest, found.longest_latch,
                             found.shortest, found.clocks};
    std::copy(std::begin(list), std::end(list), out);
}
