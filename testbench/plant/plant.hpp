// SPDX-License-Identifier: Apache-2.0
// The simulated machine at the other end of the controller's pins.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <type_traits>
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

// Outputs that seldom change, and the selection and clock of the two serial chips. Each of these
// structures is compared as a whole, byte for byte.
struct Switched {
    uint8_t dac_negative = 0, step = 0, dir = 0, drive_enable = 0;
    uint8_t gap_on = 0, gap_sense = 0, gap_level = 0, gap_supply = 0;
};

struct ConverterPins {
    uint8_t adc_select = 0, adc_clock = 0;
};

struct FlashPins {
    uint8_t flash_select = 0, flash_clock = 0;
};

// Names and widths are those of rtl/pads.py.
struct FromController : Switched, ConverterPins, FlashPins {
    uint8_t dac = 0, gap_reference = 0, adc_command = 0, flash_command = 0;
    uint8_t contactor = 0, auxiliary_strobe = 0, safe = 1;
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
    [[gnu::always_inline]] bool clock(const FromController& from, ToController& to) {
        if (differ<Switched>(from, switched_))
            switches(from);
        else
            gap_->clock();
        ones_ += SPREAD[from.dac];
        references_ += SPREAD[from.gap_reference];
        bool changed = !quiet_ && moves(to);
        if (differ<ConverterPins>(from, converter_pins_)) {
            converter_pins_ = from;
            converter_.change(from.adc_select, from.adc_clock, from.adc_command,
                              [this](unsigned channel) { return sample(channel); });
            const uint8_t data = converter_.data() && !silent_;
            changed |= data != to.adc_data;
            to.adc_data = data;
        }
        if (differ<FlashPins>(from, flash_pins_)) {
            flash_pins_ = from;
            flash_.pins(from.flash_select, from.flash_clock, from.flash_command, now_);
            to.flash_data = flash_.data() || force_flash_absent_ != 0;
            changed = true;
        }
        if (++phase_ == clocks_per_tick_) {
            tick(from);
            sides(to);
            changed = true;
        }
        if (gap_->lines() != lines_) {
            compares(to);
            changed = true;
        }
        ++now_;
        return changed;
    }

    void close_contactor() {    // at once, for tests of the gap alone
        powered_ = true;
        look_at_gates();
    }
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
    void between();
    void limits();
    bool presses(Switch& one, double beyond_um);
    void faults();
    void levels();
    double electrode_um() const;
    unsigned sample(unsigned channel) const;

    // What a clock does when one of the outputs in Switched has changed.
    void switches(const FromController& from);
    // The coders in a clock in which one may change, and every input after a parameter was set;
    // returns whether any may have changed.
    bool moves(ToController& to);
    void compares(ToController& to);

    void gates(const FromController& from);
    void steps(const FromController& from);
    void sides(ToController& to) const;
    void coders(ToController& to);
    void add_up();

    template <typename Pins>
    static bool differ(const Pins& a, const Pins& b) {
        static_assert(std::has_unique_object_representations_v<Pins>, "nothing between the bytes");
        return std::memcmp(&a, &b, sizeof(Pins)) != 0;
    }

    // The next clock finds the outputs changed: no output has this value.
    void look_at_gates() { switched_.gap_on = UINT8_MAX; }

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
    CoderLines coder_lines_;
    SinkerGap sinker_;
    WireGap wire_;
    Gap* gap_ = &sinker_;  // the gap for the machine's kind
    Converter converter_;
    bool silent_ = false;         // a test keeps its data line low
    Flash flash_;
    uint64_t now_ = 0;
    uint64_t references_ = 0;  // ones of the three streams in this tick
    uint64_t ones_ = 0;           // those of the DACs since `add_up`, which knows their signs
    int sums_[AXES] = {};         // and before, in this tick: those of positive less negative ones
    Filter filters_[3];
    double reference_one_v_ = 0;
    Switched switched_;
    ConverterPins converter_pins_;
    FlashPins flash_pins_;
    unsigned clocks_per_tick_ = 16, phase_ = 0;
    bool still_ = false;        // no coder changes in this tick: `catch_up` moves the axes
    bool quiet_ = false;        // nor does one of the coders' lines
    unsigned caught_up_ = 0;    // clocks of this tick for which it has moved the axes
    unsigned stuck_ = 0, wires_cut_ = 0, wires_dead_ = 0;
    unsigned level_ = 1;
    unsigned lines_ = ~0u;        // of the gap, when the comparators were last read
    bool configured_ = true, contact_ = false;
    uint8_t estop_ = 0, drive_fault_ = 0, limit_low_ = 0, limit_high_ = 0, fluid_low_ = 0, fin_ = 0,
            fin_stuck_ = 0;
    uint8_t arm_ = 0, power_good_ = 1;
    Random presses_;
    Switch switches_[AXES][2];  // lower and upper end
    double lowest_pulses_ = 0, highest_pulses_ = 0;     // between them no switch is pressed
    bool powered_ = false;        // the main contactor's contacts are closed
    double fin_wait_us_ = 0, contactor_wait_ms_ = 0;
    std::vector<Auxiliary> auxiliaries_;
};

}  // namespace plant
