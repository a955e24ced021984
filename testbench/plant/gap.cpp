// SPDX-License-Identifier: Apache-2.0
#include "gap.hpp"

#include <algorithm>
#include <cmath>

namespace plant {

namespace {

constexpr double RISEN = 0.995;  // of the open voltage: nothing changes any more
constexpr double FALLEN_V = 0.05;  // so little counts as none
constexpr uint32_t NEVER = UINT32_MAX;
constexpr int STRETCH_SHAPE = 3;
constexpr double SPARKING_US = 1000;  // since the last discharge: bridges may grow

}  // namespace

GapForces::GapForces() : gap_um(NAN), debris(NAN), fluid_ohm_cm(NAN), short_(-1) {}

void Gap::configure(const GapParameters& p, double clock_hz) {
    p_ = p;
    clock_us_ = 1e6 / clock_hz;
    step_ = std::max(1u, static_cast<uint32_t>(1 / clock_us_));  // ignition is looked at every us
    set_fluid();
}

void Gap::put_levels(double high_v, double arc_v, double short_v) {
    high_v_ = high_v;
    arc_v_ = arc_v;
    short_v_ = short_v;
    compare();
}

void Gap::put_electrode(double height_um) {
    height_ = height_um;
    gap_ = height_um + depth_;
    set_hazard();
}

void Gap::put_wire(Wire* wire) {
    wire_ = wire;
    if (!wire_)
        return;
    p_.area_mm2 = wire_->area_mm2();
    gap_ = wire_->gap_um();
    set_hazard();
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
    high_ = volts_ > high_v_;
    below_arc_ = volts_ < arc_v_;
    below_short_ = volts_ < short_v_;
    conducting_ = current() > p_.current_level_a;
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
    noisy_ = state == State::burning && noise_.uniform() >= p_.noise_miss;
}

// Of the fluid: Rg = rho g / A.
double Gap::leak_ohm() const {
    return fluid_ * (std::max(gap_, 1.0) * 1e-4) / (p_.area_mm2 * 1e-2);
}

void Gap::open() {
    // The fluid leaks, and the source has its resistance, through which it charges the gap's capacity.
    leak_ohm_ = leak_ohm();
    source_v_ = supply_v_ * leak_ohm_ / (leak_ohm_ + source_ohm_);
    rising_ = std::exp(-clock_us_ / p_.rise_us * p_.source_ohm / source_ohm_);
    draw_ = gate_ == Gate::main ? draw() : 0;
    integral_ = 0;
    waited_ = looked_ = 0;
    next_ = 1;
    // The comparators see what the voltage is at the end of a clock.
    enter(State::open, source_v_ - (source_v_ - volts_) * rising_);
}

// With both gates off that capacity empties, through the fluid too; a bridge takes it all at once.
void Gap::fall() {
    waited_ = 0;
    const double left = touching() ? 0 : volts_ * falling_;
    next_ = left < FALLEN_V ? NEVER : 1;
    enter(State::off, left < FALLEN_V ? 0 : left);
}

bool Gap::touching() {
    if (force.short_ >= 0)
        return force.short_ > 0;
    if (wire_ && wire_->broken())
        return false;
    return bridged_ || gap_ < p_.contact_um || single_ || random_short_us_ > 0;
}

void Gap::switch_to(Gate gate, unsigned level, unsigned supply) {
    if (gate_ != Gate::none)
        extinguish();
    gate_ = gate;
    if (gate == Gate::none) {
        const double leak = p_.source_ohm / (p_.rise_us * leak_ohm());
        falling_ = std::exp(-clock_us_ * (1 / p_.fall_us + leak));
        amps_ = 0;
        fall();
        return;
    }
    if (gate == Gate::main) {
        const unsigned steps = supply & 15;
        supply_v_ = steps != 0 ? steps * p_.supply_step_v : p_.open_v;
        source_ohm_ = p_.source_ohm;
        amps_ = level < BARE ? level * p_.step_a : supply_v_ / source_ohm_;
    } else {
        supply_v_ = p_.sensing_v;
        source_ohm_ = p_.sensing_v / p_.sensing_a;
        amps_ = (supply_v_ - p_.short_v) / (source_ohm_ + p_.short_ohm);
    }
    negative_ = supply >> 4 & 1;
    // Debris caught for one pulse only: a single shorted pulse is normal.
    single_ = gate == Gate::main && force.short_ < 0 &&
              sparks_.uniform() < p_.single_short * debris_ * std::exp(-gap_ / p_.bridge_gap_um);
    if (touching()) {
        enter(State::shorted, p_.short_v + p_.short_ohm * amps_);
        return;
    }
    open();
    // Where the last discharge has left charge carriers, the next one strikes at once, as an arc.
    const double pause = static_cast<double>(now_ - ended_) * clock_us_;
    if (gate == Gate::main &&
        sparks_.uniform() < p_.arc_share * debris_ * std::exp(-pause / deionisation_us_) &&
        source_v_ > p_.arc_v && !(wire_ && wire_->broken()))
        ignite(true);
}

// The hazard law, integrated in steps of a microsecond until it reaches the pulse's own draw.
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
    if (gate_ != Gate::main || waited_ * clock_us_ <= p_.formative_us)
        return;
    if (volts_ != field_v_) {
        field_v_ = volts_;
        const double share = volts_ / p_.open_v;
        field_ = std::abs(share - 1) < 0.001 ? 1 : std::pow(share, p_.ignition_power);
    }
    integral_ += hazard_ * field_ * elapsed;
    if (integral_ > draw_ && source_v_ > p_.burning_v)
        ignite(false);
}

