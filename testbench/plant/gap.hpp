// SPDX-License-Identifier: Apache-2.0
// The gap between electrode and workpiece: discharges, debris, removal, shorts.
#pragma once

#include <cstdint>

#include "random.hpp"
#include "wire.hpp"

namespace plant {

// Fluid of this and more is an insulator to the discharges: the highest class of the patent of the
// counted pulses (JP S60-10852 B) begins here.
constexpr double INSULATING_OHM_CM = 1e6;

// Units are in the names; the sources of the numbers are in sinker.toml, and in wire.toml of those
// that a wire machine has.
struct GapParameters {
    double area_mm2 = 100;
    double initial_gap_um = 100;
    double removal_scale = 60;
    double removal_mm3_min_a = 5;   // steel, per ampere of mean discharge current
    double removal_spread = 0.25;   // standard deviation of one crater, relative
    double arc_removal = 0.2;       // share of a good discharge's
    // Ignition
    double ignition_gap_um = 40;    // g0: the gap at which the mean delay is ignition_delay_us
    double ignition_delay_us = 60;
    double ignition_slope_um = 12;  // gs
    double ignition_debris = 4;     // kc
    double ignition_power = 4;      // m
    double ignition_conductivity = 0.3;  // exponent, below INSULATING_OHM_CM
    double ignition_law = 0;        // 0 exponential, 1 mixture of two Weibull laws
    double weibull_gap_um = 30;     // where both have the same share
    double weibull_width_um = 4;
    double weibull_narrow_shape = 0.8;
    double weibull_wide_shape = 1.6;
    double formative_us = 0.5;
    // Source
    double open_v = 80;             // with the supply's code at 0
    double supply_step_v = 20;      // per step of that code
    double negative_removal = 0.5;  // electrode negative, as a share of positive
    double rise_us = 0.2;           // of the main source: source_ohm times the capacity of the gap
    double fall_us = 0.2;           // after a pulse, that capacity through what else is across it
    double source_ohm = 10;
    double step_a = 1.5;            // per step of the current level
    double burning_v = 25;
    double burning_spread_v = 1.5;
    double arc_v = 17;
    double arc_spread_v = 0.7;
    double short_v = 2;             // contact drop
    double short_ohm = 0.2;
    double sensing_v = 24;          // of the sensing source
    double sensing_a = 1;           // what its resistor lets through at that voltage
    // Fluid
    double fluid_ohm_cm = 1e9;
    double drift_end_ohm_cm = 1e9;  // geometric from fluid_ohm_cm, reached after
    double drift_s = 0;             // this time; 0: no drift
    // Comparators
    double current_level_a = 0.5;
    double noise_miss = 0.01;       // share of sparks whose noise the detector misses
    // Debris
    double debris_time_s = 3;       // flushing at the surface
    double debris_depth_mm = 1;     // flushing takes twice as long at this depth
    double exchange_depth_mm = 1;   // a lift of h renews h / (h + depth / this) of what flows in
    double deionisation_us = 15;
    double deionisation_conductivity = 0.3;  // per decade below INSULATING_OHM_CM
    double arc_share = 1;           // arcs among ignitions without a pause, per debris
    double single_short = 0.02;     // shorted pulses among all, per debris, gap closed
    // Bridges
    double contact_um = 2;
    double bridge_rate_per_s = 2;
    double bridge_gap_um = 25;
    double stretch_um = 60;         // mean at the surface, without debris
    double stretch_depth_mm = 1;    // twice as long at this depth
    double stretch_debris = 1;      // and twice as long at this debris
};

// What tests can force; NAN and -1 leave it to physics.
struct GapForces {
    double gap_um;     // width
    double debris;
    double fluid_ohm_cm;
    double short_;     // 0 clear, 1 shorted
    GapForces();
};

class Gap {
public:
    enum class State : uint8_t { off, open, burning, arcing, shorted };  // in off it may still fall
    enum class Gate : uint8_t { none, main, sensing };

    explicit Gap(uint64_t seed) : sparks_(seed, 1), bridges_(seed, 2), noise_(seed, 3) {}

