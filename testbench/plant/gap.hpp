// SPDX-License-Identifier: Apache-2.0
// The gap between tool and workpiece, and its pulses, as on every machine.
#pragma once

#include <cmath>
#include <cstdint>

#include "parameters.hpp"
#include "random.hpp"

namespace plant {

// From this resistivity on the fluid counts as an insulator: here begins the highest class of the
// second patent.
constexpr double INSULATING_OHM_CM = 1e6;

// Values that tests can force; NAN and -1 leave them to the physics.
struct GapForces {
    double gap_um;     // width
    double debris;
    double fluid_ohm_cm;
    double short_;     // 0 clear, 1 shorted
    GapForces();
};

// Place of the tool: the wire's from its start, the electrode's above the top of the workpiece.
struct Place {
    double x_um, y_um, height_um;
};

// A machine's tool adds its area, the rate of ignition, the volume that a discharge removes, and
// the change of gap, debris and bridges with time: see sinker.hpp and wire_gap.hpp.
class Gap {
public:
    enum class State : uint8_t { off, open, burning, arcing, shorted };  // in off it may still fall
    enum class Gate : uint8_t { none, main, sensing };

    // The caller owns parameters and forces, which must outlive this object.
    Gap(uint64_t seed, const MachineParameters& p, const GapForces& forces)
        : p_(p), force_(forces), sparks_(seed, 1), bridges_(seed, 2), noise_(seed, 3) {}
    virtual ~Gap() = default;

    // Call it after a change of parameters or forces.
    void configure();

    // Call it before the first clock, with the tool at its start.
    virtual void start() = 0;

    // References of the comparators: open, arc, short.
    void put_levels(double high_v, double arc_v, double short_v);

    // Call one of the two every clock. With the gates of the two sources, and the main source's
    // current level and supply: bits 0 to 3 are the steps of its voltage, bit 4 makes the electrode
    // negative. At the level BARE its transistor is shorted: only the source's resistance bounds the
    // current.
    static constexpr unsigned BARE = 64;
    void clock(bool on, bool sensing, unsigned level, unsigned supply) {
        const Gate gate = on ? Gate::main : sensing ? Gate::sensing : Gate::none;
        if (gate != gate_) {
            switch_to(gate, level, supply);
            ++now_;
        } else {
            clock();
        }
    }

    // A clock in which the gates stay as they are.
    void clock() {
        if (state_ <= State::open && ++waited_ >= next_)
            wait();
        else if (discharge_left_ != 0 && --discharge_left_ == 0)
            discharged();
        ++now_;
    }

    // Once per tick of dt seconds.
    void tick(const Place& place, double dt);

    // What the comparators find, and the receiver of noise.
    enum Line : unsigned { SHORT = 1, CURRENT = 2, ARC = 4, HIGH = 8, NOISE = 16 };
    unsigned lines() const { return lines_; }

    State state() const { return state_; }
    double gap_um() const { return gap_; }
    double debris() const { return debris_; }
    double voltage() const { return volts_; }
    double current() const;
    double fluid_ohm_cm() const { return fluid_; }
    double hazard_per_us() const { return hazard_; }
    bool bridged() const { return bridged_; }
    // Tool and work touch, or something between them conducts: not for one pulse only.
    bool contact() const;
    double removed_mm3() const { return removed_; }
    // Energy that the sparks (no arcs) have had from the main source, and the sum of its squares.
    double spark_uj() const { return spark_uj_; }
    double spark_uj2() const { return spark_uj2_; }
    // Volts times clocks since the start.
    double voltage_sum() const { return sum_ + volts_ * static_cast<double>(now_ - since_); }
    uint64_t sparks() const { return spark_count_; }
    uint64_t arcs() const { return arc_count_; }
    uint64_t bridges() const { return bridge_count_; }

protected:
    // Area of the tool, as far as it faces the workpiece.
    virtual double area_mm2() const = 0;
    // No current can flow: the wire is broken.
    virtual bool interrupted() const { return false; }
    // Causes of a short besides contact and bridges.
    virtual bool shorted_for_a_while() const { return false; }
    // Rate of ignition at the open voltage in an insulating fluid without debris.
    virtual double hazard() const = 0;
    // Volume that one discharge of that length removes, mm3, not scaled: a random draw.
    virtual double crater_mm3(double microseconds) = 0;
    // Called with the volume that was removed, scaled.
    virtual void remove(double mm3, double microseconds) = 0;
    // A tick: updates gap, debris and bridges.
    virtual void change(const Place& place, double dt) = 0;

    void set_fluid();
    void set_hazard();
    // The value that a test forces, or that of the physics.
    static double or_forced(double physics, double forced) {
        return std::isnan(forced) ? physics : forced;
    }
    bool sparking() const;
    // A bridge breaks when the tool has stretched it beyond its limit.
    void draw_bridge();
    void build_bridge(double stretch_um);

    const MachineParameters& p_;
    const GapForces& force_;
    Random sparks_, bridges_, noise_;
    double amps_ = 0;
    double gap_ = 0, debris_ = 0;
    bool bridged_ = false;
    double bridge_gap_ = 0, bridge_stretch_ = 0;    // narrowest gap since it grew; its limit

private:
    void switch_to(Gate gate, unsigned level, unsigned supply);
    void wait();
    void fall();
    void ignite(bool arc);
    void empty(double burning_v);
    void discharged();
    void begin_pulse();
    void extinguish();
    void enter(State state, double volts);
    void set_volts(double volts);
    void compare();
    double leak_ohm() const;
    double draw();
    void open();
    bool touching() const;

    double clock_us_ = 0.5;
    uint64_t now_ = 0, since_ = 0, ended_ = 0, began_ = 0;
    uint32_t waited_ = 0, looked_ = 0, next_ = 0, step_ = 2;
    double sum_ = 0;

    Gate gate_ = Gate::none;
    State state_ = State::off;
    unsigned lines_ = ARC | SHORT;
    bool negative_ = false, single_ = false;
    double high_v_ = 0, arc_v_ = 0, short_v_ = 0;
    double volts_ = 0, leak_ohm_ = 0;
    double supply_v_ = 0, source_v_ = 0, source_ohm_ = 10;  // of the source that is on
    double rising_ = 0, falling_ = 0;   // shares of the voltage difference left after a clock
    double draw_ = 0, integral_ = 0, field_v_ = 0, field_ = 0;
    double fluid_ = 0, ease_ = 1, deionisation_us_ = 0;

    // A capacitor at the main source; 0 nF: none.
    double capacitor_nf_ = 0, charging_a_ = 0, discharge_us_ = 0;
    uint32_t discharge_left_ = 0;   // clocks of its discharge
    bool early_ = false;            // it breaks down as soon as it can: the channel is still there
    double spark_uj_ = 0, spark_uj2_ = 0;

    double hazard_ = 0;
    double removed_ = 0;
    uint64_t spark_count_ = 0, arc_count_ = 0, bridge_count_ = 0;
};

}  // namespace plant