void Gap::ignite(bool arc) {
    if (arc)
        ++arc_count_;
    else
        ++spark_count_;
    began_ = now_;
    const double wanted = arc ? p_.arc_v + p_.arc_spread_v * sparks_.normal()
                              : p_.burning_v + p_.burning_spread_v * sparks_.normal();
    enter(arc ? State::arcing : State::burning, wanted);
}

// What a discharge of that time removes, mm3.
double Gap::crater(double microseconds) {
    if (wire_)
        return wire_->crater_um3(amps_, microseconds, sparks_) * 1e-9;
    const double seconds = microseconds * 1e-6;
    const double volume = p_.removal_mm3_min_a / 60 * amps_ * seconds;
    return volume * std::max(0.0, 1 + p_.removal_spread * sparks_.normal());
}

// End of a discharge: what it has removed is debris now.
void Gap::extinguish() {
    if (state_ != State::burning && state_ != State::arcing)
        return;
    const double microseconds = static_cast<double>(now_ - began_) * clock_us_;
    double volume = crater(microseconds);
    if (state_ == State::arcing)
        volume *= p_.arc_removal;
    if (negative_)
        volume *= p_.negative_removal;
    volume *= p_.removal_scale;
    removed_ += volume;
    if (wire_) {
        wire_->erode(volume * 1e9, amps_ * microseconds);
        ended_ = now_;
        return;
    }
    const double thickness = volume / p_.area_mm2 * 1000;  // um
    depth_ += thickness;
    debris_ += thickness / std::max(gap_, 10.0);
    ended_ = now_;
}

// ---- the gap

void Gap::set_hazard() {
    if (wire_) {
        const double engaged = std::isnan(force.gap_um) ? wire_->engagement() : 1;
        hazard_ = wire_->hazard_per_us(gap_) * engaged * (1 + p_.ignition_debris * debris_) * ease_;
        return;
    }
    const double folds = std::max(-8.0, (gap_ - p_.ignition_gap_um) / p_.ignition_slope_um);
    hazard_ = std::exp(-folds) * (1 + p_.ignition_debris * debris_) / p_.ignition_delay_us *
              ease_;
}

// What the integral of the hazard reaches when the pulse ignites: of mean 1 under either law.
double Gap::draw() {
    if (p_.ignition_law == 0)
        return sparks_.exponential();
    const double wide = 1 / (1 + std::exp((p_.weibull_gap_um - gap_) / p_.weibull_width_um));
    const double shape =
        sparks_.uniform() < wide ? p_.weibull_wide_shape : p_.weibull_narrow_shape;
    return std::pow(sparks_.exponential(), 1 / shape) / std::tgamma(1 + 1 / shape);
}

// The fluid as it is now, and what follows from it.
void Gap::set_fluid() {
    fluid_ = p_.fluid_ohm_cm;
    if (p_.drift_s > 0) {
        const double share = static_cast<double>(now_) * clock_us_ * 1e-6 / p_.drift_s;
        fluid_ *= std::pow(p_.drift_end_ohm_cm / p_.fluid_ohm_cm, std::min(1.0, share));
    }
    if (!std::isnan(force.fluid_ohm_cm))
        fluid_ = force.fluid_ohm_cm;
    const double decades = std::max(0.0, std::log10(INSULATING_OHM_CM / fluid_));
    ease_ = std::pow(10, p_.ignition_conductivity * decades);
    deionisation_us_ = p_.deionisation_us * (1 + p_.deionisation_conductivity * decades);
    set_hazard();
}

