// SPDX-License-Identifier: Apache-2.0
#include "workpiece.hpp"

#include <limits>

namespace plant {

namespace {

constexpr double FAR_UM = 1e9;
constexpr double PI = 3.14159265358979323846;

uint64_t key(int32_t x, int32_t y) {
    return static_cast<uint64_t>(static_cast<uint32_t>(x)) << 32 | static_cast<uint32_t>(y);
}

// ---- the stock, in the workpiece's own coordinates

// Stock width at a place along the contour; before the first step it is that of the first step.
double left_um(const StockParameters& stock, double along_mm) {
    double width = stock.steps > 0 ? stock.width_um[0] : 0;
    for (size_t i = 1; i < static_cast<size_t>(stock.steps) && i < StockParameters::STEPS; ++i)
        if (along_mm >= stock.at_mm[i])
            width = stock.width_um[i];
    return width;
}

// Distance to the surface in um, negative inside. `start` is the wire's start.
double distance_um(const StockParameters& stock, double x_um, double y_um, double start_x_um,
                   double start_y_um) {
    switch (static_cast<StockKind>(static_cast<int>(stock.kind))) {
    case StockKind::wall:  // along X, its finished surface at Y 0, the workpiece behind it
        return -y_um - left_um(stock, x_um / 1000);
    case StockKind::circle: {  // about the origin, from +X on, counter-clockwise
        const double radius = stock.size_x_mm * 500;
        double angle = std::atan2(y_um, x_um);
        if (angle < 0)
            angle += 2 * PI;
        return std::hypot(x_um, y_um) - radius - left_um(stock, angle * radius / 1000);
    }
    case StockKind::rectangle: {
        // About the origin, from the corner of least X and Y on, counter-clockwise.
        const double half_x = stock.size_x_mm * 500, half_y = stock.size_y_mm * 500;
        const double over_x = std::abs(x_um) - half_x, over_y = std::abs(y_um) - half_y;
        const double inside = std::min(std::max(over_x, over_y), 0.0);
        const double distance = inside + std::hypot(std::max(over_x, 0.0), std::max(over_y, 0.0));
        const double x = std::clamp(x_um, -half_x, half_x), y = std::clamp(y_um, -half_y, half_y);
        double along = 0;
        if (over_y > over_x)
            along = y < 0 ? x + half_x : 2 * half_x + 2 * half_y + (half_x - x);
        else
            along = x > 0 ? 2 * half_x + (y + half_y) : 4 * half_x + 2 * half_y + (half_y - y);
        return distance - left_um(stock, along / 1000);
    }
    default: {
        const double plate = stock.edge_mm * 1000 - x_um;
        const double from_start = std::hypot(x_um - start_x_um, y_um - start_y_um);
        return std::max(plate, stock.hole_mm > 0 ? stock.hole_mm * 500 - from_start : -FAR_UM);
    }
    }
}

}  // namespace

// ---- the cells

void Workpiece::reset(const StockParameters& stock, const WorkpieceParameters& p) {
    stock_ = stock;
    cell_ = p.cell_um;
    grain_ = cell_ * cell_ * p.thickness_mm * 1000 / GRAINS;
    start_x_ = p.start_x_mm * 1000;
    start_y_ = p.start_y_mm * 1000;
    owed_ = 0;
    taken_ = 0;
    tiles_.clear();
}

// A cell that the surface cuts has the share that lies inside.
uint16_t Workpiece::fresh(int32_t x, int32_t y) const {
    const double distance = distance_um(stock_, centre(x), centre(y), start_x_, start_y_);
    const double share = std::clamp(0.5 - distance / cell_, 0.0, 1.0);
    return static_cast<uint16_t>(std::lround(share * GRAINS));
}

Workpiece::Tile& Workpiece::tile(int32_t x, int32_t y) {
    auto& place = tiles_[key(x, y)];
    if (!place) {
        place = std::make_unique<Tile>();
        for (int32_t row = 0; row < SIDE; ++row)
            for (int32_t column = 0; column < SIDE; ++column) {
                const uint16_t grains = fresh(x * SIDE + column, y * SIDE + row);
                place->left[static_cast<size_t>(row * SIDE + column)] = grains;
                place->some[static_cast<size_t>(row)] |= static_cast<uint64_t>(grains > 0) << column;
                place->whole += grains;
            }
    }
    return *place;
}

unsigned Workpiece::left(int32_t x, int32_t y) const {
    const auto found = tiles_.find(key(tile_of(x), tile_of(y)));
    return found == tiles_.end() ? 0 : found->second->left[cell_at(x, y)];
}

double Workpiece::take(int32_t x, int32_t y, double x_um, double y_um, double volume_um3) {
    owed_ += volume_um3 / grain_;
    auto wanted = static_cast<uint64_t>(owed_);
    owed_ -= static_cast<double>(wanted);
    const uint64_t before = taken_;
    // Half a disc of the crater's area; a larger one if that holds too little material.
    const double place_x = centre(x), place_y = centre(y);
    const double area = static_cast<double>(wanted) / GRAINS * cell_ * cell_;
    double radius = std::sqrt(2 * area / PI) + 2 * cell_;
    for (int tries = 0; wanted > 0 && tries < 4; ++tries, radius *= 2) {
        near_.clear();
        each(place_x, place_y, 0, radius, [&](int32_t cx, int32_t cy, unsigned left) {
            near_.push_back({distance(x_um, y_um, cx, cy, left), &tile(tile_of(cx), tile_of(cy)),
                             static_cast<size_t>(cell_in(cy)), static_cast<size_t>(cell_in(cx))});
        });
        std::sort(near_.begin(), near_.end(),
                  [](const Near& a, const Near& b) { return a.distance < b.distance; });
        for (const Near& one : near_) {
            uint16_t& left = one.tile->left[one.row * SIDE + one.column];
            const auto grains = static_cast<uint16_t>(std::min<uint64_t>(wanted, left));
            left = static_cast<uint16_t>(left - grains);
            if (left == 0)
                one.tile->some[one.row] &= ~(1ull << one.column);
            wanted -= grains;
            taken_ += grains;
            if (wanted == 0)
                break;
        }
    }
    return static_cast<double>(taken_ - before) * grain_;
}

double Workpiece::missing_um3() const {
    uint64_t whole = 0, left = 0;
    for (const auto& [_, one] : tiles_) {
        whole += one->whole;
        for (const uint16_t grains : one->left)
            left += grains;
    }
    return static_cast<double>(whole - left) * grain_;
}

void Workpiece::extent(int64_t out[4]) const {
    int64_t low[2] = {0, 0}, high[2] = {0, 0};
    bool first = true;
    for (const auto& [name, _] : tiles_) {
        const int64_t place[2] = {static_cast<int32_t>(name >> 32), static_cast<int32_t>(name)};
        for (int i = 0; i < 2; ++i) {
            low[i] = first ? place[i] : std::min(low[i], place[i]);
            high[i] = first ? place[i] + 1 : std::max(high[i], place[i] + 1);
        }
        first = false;
    }
    for (int i = 0; i < 2; ++i) {
        out[i] = low[i] * SIDE;
        out[2 + i] = (high[i] - low[i]) * SIDE;
    }
}

void Workpiece::copy(int64_t x, int64_t y, int64_t columns, int64_t rows, uint16_t* out) {
    for (int64_t row = y; row < y + rows; ++row)
        for (int64_t column = x; column < x + columns; ++column) {
            const auto cx = static_cast<int32_t>(column), cy = static_cast<int32_t>(row);
            const auto found = tiles_.find(key(tile_of(cx), tile_of(cy)));
            *out++ = found == tiles_.end()
                         ? fresh(cx, cy)
                         : found->second->left[cell_at(cx, cy)];
        }
}

}  // namespace plant
