// SPDX-License-Identifier: Apache-2.0
#include "wire.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace plant {

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr double LN2 = 0.69314718055994530942;

constexpr double MOVED_UM = 0.25;   // motion after which the gap is surveyed again
constexpr double FOLDS = 3;         // places where discharges are more e-folds rarer do not count
constexpr double SLACK_UM = 4;      // the gap may have become so much wider since the last survey
constexpr double DENTED_UM = 20;    // no material is deeper inside the wire than this
constexpr double LEAST_GAP_UM = 2;  // a narrower gap is full of debris

// Craters of SPARC, the wire EDM simulator of ETH Zurich, measured: current, mean and deviation of
// the volume.
struct Crater {
    double amps, mean_um3, deviation_um3;
};
constexpr Crater CRATERS[] = {
    {30, 2164, 448},   {40, 2377, 524},   {60, 4867, 899},    {80, 5557, 1167},   {110, 6219, 1284},
    {155, 6030, 1006}, {215, 8914, 2949}, {305, 26469, 6472}, {425, 59550, 8998},
};

// Share of a full turn from +X, in (0, 1): monotonic in the angle, not linear.
double turn(double dx, double dy) {
    const double share = dy / (std::abs(dx) + std::abs(dy) + 1e-12);
    const double quarter = dx >= 0 ? share : 2 - share;  // -1 to 3
    return quarter >= 0 ? quarter / 4 : (quarter + 4) / 4;
}

// The angle for such a share.
double angle(double turn) {
    const double quarter = turn * 4;
    const double whole = std::floor(quarter), part = quarter - whole;
    return (whole + std::atan2(part, 1 - part) / (PI / 2)) * PI / 2;
}

// Widths of so many sectors, radians.
template <size_t COUNT>
std::array<double, COUNT> widths() {
    std::array<double, COUNT> found;
    for (size_t i = 0; i < COUNT; ++i) {
        const auto at = static_cast<double>(i);
        found[i] = angle((at + 1) / COUNT) - angle(at / COUNT);
    }
    return found;
}

}  // namespace

void Wire::reset() {
    workpiece_.reset(p_.stock, p_.workpiece);
    x_ = p_.workpiece.start_x_mm * 1000;
    y_ = p_.workpiece.start_y_mm * 1000;
    for (unsigned i = 0; i < SECTORS; ++i)
        sectors_[i].found = false;
    push_x_ = push_y_ = debris_um3_ = mean_a_ = 0;
    flow_ = p_.debris.flow_spread * flows_.normal();
    stale_ = true;
    broken_ = false;
    gap_ = p_.gap.reach_um;
}

double Wire::area_mm2() const { return PI * p_.wire.diameter_mm / 2 * p_.workpiece.thickness_mm; }

// Area of the half that faces the work.
double Wire::volume_um3(double gap_um) const {
    return area_mm2() * 1e6 * std::max(gap_um, LEAST_GAP_UM);
}

// ---- the gap

// The nearest cell in every direction, as far as it counts: up to a span beyond the nearest of all.
void Wire::survey() {
    stale_ = false;
    seen_x_ = x_;
    seen_y_ = y_;
    const double radius = radius_um();
    const double span = std::max(FOLDS * p_.gap.engagement_um, 2 * p_.workpiece.cell_um);
    double reach = std::min(p_.gap.reach_um, std::max(gap_, 0.0) + SLACK_UM) + span;
    const double inner = std::max(radius - DENTED_UM, 0.0);
    const double half = workpiece_.cell_um() / 2;   // from a cell's centre to its nearest surface
    // Beyond this no cell counts, as the one that was nearest at the last survey may still be there.
    double counts = 1e9;
    const unsigned still = workpiece_.left(nearest_x_, nearest_y_);
    const double there = workpiece_.distance(x_, y_, nearest_x_, nearest_y_, still);
    if (still != 0 && there > inner + half)
        counts = there + span;
    double nearest;
    // Squares of the distances of centres beyond which no cell of a sector is nearer than the one
    // found: its surface is up to half a cell nearer than its centre.
    std::array<double, SECTORS> beyond;
    for (;;) {
        nearest = 1e9;
        beyond.fill(1e18);
        for (auto& sector : sectors_)
            sector = {1e9, 0, 0, false};
        workpiece_.each(x_, y_, inner, std::min(radius + reach, counts) + half,
                        [&](int32_t x, int32_t y, unsigned left) {
            const double dx = workpiece_.centre(x) - x_, dy = workpiece_.centre(y) - y_;
            const unsigned at = static_cast<unsigned>(turn(dx, dy) * SECTORS) % SECTORS;
            if (dx * dx + dy * dy > beyond[at])
                return;
            const double distance = workpiece_.distance(x_, y_, x, y, left);
            if (distance > nearest + span)
                return;
            if (distance < sectors_[at].distance) {
                sectors_[at] = {distance, x, y, true};
                beyond[at] = (distance + workpiece_.cell_um()) * (distance + workpiece_.cell_um());
            }
            if (distance < nearest) {
                nearest = distance;
                nearest_x_ = x;
                nearest_y_ = y;
            }
        });
        if (nearest - radius + span <= reach || reach >= p_.gap.reach_um + span)
            break;
        reach = std::min(reach * 2, p_.gap.reach_um + span);
    }
    gap_ = std::min(nearest - radius, p_.gap.reach_um);
    if (p_.gap.engagement_um <= 0) {
        for (unsigned i = 0; i < SECTORS; ++i)
            weights_[i] = sectors_[i].found && sectors_[i].distance <= nearest;
        engagement_ = 1;
        return;
    }
    static const auto width = widths<SECTORS>();
    double sum = 0;
    for (unsigned i = 0; i < SECTORS; ++i) {
        weights_[i] = 0;
        if (!sectors_[i].found || sectors_[i].distance - nearest > span)
            continue;
        weights_[i] = width[i] * std::exp((nearest - sectors_[i].distance) / p_.gap.engagement_um);
        sum += weights_[i];
    }
    engagement_ = sum / PI;
}