double Gap::stretch() {
    return p_.stretch_um * (1 + depth_ / 1000 / p_.stretch_depth_mm) *
           (1 + p_.stretch_debris * debris_) * bridges_.gamma(STRETCH_SHAPE);
}

void Gap::tick(double height_um, double dt) {
    if (wire_)
        change_wire(dt);
    else
        change(height_um, dt);
    if (gate_ == Gate::none)
        return;
    if (state_ == State::shorted) {
        if (!touching())
            open();
    } else if (touching()) {
        extinguish();
        enter(State::shorted, p_.short_v + p_.short_ohm * amps_);
    }
}

void Gap::change(double height_um, double dt) {
    const double lift = height_um - height_;
    height_ = height_um;
    gap_ = std::isnan(force.gap_um) ? height_um + depth_ : force.gap_um;

    // Removal is accelerated, so everything that goes on per unit of removal is, too: flushing and
    // the growth of bridges. What the moving electrode pumps is not: that goes by distance.
    const double depth = std::max(0.0, depth_ / 1000);  // mm
    const double scaled = dt * p_.removal_scale;
    debris_ *= 1 - std::min(1.0, scaled / (p_.debris_time_s * (1 + depth / p_.debris_depth_mm)));
    if (lift > 0) {
        const double width = std::max(gap_, 5.0);
        const double fresh = width / (width + 1000 * depth / p_.exchange_depth_mm);
        debris_ *= 1 - std::min(1.0, lift / width) * fresh;
    }
    if (!std::isnan(force.debris))
        debris_ = force.debris;
    if (p_.drift_s > 0)
        set_fluid();
    else
        set_hazard();

    // A bridge grows of debris in the field of the pulses, or of the contact itself; it breaks when
    // the electrode has drawn it out beyond its stretch.
    if (bridged_) {
        bridge_gap_ = std::min(bridge_gap_, gap_);
        bridged_ = gap_ <= bridge_gap_ + bridge_stretch_;
    } else {
        const bool sparking = static_cast<double>(now_ - ended_) * clock_us_ < SPARKING_US;
        const double rate = sparking
                                ? p_.bridge_rate_per_s * debris_ * debris_ *
                                      std::exp(-std::max(gap_, 0.0) / p_.bridge_gap_um)
                                : 0;
        if (gap_ < p_.contact_um || bridges_.uniform() < rate * scaled) {
            bridged_ = true;
            ++bridge_count_;
            bridge_gap_ = gap_;
            bridge_stretch_ = stretch();
        }
    }
}

void Gap::change_wire(double dt) {
    gap_ = std::isnan(force.gap_um) ? wire_->gap_um() : force.gap_um;
    const double fouled = wire_->flushed(gap_, dt);
    debris_ = std::isnan(force.debris) ? fouled : force.debris;
    if (!std::isnan(force.debris))
        wire_->put_debris(debris_, gap_);
    if (p_.drift_s > 0)
        set_fluid();
    else
        set_hazard();

    // Contact, and a gap that is clogged, stay shorted until the wire has drawn back beyond the
    // stretch. What comes by in the flow shorts for a while.
    const WireParameters& w = wire_->parameters();
    if (bridged_) {
        bridge_gap_ = std::min(bridge_gap_, gap_);
        bridged_ = gap_ <= bridge_gap_ + bridge_stretch_;
    } else if (gap_ < p_.contact_um ||
               debris_ > std::min(w.clog_least + w.clog_per_um * gap_, w.clog_most)) {
        bridged_ = true;
        ++bridge_count_;
        bridge_gap_ = gap_;
        bridge_stretch_ = p_.stretch_um * bridges_.gamma(STRETCH_SHAPE);
    }
    const double us = dt * 1e6;
    const bool sparking = static_cast<double>(now_ - ended_) * clock_us_ < SPARKING_US;
    const double chance =
        sparking ? w.random_short_per_us * us * (1 - gap_ / w.random_short_um) : 0;
    if (random_short_us_ > 0)
        random_short_us_ -= us;
    else if (chance > 0 && bridges_.uniform() < chance)
        random_short_us_ = w.random_short_us;
}

}  // namespace plant
