// SPDX-License-Identifier: Apache-2.0
// The workpiece of the wire machine, seen from above: the remaining share of every cell.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "parameters.hpp"

namespace plant {

// A plan view in square cells, which exist only near the wire's path. The sheet is as thick as the
// workpiece and the same at every height: a crater, far smaller than that thickness, removes a
// share of its cell. Volumes are counted in whole grains, so that the loss of the cells equals the
// volume removed exactly.
class Workpiece {
public:
    static constexpr unsigned GRAINS = 65535;  // of a whole cell
    static constexpr int SIDE = 64;            // cells of a tile's side

    struct Tile {
        uint64_t whole = 0;  // grains when it was made
        std::array<uint16_t, SIDE * SIDE> left{};
        std::array<uint64_t, SIDE> some{};  // by row, a bit for each cell that has material
    };

    // Starts again with the stock.
    void reset(const StockParameters& stock, const WorkpieceParameters& p);

    double cell_um() const { return cell_; }
    double grain_um3() const { return grain_; }

    // Calls `found(x, y, left)` with the indices of every cell that still has material, and whose
    // centre is between two distances of a point.
    template <class Found>
    void each(double x_um, double y_um, double inner_um, double outer_um, const Found& found);

    double centre(int32_t index) const { return (index + 0.5) * cell_; }
    // Distance from a point to a cell's surface, which recedes by a cell as the cell is removed.
    double distance(double x_um, double y_um, int32_t x, int32_t y, unsigned left) const;

    // What is left of a cell; 0 for one that `each` has never come near to.
    unsigned left(int32_t x, int32_t y) const;

    // Removes a volume near a cell, nearest to the point first; returns the volume found.
    double take(int32_t x, int32_t y, double x_um, double y_um, double volume_um3);

    double taken_um3() const { return static_cast<double>(taken_) * grain_; }
    // The same volume, counted from the cells.
    double missing_um3() const;

    // Cells seen so far: least X and Y, and their number.
    void extent(int64_t out[4]) const;
    // Grains left of the cells of a rectangle, row by row; of those never looked at, the stock's.
    void copy(int64_t x, int64_t y, int64_t columns, int64_t rows, uint16_t* out);

private:
    static int32_t tile_of(int32_t index) { return index >> 6; }
    static int32_t cell_in(int32_t index) { return index & (SIDE - 1); }
    static size_t cell_at(int32_t x, int32_t y) {
        return static_cast<size_t>(cell_in(y) * SIDE + cell_in(x));
    }
    Tile& tile(int32_t x, int32_t y);  // by the tile's indices
    uint16_t fresh(int32_t x, int32_t y) const;

    struct Near {
        double distance;
        Tile* tile;
        size_t row, column;
    };

    StockParameters stock_;
    double cell_ = 2, grain_ = 1, start_x_ = 0, start_y_ = 0, owed_ = 0;
    uint64_t taken_ = 0;
    std::unordered_map<uint64_t, std::unique_ptr<Tile>> tiles_;
    std::vector<Near> near_;
};

template <class Found>
void Workpiece::each(double x_um, double y_um, double inner_um, double outer_um,
                     const Found& found) {
    const auto index = [this](double um) {  // std::floor, but without a call
        const double cells = um / cell_;
        const auto whole = static_cast<int32_t>(cells);
        return whole - (cells < whole);
    };
    const int32_t low = index(y_um - outer_um), high = index(y_um + outer_um);
    const int32_t left = index(x_um - outer_um), right = index(x_um + outer_um);
    for (int32_t ty = tile_of(low); ty <= tile_of(high); ++ty)
        for (int32_t tx = tile_of(left); tx <= tile_of(right); ++tx) {
            const Tile& here = tile(tx, ty);
            const int32_t first = tx * SIDE, last = first + SIDE - 1;
            for (int32_t y = std::max(low, ty * SIDE); y <= std::min(high, ty * SIDE + SIDE - 1);
                 ++y) {
                const auto at = static_cast<size_t>(cell_in(y));
                const uint64_t some = here.some[at];
                if (some == 0)
                    continue;
                const double dy = centre(y) - y_um;
                const double outer = outer_um * outer_um - dy * dy;
                if (outer < 0)
                    continue;
                const double reach = std::sqrt(outer);
                const double inner = inner_um * inner_um - dy * dy;
                const double spared = inner > 0 ? std::sqrt(inner) : 0;
                const uint16_t* row = &here.left[at * SIDE];
                const auto span = [&](double from_um, double to_um) {
                    const int32_t from = std::max(first, index(from_um));
                    const int32_t to = std::min(last, index(to_um));
                    if (from > to)
                        return;
                    uint64_t rest = some & (~0ull << (from - first)) & (~0ull >> (last - to));
                    for (; rest != 0; rest &= rest - 1) {
                        const int column = __builtin_ctzll(rest);
                        found(first + column, y, row[column]);
                    }
                };
                if (spared > cell_) {
                    span(x_um - reach, x_um - spared);
                    span(x_um + spared, x_um + reach);
                } else {
                    span(x_um - reach, x_um + reach);
                }
            }
        }
}

inline double Workpiece::distance(double x_um, double y_um, int32_t x, int32_t y,
                                  unsigned left) const {
    const double dx = centre(x) - x_um, dy = centre(y) - y_um;
    return std::sqrt(dx * dx + dy * dy) + (0.5 - static_cast<double>(left) / GRAINS) * cell_;
}

}  // namespace plant
