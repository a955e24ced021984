// SPDX-License-Identifier: Apache-2.0
#include "wire_gap.hpp"

#include <algorithm>
#include <cmath>

namespace plant {

namespace {

constexpr int STRETCH_SHAPE = 3;

}  // namespace

void WireGap::start() {
    wire_.reset();
    gap_ = wire_.gap_um();
    set_hazard();
}

double WireGap::hazard() const {
    const double engaged = std::isnan(force_.gap_um) ? wire_.engagement() : 1;
    return wire_.hazard_per_us(gap_) * engaged;
}

double WireGap::crater_mm3(double microseconds) {
    return wire_.crater_um3(amps_, microseconds, sparks_) * 1e-9;
}

void WireGap::remove(double mm3, double microseconds) {
    wire_.erode(mm3 * 1e9, amps_ * microseconds);
}

void WireGap::change(const Place& place, double dt) {
    wire_.tick(place.x_um, place.y_um, dt);
    gap_ = or_forced(wire_.gap_um(), force_.gap_um);
    debris_ = or_forced(wire_.flushed(gap_, dt), force_.debris);
    if (!std::isnan(force_.debris))
        wire_.put_debris(debris_, gap_);

    // Particles in the flow short the gap for a while.
    const DebrisParameters& d = p_.debris;
    if (bridged_) {
        touch(place);
    } else if (gap_ < p_.gap.contact_um ||
               debris_ > std::min(d.clog_least + d.clog_per_um * gap_, d.clog_most)) {
        build_bridge(d.stretch_um * bridges_.gamma(STRETCH_SHAPE));
        touched_x_um_ = place.x_um;
        touched_y_um_ = place.y_um;
    }
    const double us = dt * 1e6;
    const double chance =
        sparking() ? d.random_short_per_us * us * (1 - gap_ / d.random_short_um) : 0;
    if (random_short_us_ > 0)
        random_short_us_ -= us;
    else if (chance > 0 && bridges_.uniform() < chance)
        random_short_us_ = d.random_short_us;
}

// A contact or a clogged gap stays shorted until the wire has drawn back beyond the stretch: the gap
// is so much wider, or the wire so far from where it was closest. In its kerf the gap to the sides
// never is.
void WireGap::touch(const Place& place) {
    if (gap_ < bridge_gap_) {
        touched_x_um_ = place.x_um;
        touched_y_um_ = place.y_um;
    }
    draw_bridge();
    const double way = std::hypot(place.x_um - touched_x_um_, place.y_um - touched_y_um_);
    bridged_ = bridged_ && way <= bridge_stretch_;
}

}  // namespace plant
