// SPDX-License-Identifier: Apache-2.0
#include "gap.hpp"

#include <algorithm>
#include <cmath>

namespace plant {

namespace {

constexpr double PI = 3.14159265358979;
constexpr double RISEN = 0.995;  // of the open voltage: from here on it counts as reached
constexpr double FALLEN_V = 0.05;  // below this the voltage counts as 0
constexpr uint32_t NEVER = UINT32_MAX;
constexpr double SPARKING_US = 1000;  // since the last discharge: bridges may grow

}  // namespace

GapForces::GapForces() : gap_um(NAN), debris(NAN), fluid_ohm_cm(NAN), short_(-1) {}

void Gap::configure() {
    clock_us_ = 1e6 / p_.clock_hz;
    step_ = std::max(1u, static_cast<uint32_t>(1 / clock_us_));  // ignition is looked at every us
    set_fluid();
}

void Gap::put_levels(double high_v, double arc_v, double short_v) {
    high_v_ = high_v;
    arc_v_ = arc_v;
    short_v_ = short_v;
    compare();
}

// ---- pulses

double Gap::current() const {
    switch (state_) {
    case State::off:
        return 0;
    case State::open:
        return volts_ / leak_ohm_;
    default:
        return amps_;
    }
}

void Gap::compare() {
    const bool conducting = current() > (gate_ == Gate::sensing ? p_.comparator.sensing_level_a
                                                                : p_.comparator.current_level_a);
    lines_ = (lines_ & NOISE) | (volts_ > high_v_ ? HIGH : 0) | (volts_ < arc_v_ ? ARC : 0) |
             (volts_ < short_v_ ? SHORT : 0) | (conducting ? CURRENT : 0);
}

void Gap::set_volts(double volts) {
    sum_ += volts_ * static_cast<double>(now_ - since_);
    since_ = now_;
    volts_ = volts;
    compare();
}

void Gap::enter(State state, double volts) {
    state_ = state;
    set_volts(volts);
    // Sparks radiate above 1 MHz, arcs do not.
    const bool noisy = state == State::burning && noise_.uniform() >= p_.comparator.noise_miss;
    lines_ = (lines_ & ~NOISE) | (noisy ? NOISE : 0);
}

// Of the fluid: Rg = rho g / A.
double Gap::leak_ohm() const {
    return fluid_ * (std::max(gap_, 1.0) * 1e-4) / (area_mm2() * 1e-2);
}

void Gap::open() {
    // The fluid leaks. The source charges the gap's capacity through its own resistance.
    leak_ohm_ = leak_ohm();
    source_v_ = supply_v_ * leak_ohm_ / (leak_ohm_ + source_ohm_);
    rising_ = std::exp(-clock_us_ / p_.source.rise_us * p_.source.source_ohm / source_ohm_);
    if (capacitor_nf_ > 0) {
        const double ohm = source_ohm_ * leak_ohm_ / (source_ohm_ + leak_ohm_);
        rising_ = std::exp(-clock_us_ / (ohm * capacitor_nf_ * 1e-3));
    }
    draw_ = gate_ == Gate::main ? draw() : 0;
    integral_ = 0;
    waited_ = looked_ = 0;
    next_ = 1;
    // The comparators see the voltage at the end of a clock.
    enter(State::open, source_v_ - (source_v_ - volts_) * rising_);
}

// With both gates off the capacity discharges, also through the fluid; a bridge empties it at once.
void Gap::fall() {
    waited_ = 0;
    const double left = touching() ? 0 : volts_ * falling_;
    next_ = left < FALLEN_V ? NEVER : 1;
    enter(State::off, left < FALLEN_V ? 0 : left);
}

bool Gap::contact() const {
    if (force_.short_ >= 0)
        return force_.short_ > 0;
    return !interrupted() &&
           (bridged_ || gap_ < p_.gap.contact_um || shorted_for_a_while());
}

// `single_` is set only where no short is forced.
bool Gap::touching() const { return contact() || (single_ && !interrupted()); }

void Gap::switch_to(Gate gate, unsigned level, unsigned supply) {
    if (discharge_left_ != 0 && gate != Gate::none) {
        discharge_left_ = 0;
        extinguish();
    } else if (gate_ != Gate::none && discharge_left_ == 0) {
        extinguish();
    }
    gate_ = gate;
    if (gate == Gate::none) {
        const double leak = p_.source.source_ohm / (p_.source.rise_us * leak_ohm());
        falling_ = std::exp(-clock_us_ * (1 / p_.source.fall_us + leak));
        if (capacitor_nf_ > 0)
            falling_ = std::exp(-clock_us_ / (p_.relaxation.emptying_ohm * capacitor_nf_ * 1e-3));
        if (discharge_left_ != 0)
            return;     // a capacitor goes on into the gap
        amps_ = 0;
        fall();
        return;
    }
    capacitor_nf_ = 0;
    if (gate == Gate::main) {
        const unsigned steps = supply & 15;
        supply_v_ = steps != 0 ? steps * p_.source.supply_step_v : p_.source.open_v;
        source_ohm_ = p_.source.source_ohm;
        amps_ = level < BARE ? level * p_.source.step_a : supply_v_ / source_ohm_;
        if (level < BARE && p_.relaxation.step_nf > 0 && level > 0) {
            capacitor_nf_ = level * p_.relaxation.step_nf;
            source_ohm_ = p_.relaxation.charging_ohm;
            amps_ = charging_a_ = supply_v_ / source_ohm_;
        }
    } else {
        supply_v_ = p_.source.sensing_v;
        source_ohm_ = p_.source.sensing_v / p_.source.sensing_a;
        amps_ = (supply_v_ - p_.source.short_v) / (source_ohm_ + p_.source.short_ohm);
    }
    negative_ = supply >> 4 & 1;
    // Debris caught for one pulse only: a single shorted pulse is normal.
    single_ = gate == Gate::main && force_.short_ < 0 &&
              sparks_.uniform() < p_.debris.single_short * debris_ *
                                      std::exp(-gap_ / p_.debris.bridge_gap_um);
    if (touching()) {
        enter(State::shorted, p_.source.short_v + p_.source.short_ohm * amps_);
        return;
    }
    begin_pulse();
}

void Gap::begin_pulse() {
    open();
    // If the last discharge has left charge carriers, the next one ignites at once, as an arc.
    early_ = false;
    const double pause = static_cast<double>(now_ - ended_) * clock_us_;
    if (gate_ == Gate::main &&
        sparks_.uniform() < p_.debris.arc_share * debris_ * std::exp(-pause / deionisation_us_) &&
        source_v_ > p_.source.arc_v && !interrupted()) {
        if (capacitor_nf_ > 0)
            early_ = true;
        else
            ignite(true);
    }
}

// The hazard rate is integrated in steps of a microsecond until it reaches the pulse's random draw.
void Gap::wait() {
    if (state_ == State::off) {
        fall();
        return;
    }
    if (volts_ != source_v_) {
        const double left = (source_v_ - volts_) * rising_;
        set_volts(std::abs(left) > (1 - RISEN) * source_v_ ? source_v_ - left : source_v_);
        next_ = waited_ + 1;
    } else {
        next_ = gate_ == Gate::main ? waited_ + step_ : NEVER;
    }
    const double elapsed = (waited_ - looked_) * clock_us_;
    looked_ = waited_;
    if (early_ && volts_ > p_.source.burning_v) {
        ignite(true);
        return;
    }
    if (gate_ != Gate::main || waited_ * clock_us_ <= p_.gap.formative_us)
        return;
    if (volts_ != field_v_) {
        field_v_ = volts_;
        const double share = volts_ / p_.source.open_v;
        field_ = std::abs(share - 1) < 0.001 ? 1 : std::pow(share, p_.gap.ignition_power);
    }
    integral_ += hazard_ * field_ * elapsed;
    if (integral_ > draw_ &&
        (capacitor_nf_ > 0 ? volts_ : source_v_) > p_.source.burning_v)
        ignite(false);
}

void Gap::ignite(bool arc) {
    if (arc)
        ++arc_count_;
    else
        ++spark_count_;
    began_ = now_;
    const double wanted = arc ? p_.source.arc_v + p_.source.arc_spread_v * sparks_.normal()
                              : p_.source.burning_v + p_.source.burning_spread_v * sparks_.normal();
    if (capacitor_nf_ > 0)
        empty(wanted);
    enter(arc ? State::arcing : State::burning, wanted);
}

// The capacitor discharges through the gap within half a period of it and the leads. A diode keeps
// it from being charged the other way round: what energy the leads have then goes into the gap as
// well. So the gap gets what the capacitor loses: all of C V^2 / 2 from twice the burning voltage
// on, else until the current is 0.
void Gap::empty(double burning_v) {
    const double left_v = std::max(0.0, 2 * burning_v - volts_);
    const double nj = std::max(0.0, capacitor_nf_ / 2 * (volts_ * volts_ - left_v * left_v));
    discharge_us_ = PI * std::sqrt(p_.relaxation.inductance_nh * capacitor_nf_) * 1e-3;
    discharge_left_ = static_cast<uint32_t>(std::max(1.0, std::round(discharge_us_ / clock_us_)));
    amps_ = nj * 1e-3 / (burning_v * discharge_us_);    // mean of the discharge
}

void Gap::discharged() {
    extinguish();
    set_volts(0);
    amps_ = gate_ == Gate::none ? 0 : charging_a_;
    if (gate_ == Gate::none)
        fall();
    else
        begin_pulse();  // it is charged anew
}

// At the end of a discharge the removed material becomes debris.
void Gap::extinguish() {
    if (state_ != State::burning && state_ != State::arcing)
        return;
    const double microseconds = capacitor_nf_ > 0
                                    ? discharge_us_
                                    : static_cast<double>(now_ - began_) * clock_us_;
    if (state_ == State::burning) {
        const double uj = amps_ * volts_ * microseconds;
        spark_uj_ += uj;
        spark_uj2_ += uj * uj;
    }
    double volume = crater_mm3(microseconds);
    if (state_ == State::arcing)
        volume *= p_.gap.arc_removal;
    if (negative_)
        volume *= p_.source.negative_removal;
    volume *= p_.removal_scale;
    removed_ += volume;
    remove(volume, microseconds);
    ended_ = now_;
}

// ---- the gap

void Gap::set_hazard() {
    hazard_ = hazard() * (1 + p_.gap.ignition_debris * debris_) * ease_;
}

// The integral of the hazard at which the pulse ignites: of mean 1 with either distribution.
double Gap::draw() {
    if (p_.gap.ignition_law == 0)
        return sparks_.exponential();
    const double wide =
        1 / (1 + std::exp((p_.gap.weibull_gap_um - gap_) / p_.gap.weibull_width_um));
    const double shape =
        sparks_.uniform() < wide ? p_.gap.weibull_wide_shape : p_.gap.weibull_narrow_shape;
    return std::pow(sparks_.exponential(), 1 / shape) / std::tgamma(1 + 1 / shape);
}

// The fluid's present resistivity, and the values that depend on it.
void Gap::set_fluid() {
    fluid_ = p_.gap.fluid_ohm_cm;
    if (p_.fluid.drift_s > 0) {
        const double share = static_cast<double>(now_) * clock_us_ * 1e-6 / p_.fluid.drift_s;
        fluid_ *= std::pow(p_.fluid.drift_end_ohm_cm / p_.gap.fluid_ohm_cm, std::min(1.0, share));
    }
    if (!std::isnan(force_.fluid_ohm_cm))
        fluid_ = force_.fluid_ohm_cm;
    const double decades = std::max(0.0, std::log10(INSULATING_OHM_CM / fluid_));
    ease_ = std::pow(10, p_.gap.ignition_conductivity * decades);
    deionisation_us_ =
        p_.debris.deionisation_us * (1 + p_.debris.deionisation_conductivity * decades);
    set_hazard();
}

bool Gap::sparking() const {
    return static_cast<double>(now_ - ended_) * clock_us_ < SPARKING_US;
}

void Gap::draw_bridge() {
    bridge_gap_ = std::min(bridge_gap_, gap_);
    bridged_ = gap_ <= bridge_gap_ + bridge_stretch_;
}

void Gap::build_bridge(double stretch_um) {
    bridged_ = true;
    ++bridge_count_;
    bridge_gap_ = gap_;
    bridge_stretch_ = stretch_um;
}

void Gap::tick(const Place& place, double dt) {
    change(place, dt);
    if (p_.fluid.drift_s > 0)
        set_fluid();
    else
        set_hazard();
    if (gate_ == Gate::none)
        return;
    if (state_ == State::shorted) {
        if (!touching())
            open();
    } else if (touching()) {
        extinguish();
        if (discharge_left_ != 0) {
            discharge_left_ = 0;
            amps_ = charging_a_;
        }
        enter(State::shorted, p_.source.short_v + p_.source.short_ohm * amps_);
    }
}

}  // namespace plant
