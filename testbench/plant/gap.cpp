// SPDX-License-Identifier: Apache-2.0
#include "gap.hpp"

#include <algorithm>
#include <cmath>

namespace plant {

namespace {

constexpr double RISEN = 0.995;  // of the open voltage: nothing changes any more
constexpr int STRETCH_SHAPE = 3;
constexpr double SPARKING_US = 1000;  // since the last discharge: bridges may grow

}  // namespace

GapForces::GapForces() : gap_um(NAN), debris(NAN), short_(-1) {}

void Gap::configure(const GapParameters& p, double clock_hz) {
    p_ = p;
    clock_us_ = 1e6 / clock_hz;
    step_ = std::max(1u, static_cast<uint32_t>(1 / clock_us_));  // ignition is looked at every us
    set_hazard();
}

void Gap::put_electrode(double height_um) {
    height_ = height_um;
    gap_ = height_um + depth_;
    set_hazard();
}

// ---- pulses

double Gap::open_volts() const {
    // The fluid leaks: Rg = rho g / A, and the source has its resistance.
    const double leak = p_.fluid_ohm_cm * (std::max(gap_, 1.0) * 1e-4) / (p_.area_mm2 * 1e-2);
    return p_.open_v * leak / (leak + p_.source_ohm);
}

void Gap::set_volts(double volts) {
    sum_ += volts_ * static_cast<double>(now_ - since_);
    since_ = now_;
    volts_ = volts;
    high_ = volts > p_.high_level_v;
    below_arc_ = volts < p_.arc_level_v;
    below_short_ = volts < p_.short_level_v;
}

void Gap::enter(State state, double volts) {
    state_ = state;
    set_volts(volts);
    conducting_ = (state == State::burning || state == State::arcing || state == State::shorted) &&
                  amps_ > p_.current_level_a;
}

void Gap::open() {
    source_v_ = open_volts();
    draw_ = sparks_.exponential();
    integral_ = 0;
    waited_ = looked_ = 0;
    next_ = 1;
    // The source charges the gap's capacity: the first clock's mean is what the comparators see.
    enter(State::open, source_v_ * (1 - std::exp(-clock_us_ / p_.rise_us)));
}

bool Gap::touching() {
    if (force.short_ >= 0)
        return force.short_ > 0;
    return bridged_ || gap_ < p_.contact_um || single_;
}

void Gap::switch_to(Gate gate, unsigned level) {
    if (gate_ != Gate::none)
        extinguish();
    gate_ = gate;
    if (gate == Gate::none) {
        amps_ = 0;
        enter(State::off, 0);
        return;
    }
    amps_ = gate == Gate::main ? level * p_.step_a : p_.sensing_a;
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
        sparks_.uniform() < p_.arc_share * debris_ * std::exp(-pause / p_.deionisation_us))
        ignite(true);
}

// The hazard law, integrated in steps of a microsecond until it reaches the pulse's own draw.
void Gap::wait() {
    if (volts_ < RISEN * source_v_) {
        const double left = (source_v_ - volts_) * std::exp(-clock_us_ / p_.rise_us);
        const double volts = source_v_ - left;
        set_volts(volts < RISEN * source_v_ ? volts : source_v_);
        next_ = waited_ + 1;
    } else {
        next_ = waited_ + step_;
    }
    const double elapsed = (waited_ - looked_) * clock_us_;
    looked_ = waited_;
    if (gate_ != Gate::main || waited_ * clock_us_ <= p_.formative_us)
        return;
    const double share = volts_ / p_.open_v;
    integral_ += hazard_ * (share > 0.999 ? 1 : std::pow(share, p_.ignition_power)) * elapsed;
    if (integral_ > draw_)
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

// End of a discharge: what it has removed is debris now.
void Gap::extinguish() {
    if (state_ != State::burning && state_ != State::arcing)
        return;
    const double seconds = static_cast<double>(now_ - began_) * clock_us_ * 1e-6;
    double volume = p_.removal_mm3_min_a / 60 * amps_ * seconds;
    volume *= std::max(0.0, 1 + p_.removal_spread * sparks_.normal());
    if (state_ == State::arcing)
        volume *= p_.arc_removal;
    volume *= p_.removal_scale;
    removed_ += volume;
    const double thickness = volume / p_.area_mm2 * 1000;  // um
    depth_ += thickness;
    debris_ += thickness / std::max(gap_, 10.0);
    ended_ = now_;
}

// ---- the gap

void Gap::set_hazard() {
    const double decades = std::max(-8.0, (gap_ - p_.ignition_gap_um) / p_.ignition_slope_um);
    hazard_ = std::exp(-decades) * (1 + p_.ignition_debris * debris_) / p_.ignition_delay_us;
}

double Gap::stretch() {
    return p_.stretch_um * (1 + depth_ / 1000 / p_.stretch_depth_mm) *
           (1 + p_.stretch_debris * debris_) * bridges_.gamma(STRETCH_SHAPE);
}

void Gap::tick(double height_um, double dt) {
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

}  // namespace plant
