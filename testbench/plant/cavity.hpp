// SPDX-License-Identifier: Apache-2.0
// The side walls of a die-sunk cavity: by how much it is wider than its electrode, by depth.
#pragma once

#include <cstddef>
#include <vector>

#include "parameters.hpp"

namespace plant {

// A prismatic electrode sinks into solid material. The cavity is counted in layers of equal
// thickness from the top down; the lowest one is as thick as it is deep so far. A layer keeps its
// volume, and its opening w follows from that: a convex electrode of area A and perimeter P, opened
// by w on all sides with round corners, has the area A + P w + pi w^2.
//
// A discharge of current I that burns for t cuts the front as wide as its overcut s:
//   s = overcut_um (I / reference_a)^current_power (t / reference_us)^time_power.
// Debris carries a part of it to the walls beside the electrode. Each layer of which a height h is
// beside the electrode has the weight
//   P h wall_debris c exp((s - w) / slope_um), for debris c and with an exponent of at most 8;
// the front has the weight of its own area, A + P s + pi s^2. The volume is shared by these weights.
class Cavity {
public:
    // Starts again with a solid workpiece.
    void reset(const CavityParameters& p, double area_mm2);

    // Takes a volume away by one discharge. The electrode's lower end is `below_um` below the top.
    // Returns by how much the front went deeper, um.
    double take(double mm3, double amps, double microseconds, double debris, double below_um);

    // Keeps every discharge from now on, so that `again` can tell what other walls they make.
    void keep() { keep_ = true; }
    // The cavity that the kept discharges make with other numbers. How deep the electrode was is
    // kept, too: what other walls take from the front does not change it.
    Cavity again(const CavityParameters& p) const;

    size_t layers() const { return layers_.size(); }
    double bottom_um(size_t layer) const;   // depth of its lower end
    double opening_um(size_t layer) const { return layers_[layer].opening; }
    // Volume of the cavity, counted from its openings.
    double volume_mm3() const;

private:
    struct Layer {
        double height = 0, volume = 0;      // um, mm3
        double opening = 0, weight = 0;     // um; of the present discharge
    };

    struct Discharge {
        double mm3, amps, microseconds, debris, below_um;
    };

    double section_mm2(double opening_um) const;
    double opening_of(double section_mm2) const;
    void deepen(double um, double section_mm2);

    CavityParameters p_;
    double area_ = 1;
    bool keep_ = false;
    std::vector<Discharge> kept_;
    std::vector<Layer> layers_;
};

}  // namespace plant