    void configure(const GapParameters& p, double clock_hz);
    void put_electrode(double height_um);

    // The gap is that of a wire, which from now on says how wide it is; none: a sinker's.
    void put_wire(Wire* wire);

    // References of the comparators: open, arc, short.
    void put_levels(double high_v, double arc_v, double short_v);

    // Every clock, with the gates of the two sources, the main one's current level and its supply:
    // bits 0 to 3 the steps of its voltage, bit 4 an electrode that is negative. At the level BARE
    // nothing but the source's resistance bounds the current: its transistor is shorted.
    static constexpr unsigned BARE = 64;
    void clock(bool on, bool sensing, unsigned level, unsigned supply) {
        const Gate gate = on ? Gate::main : sensing ? Gate::sensing : Gate::none;
        if (gate != gate_)
            switch_to(gate, level, supply);
        else if (state_ <= State::open && ++waited_ >= next_)
            wait();
        ++now_;
    }

    // Once per tick of dt seconds: the electrode is at a height above the top of the workpiece.
    void tick(double height_um, double dt);

    bool high() const { return high_; }
    bool below_arc() const { return below_arc_; }
    bool below_short() const { return below_short_; }
    bool conducting() const { return conducting_; }
    bool noise() const { return noisy_; }

    State state() const { return state_; }
    double gap_um() const { return gap_; }
    double depth_um() const { return depth_; }
    double debris() const { return debris_; }
    double voltage() const { return volts_; }
    double current() const;
    double fluid_ohm_cm() const { return fluid_; }
    double hazard_per_us() const { return hazard_; }
    bool bridged() const { return bridged_; }
    double removed_mm3() const { return removed_; }
    // Volts times clocks since the start.
    double voltage_sum() const { return sum_ + volts_ * static_cast<double>(now_ - since_); }
    uint64_t sparks() const { return spark_count_; }
    uint64_t arcs() const { return arc_count_; }
    uint64_t bridges() const { return bridge_count_; }

    GapForces force;

private:
    void switch_to(Gate gate, unsigned level, unsigned supply);
    void wait();
    void fall();
    void ignite(bool arc);
    void extinguish();
    void enter(State state, double volts);
    void set_volts(double volts);
    void compare();
    double leak_ohm() const;
    void set_fluid();
    void set_hazard();
    double draw();
    void open();
    bool touching();
    double stretch();
    double crater(double microseconds);
    void change(double height_um, double dt);
    void change_wire(double dt);

    GapParameters p_;
    Wire* wire_ = nullptr;
    Random sparks_, bridges_, noise_;
    double clock_us_ = 0.5;
    uint64_t now_ = 0, since_ = 0, ended_ = 0, began_ = 0;
    uint32_t waited_ = 0, looked_ = 0, next_ = 0, step_ = 2;
    double sum_ = 0;

    Gate gate_ = Gate::none;
    State state_ = State::off;
    bool high_ = false, below_arc_ = true, below_short_ = true, conducting_ = false;
    bool noisy_ = false, negative_ = false, single_ = false;
    double high_v_ = 0, arc_v_ = 0, short_v_ = 0;
    double volts_ = 0, amps_ = 0, leak_ohm_ = 0;
    double supply_v_ = 0, source_v_ = 0, source_ohm_ = 10;  // of the source that is on
    double rising_ = 0, falling_ = 0;   // what a clock leaves of the way to its voltage, and to 0
    double draw_ = 0, integral_ = 0, field_v_ = 0, field_ = 0;
    double fluid_ = 0, ease_ = 1, deionisation_us_ = 0;

    double height_ = 0, gap_ = 0, depth_ = 0, debris_ = 0, hazard_ = 0;
    double bridge_gap_ = 0, bridge_stretch_ = 0, removed_ = 0;
    bool bridged_ = false;
    double random_short_us_ = 0;  // that are left of it
    uint64_t spark_count_ = 0, arc_count_ = 0, bridge_count_ = 0;
};

}  // namespace plant
