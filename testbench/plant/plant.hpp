// SPDX-License-Identifier: Apache-2.0
// The simulated machine at the other end of the controller's pins.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "coder.hpp"
#include "converter.hpp"
#include "flash.hpp"
#include "motor.hpp"
#include "outside.hpp"
#include "parameters.hpp"
#include "sinker.hpp"
#include "wire_gap.hpp"

namespace plant {

constexpr int AXES = 3;  // X, Y, Z: bit 0, 1, 2 of every vector
constexpr int Z = 2;     // carries the electrode; stands on a wire machine

// Names and widths are those of rtl/pads.py.
struct FromController {
    uint8_t dac = 0, dac_negative = 0, step = 0, dir = 0, drive_enable = 0;
    uint8_t gap_on = 0, gap_sense = 0, gap_level = 0;
    uint8_t gap_reference = 0, gap_supply = 0, adc_select = 0, adc_clock = 0, adc_command = 0;
    uint8_t contactor = 0, auxiliary_strobe = 0, safe = 1;
    uint8_t flash_select = 0, flash_clock = 0, flash_command = 0;
    uint16_t auxiliary_code = 0;
};

struct ToController {
    uint8_t enc_a = 0, enc_b = 0, enc_index = 0;
    uint8_t gap_high = 0, gap_arc = 1, gap_short = 1, gap_current = 0, gap_noise = 0;
    uint8_t adc_data = 0, flash_data = 1;
    uint8_t estop = 0, drive_fault = 0, limit_low = 0, limit_high = 0, fluid_low = 0, fin = 0;
    uint8_t arm = 0, power_good = 1;
};

// An auxiliary function that the machine side has seen.
struct Auxiliary {
    uint64_t clock;
    uint32_t strobe, code;
};

class Plant {
public:
    explicit Plant(uint64_t seed);
    Plant(const Plant&) = delete;  // the table of names points into it

    // Parameters, forces and readings share one set of names: `gap.area_mm2`, `force.short`,
    // `read.depth_um`. A reading cannot be set. Parameters must be set before the first clock.
    bool set(const std::string& name, double value);
    bool get(const std::string& name, double& value);

    // One clock: from the controller's outputs in it to its inputs in the next. The inputs keep their
    // values from clock to clock. Returns whether any may have changed.
    bool clock(const FromController& from, ToController& to) {
        up_ += SPREAD[from.dac & ~from.dac_negative];
        down_ += SPREAD[from.dac & from.dac_negative];
        references_ += SPREAD[from.gap_reference];
        if (from.step != step_)
            steps(from);
        bool turned = !lines_.sound() || configured_;
        if (!still_)
            for (auto& axis : axes_)
                turned |= axis.clock();
        gates(from);
        bool changed = turned;
        const unsigned serial = from.adc_select | static_cast<unsigned>(from.adc_clock) << 1;
        if (serial != serial_) {
            serial_ = serial;
            converter_.change(from.adc_select, from.adc_clock, from.adc_command,
                              [this](unsigned channel) { return sample(channel); });
            to.adc_data = converter_.data() && force_converter_silent_ == 0;
            changed = true;
        }
        const unsigned memory = from.flash_select | static_cast<unsigned>(from.flash_clock) << 1;
        if (memory != memory_) {
            memory_ = memory;
            flash_.pins(from.flash_select, from.flash_clock, from.flash_command, now_);
            to.flash_data = flash_.data() || force_flash_absent_ != 0;
            changed = true;
        }
        if (++phase_ == clocks_per_tick_ || configured_) {
            if (phase_ == clocks_per_tick_)
                tick(from);
            sides(to);
            configured_ = false;
            changed = true;
        }
        if (turned)
            coders(to);
        const unsigned lines = (gap_->lines() | wires_cut_) & ~wires_dead_;
        if (lines != compared_) {
            compared_ = lines;
            to.gap_short = lines & Gap::SHORT ? 1 : 0;
            to.gap_current = lines & Gap::CURRENT ? 1 : 0;
            to.gap_arc = lines & Gap::ARC ? 1 : 0;
            to.gap_high = lines & Gap::HIGH ? 1 : 0;
            to.gap_noise = lines & Gap::NOISE ? 1 : 0;
            changed = true;
        }
        ++now_;
        return changed;
    }

    void close_contactor() { powered_ = true; }  // at once, for tests of the gap alone
    int32_t count(int axis) const { return axes_[axis].count(); }
    double speed(int axis) const { return axes_[axis].speed(); }      // mm/s
    double command(int axis) const { return axes_[axis].command(); }  // mm/s, behind the filter
    Flash& flash() { return flash_; }
    const Gap& gap() const { return *gap_; }
    bool contact() const { return contact_; }   // of tool and work, as at the last tick
    // Levels of the comparators behind their filters: open, arc, short.
    double reference_v(int which) const { return filters_[which].volts(); }
    Workpiece& workpiece() { return wire_.workpiece(); }  // a wire machine's
    const Cavity& cavity() const { return sinker_.cavity(); }  // of a sinker with sides
    void keep_discharges() { sinker_.keep_discharges(); }
    // The cavity that the kept discharges make with other numbers by name, as in `set`.
    Cavity cavity_with(const std::map<std::string, double>& numbers) const;
    uint64_t now() const { return now_; }
    const std::vector<Auxiliary>& auxiliaries() const { return auxiliaries_; }

private:
    // A limit switch: where it is pressed the next time, as a share of its scatter.
    struct Switch {
        bool pressed = false;
        double share = 0;
    };

