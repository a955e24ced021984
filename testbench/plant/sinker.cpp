// SPDX-License-Identifier: Apache-2.0
#include "sinker.hpp"

#include <algorithm>

namespace plant {

namespace {

constexpr int STRETCH_SHAPE = 3;

}  // namespace

void SinkerGap::start() {
    height_ = p_.initial_gap_um;
    gap_ = distance_um({0, 0, height_});
    sides_ = static_cast<MachineKind>(static_cast<int>(p_.kind)) == MachineKind::cavity;
    cavity_.reset(p_.cavity, p_.gap.area_mm2);
    set_hazard();
}

double SinkerGap::hazard() const {
    const double folds =
        std::max(-8.0, (gap_ - p_.gap.ignition_gap_um) / p_.gap.ignition_slope_um);
    return std::exp(-folds) / p_.gap.ignition_delay_us;
}

double SinkerGap::crater_mm3(double microseconds) {
    const double seconds = microseconds * 1e-6;
    const double volume = p_.gap.removal_mm3_min_a / 60 * amps_ * seconds;
    return volume * std::max(0.0, 1 + p_.gap.removal_spread * sparks_.normal());
}

void SinkerGap::remove(double mm3, double microseconds) {
    const double thickness = mm3 / p_.gap.area_mm2 * 1000;  // um
    depth_ += sides_ ? cavity_.take(mm3, amps_, microseconds, debris_, -height_) : thickness;
    // What the walls lose is debris as well.
    debris_ += thickness / std::max(gap_, 10.0);
}

double SinkerGap::stretch() {
    return p_.debris.stretch_um * (1 + depth_ / 1000 / p_.debris.stretch_depth_mm) *
           (1 + p_.debris.stretch_debris * debris_) * bridges_.gamma(STRETCH_SHAPE);
}

// From the electrode to the nearest surface of the work, negative inside. The electrode is a
// cylinder with a flat end.
double SinkerGap::distance_um(const Place& place) const {
    const double above = place.height_um + depth_;
    const auto shape = static_cast<WorkShape>(static_cast<int>(p_.work.shape));
    if (shape == WorkShape::plane)
        return above;
    const double x = place.x_um - p_.work.centre_x_mm * 1000;
    const double y = place.y_um - p_.work.centre_y_mm * 1000;
    const double half = p_.work.size_mm * 500, radius = p_.work.electrode_mm * 500;
    double beside = 0;  // between the electrode's side and that of the shape, seen from above
    if (shape == WorkShape::block) {
        const double over_x = std::abs(x) - half, over_y = std::abs(y) - half;
        beside = std::hypot(std::max(over_x, 0.0), std::max(over_y, 0.0)) +
                 std::min(std::max(over_x, over_y), 0.0) - radius;
    } else {
        const double off = std::hypot(x, y) - half;
        beside = (shape == WorkShape::hole ? -off : off) - radius;
    }
    const double base = above + p_.work.depth_mm * 1000;
    if (above >= 0)
        return std::min(base, std::hypot(std::max(beside, 0.0), above));
    return std::min(base, beside >= 0 ? beside : std::max(above, beside));
}

void SinkerGap::change(const Place& place, double dt) {
    const double lift = place.height_um - height_;
    height_ = place.height_um;
    gap_ = or_forced(distance_um(place), force_.gap_um);

    // Removal is accelerated. So are processes per unit of removal: flushing, growth of bridges.
    // Pumping by the moving electrode is not, as it depends on distance.
    const double depth = std::max(0.0, depth_ / 1000);  // mm
    const double scaled = dt * p_.removal_scale;
    const double flushing_s = p_.debris.time_s * (1 + depth / p_.debris.depth_mm);
    debris_ *= 1 - std::min(1.0, scaled / flushing_s);
    if (lift > 0) {
        const double width = std::max(gap_, 5.0);
        const double fresh = width / (width + 1000 * depth / p_.debris.exchange_depth_mm);
        debris_ *= 1 - std::min(1.0, lift / width) * fresh;
    }
    debris_ = or_forced(debris_, force_.debris);

    // A bridge grows of debris in the field of the pulses, or of the contact itself.
    if (bridged_) {
        draw_bridge();
        return;
    }
    const double rate = sparking() ? p_.debris.bridge_rate_per_s * debris_ * debris_ *
                                         std::exp(-std::max(gap_, 0.0) / p_.debris.bridge_gap_um)
                                   : 0;
    if (gap_ < p_.gap.contact_um || bridges_.uniform() < rate * scaled)
        build_bridge(stretch());
}

}  // namespace plant
