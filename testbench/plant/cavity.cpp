// SPDX-License-Identifier: Apache-2.0
#include "cavity.hpp"

#include <algorithm>
#include <cmath>

namespace plant {

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double MOST_FOLDS = 8;

}  // namespace

void Cavity::reset(const CavityParameters& p, double area_mm2) {
    p_ = p;
    area_ = area_mm2;
    layers_.clear();
    kept_.clear();
}

Cavity Cavity::again(const CavityParameters& p) const {
    Cavity other;
    other.reset(p, area_);
    for (const Discharge& one : kept_)
        other.take(one.mm3, one.amps, one.microseconds, one.debris, one.below_um);
    return other;
}

double Cavity::section_mm2(double opening_um) const {
    const double mm = opening_um / 1000;
    return area_ + p_.perimeter_mm * mm + PI * mm * mm;
}

double Cavity::opening_of(double section_mm2) const {
    const double more = std::max(0.0, section_mm2 - area_), perimeter = p_.perimeter_mm;
    // The root of PI w^2 + P w = more, in a form that loses no digits.
    return 2000 * more / (perimeter + std::sqrt(perimeter * perimeter + 4 * PI * more));
}

double Cavity::bottom_um(size_t layer) const {
    return static_cast<double>(layer) * p_.layer_um + layers_[layer].height;
}

double Cavity::volume_mm3() const {
    double sum = 0;
    for (const Layer& one : layers_)
        sum += section_mm2(one.opening) * one.height / 1000;
    return sum;
}

double Cavity::take(double mm3, double amps, double microseconds, double debris, double below_um) {
    if (keep_)
        kept_.push_back({mm3, amps, microseconds, debris, below_um});
    const double overcut = p_.overcut_um * std::pow(amps / p_.reference_a, p_.current_power) *
                           std::pow(microseconds / p_.reference_us, p_.time_power);
    const double front = section_mm2(overcut);
    double total = front, top = 0;
    for (Layer& one : layers_) {
        const double beside = std::min(one.height, below_um - top) / 1000;
        top += p_.layer_um;
        const double folds = std::min(MOST_FOLDS, (overcut - one.opening) / p_.slope_um);
        one.weight = beside <= 0 ? 0 : p_.perimeter_mm * beside * p_.wall_debris * debris *
                                           std::exp(folds);
        total += one.weight;
    }
    for (Layer& one : layers_)
        if (one.weight > 0) {
            one.volume += mm3 * one.weight / total;
            one.opening = opening_of(one.volume / one.height * 1000);
        }
    const double deeper = mm3 / total * 1000;
    deepen(deeper, front);
    return deeper;
}

void Cavity::deepen(double um, double section_mm2) {
    while (um > 0) {
        if (layers_.empty() || layers_.back().height >= p_.layer_um)
            layers_.emplace_back();
        Layer& last = layers_.back();
        const double room = p_.layer_um - last.height, here = std::min(um, room);
        last.height = here < room ? last.height + here : p_.layer_um;
        last.volume += section_mm2 * here / 1000;
        last.opening = opening_of(last.volume / last.height * 1000);
        um -= here;
    }
}

}  // namespace plant