void Wire::tick(double x_um, double y_um, double dt) {
    const double milliseconds = dt * 1000;
    const double slack = slackens_(milliseconds / p_.wire.deflection_ms);
    push_x_ *= slack;
    push_y_ *= slack;
    mean_a_ *= forgets_(milliseconds / p_.wire.break_ms);
    x_ = p_.workpiece.start_x_mm * 1000 + x_um + push_x_;
    y_ = p_.workpiece.start_y_mm * 1000 + y_um + push_y_;
    const double moved_x = x_ - seen_x_, moved_y = y_ - seen_y_;
    if (stale_ || moved_x * moved_x + moved_y * moved_y > MOVED_UM * MOVED_UM)
        survey();
}

double Wire::hazard_per_us(double gap_um) const {
    if (broken_ || gap_um >= p_.gap.reach_um)
        return 0;
    const double g = std::max(gap_um, p_.gap.delay_least_um);
    const double mean =
        p_.gap.delay_square_us * g * g + p_.gap.delay_linear_us * g + p_.gap.delay_constant_us;
    return LN2 / std::max(mean, 0.01);
}

// ---- removal

double Wire::crater_um3(double amps, double us, Random& random) const {
    const Crater* end = CRATERS + sizeof CRATERS / sizeof *CRATERS;
    const Crater* above = std::find_if(CRATERS, end, [&](const Crater& c) { return c.amps > amps; });
    Crater found;
    if (above == CRATERS) {  // below the table: in proportion to the current
        const double share = amps / CRATERS->amps;
        found = {amps, CRATERS->mean_um3 * share, CRATERS->deviation_um3 * share};
    } else if (above == end) {
        const double share = amps / end[-1].amps;
        found = {amps, end[-1].mean_um3 * share, end[-1].deviation_um3 * share};
    } else {
        const double share = (amps - above[-1].amps) / (above->amps - above[-1].amps);
        found = {amps, above[-1].mean_um3 + share * (above->mean_um3 - above[-1].mean_um3),
                 above[-1].deviation_um3 +
                     share * (above->deviation_um3 - above[-1].deviation_um3)};
    }
    const double drawn = found.mean_um3 + found.deviation_um3 * random.normal();
    return std::max(0.0, drawn) * us / p_.wire.crater_us;  // in proportion to the energy
}

void Wire::erode(double volume_um3, double ampere_us) {
    mean_a_ += ampere_us / (p_.wire.break_ms * 1000);
    broken_ |= p_.wire.break_a > 0 && mean_a_ > p_.wire.break_a;
    debris_um3_ += volume_um3;
    double sum = 0;
    for (const double weight : weights_)
        sum += weight;
    if (sum <= 0)
        return;  // a test has forced the width, and no cell is near
    double left = places_.uniform() * sum;
    unsigned at = SECTORS;
    for (unsigned i = 0; i < SECTORS && left >= 0; ++i)
        if (weights_[i] > 0) {
            at = i;
            left -= weights_[i];
        }
    const Sector& sector = sectors_[at];
    workpiece_.take(sector.x, sector.y, x_, y_, volume_um3);
    stale_ = true;
    const double dx = x_ - workpiece_.centre(sector.x), dy = y_ - workpiece_.centre(sector.y);
    const double push = p_.wire.deflection_um_a * ampere_us / (p_.wire.deflection_ms * 1000) /
                        std::max(std::hypot(dx, dy), 1.0);
    push_x_ += push * dx;
    push_y_ += push * dy;
}

// ---- debris

double Wire::debris(double gap_um) const { return std::min(debris_um3_ / volume_um3(gap_um), 1.0); }

// The fluid carries debris away. As removal is scaled, so are flushing and the time in which the
// flow changes.
double Wire::flushed(double gap_um, double dt) {
    const double scaled = dt * p_.removal_scale;
    if (p_.debris.flow_spread > 0) {  // Ornstein and Uhlenbeck's process
        const double keeps = flow_keeps_(scaled / p_.debris.flow_time_s);
        flow_ = flow_ * keeps +
                p_.debris.flow_spread * std::sqrt(1 - keeps * keeps) * flows_.normal();
    }
    const double widest = p_.debris.flow_gap_um;
    const double width = std::clamp(gap_um, LEAST_GAP_UM, widest) / widest;
    const double flow = p_.debris.flow_mm3_s * 1e9 * width * width * width *
                        std::exp(flow_ - p_.debris.flow_debris * debris(gap_um));
    debris_um3_ *= std::exp(-flow * scaled / volume_um3(gap_um));
    debris_um3_ = std::min(debris_um3_, volume_um3(gap_um));
    return debris(gap_um);
}

}  // namespace plant