    void configure();
    void catch_up();
    void tick(const FromController& from);
    void side(const FromController& from);
    void contactor(bool coil);
    void limits();
    bool presses(Switch& one, double beyond_um);
    void faults();
    void levels();
    double electrode_um() const;
    unsigned sample(unsigned channel) const;

    // The gates as the sources have them. A stuck gate stays on, at its last level. A shorted
    // transistor has no level. The main contactor switches the main source.
    void gates(const FromController& from) {
        if (from.gap_level != 0)
            level_ = from.gap_level;
        if (stuck_ == NONE)
            gap_->clock(from.gap_on && powered_, from.gap_sense, from.gap_level, from.gap_supply);
        else if (stuck_ == SENSING)
            gap_->clock(from.gap_on && powered_, true, from.gap_level, from.gap_supply);
        else
            gap_->clock(powered_, from.gap_sense, stuck_ == MAIN ? level_ : Gap::BARE,
                       from.gap_supply);
    }

    // Rising edges of the step pins.
    void steps(const FromController& from) {
        for (unsigned rose = from.step & ~step_; rose; rose &= rose - 1) {
            const int axis = __builtin_ctz(rose);
            axes_[axis].step(from.dir >> axis & 1);
        }
        step_ = from.step;
    }

    void sides(ToController& to) {
        to.estop = estop_;
        to.drive_fault = drive_fault_;
        to.limit_low = limit_low_;
        to.limit_high = limit_high_;
        to.fluid_low = fluid_low_;
        to.fin = fin_ | fin_stuck_;
        to.arm = arm_;
        to.power_good = power_good_;
    }

    void coders(ToController& to) {
        unsigned a = 0, b = 0, index = 0;
        for (int axis = 0; axis < AXES; ++axis) {
            a |= static_cast<unsigned>(axes_[axis].phase_a()) << axis;
            b |= static_cast<unsigned>(axes_[axis].phase_b()) << axis;
            index |= static_cast<unsigned>(axes_[axis].index()) << axis;
        }
        lines_.clock(a, b, to.enc_a, to.enc_b);
        to.enc_index = lines_.index(index);
    }

    // Each of the three bits has its own counter of clocks.
    static constexpr unsigned COUNTER = 21;
    static int counted(uint64_t counters, int axis) {
        return static_cast<int>(counters >> axis * COUNTER & ((1u << COUNTER) - 1));
    }
    static constexpr uint64_t ONE = 1, TWO = 1ull << COUNTER, FOUR = 1ull << 2 * COUNTER;
    static constexpr uint64_t SPREAD[8] = {0,    ONE,        TWO,        TWO + ONE,
                                           FOUR, FOUR + ONE, FOUR + TWO, FOUR + TWO + ONE};

    MachineParameters p_;
    GapForces gap_forces_;
    std::map<std::string, double*> parameters_;
    // Forced by tests: masks by axis, or 0 and 1.
    double force_estop_ = 0, force_drive_fault_ = 0, force_fluid_low_ = 0, force_limit_low_ = 0,
           force_limit_high_ = 0, force_fluid_sensor_ = 0, force_converter_silent_ = 0,
           force_arm_ = 0, force_brown_out_ = 0, force_flash_absent_ = 0;
    // The gate that is stuck; the comparators whose wire is always 1 (`cut`) or 0 (`dead`): 1 that of
    // the short level, 2 of the current, 4 of the arc level, 8 of the open level; and the references
    // whose wire is cut: 1 that of the open level, 2 of the arc level, 4 of the short level. `swap`:
    // those of open and arc level are exchanged.
    enum Stuck { NONE, MAIN, SENSING, SHORTED };
    double force_gate_stuck_ = 0, force_comparator_cut_ = 0, force_comparator_dead_ = 0,
           force_reference_cut_ = 0, force_reference_swap_ = 0, force_fin_ = 0;

    Motor axes_[AXES];
    CoderLines lines_;
    SinkerGap sinker_;
    WireGap wire_;
    Gap* gap_ = &sinker_;  // the gap for the machine's kind
    Converter converter_;
    Flash flash_;
    uint64_t now_ = 0;
    uint64_t references_ = 0;  // ones of the three streams in this tick
    uint64_t up_ = 0, down_ = 0;  // those of the DACs, at either sign
    Filter filters_[3];
    double reference_one_v_ = 0;
    unsigned serial_ = 0, memory_ = 0;
    unsigned clocks_per_tick_ = 16, phase_ = 0;
    bool still_ = false;        // no coder changes in this tick: `catch_up` moves the axes
    unsigned caught_up_ = 0;    // clocks of this tick for which it has moved them
    unsigned stuck_ = 0, wires_cut_ = 0, wires_dead_ = 0;
    unsigned level_ = 1;
    unsigned compared_ = ~0u;     // lines of the gap, as the controller has them
    bool configured_ = true, contact_ = false;
    uint8_t step_ = 0;
    uint8_t estop_ = 0, drive_fault_ = 0, limit_low_ = 0, limit_high_ = 0, fluid_low_ = 0, fin_ = 0,
            fin_stuck_ = 0;
    uint8_t arm_ = 0, power_good_ = 1;
    Random presses_;
    Switch switches_[AXES][2];  // lower and upper end
    bool powered_ = false;        // the main contactor's contacts are closed
    double fin_wait_us_ = 0, contactor_wait_ms_ = 0;
    std::vector<Auxiliary> auxiliaries_;
};

}  // namespace plant
