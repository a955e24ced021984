// SPDX-License-Identifier: Apache-2.0
// The wire of a wire machine in its kerf: its place, the width of its gap, and its removal.
#pragma once

#include <cmath>
#include <cstdint>

#include "parameters.hpp"
#include "random.hpp"
#include "workpiece.hpp"

namespace plant {

// What is left after so many time constants; their number is nearly always that of the last call.
class Decay {
public:
    double operator()(double constants) {
        if (constants != constants_) {
            constants_ = constants;
            left_ = std::exp(-constants);
        }
        return left_;
    }

private:
    double constants_ = 0, left_ = 1;
};

class Wire {
public:
    // The caller owns the parameters, which must outlive this object.
    Wire(uint64_t seed, const MachineParameters& p) : p_(p), places_(seed, 4), flows_(seed, 5) {}

    // Puts the wire at its start, before an uncut workpiece.
    void reset();

    double radius_um() const { return p_.wire.diameter_mm * 500; }
    double area_mm2() const;   // of the wire's half that faces the work

    // Once per tick of dt seconds, with the place of the axes from the start.
    void tick(double x_um, double y_um, double dt);

    // Narrowest place between wire and work, at most `reach_um`; negative if they overlap.
    double gap_um() const { return gap_; }
    // Share of a half circle that is as near as the narrowest place, places weighted by how easily
    // they ignite.
    double engagement() const { return engagement_; }
    double hazard_per_us(double gap_um) const;

    // Volume of a discharge's crater, um3, not scaled: a random draw.
    double crater_um3(double amps, double us, Random& random) const;
    // Called with a discharge's removed volume, scaled, and its charge.
    void erode(double volume_um3, double ampere_us);

    // Debris: its share of the gap's volume, after dt seconds of flushing.
    double flushed(double gap_um, double dt);
    void put_debris(double share, double gap_um) { debris_um3_ = share * volume_um3(gap_um); }
    double debris(double gap_um) const;

    double mean_a() const { return mean_a_; }
    bool broken() const { return broken_; }
    double x_um() const { return x_; }
    double y_um() const { return y_; }
    Workpiece& workpiece() { return workpiece_; }
    const Workpiece& workpiece() const { return workpiece_; }

private:
    // Directions are told apart by a pseudo-angle, which needs no arctangent.
    static constexpr unsigned SECTORS = 128;
    struct Sector {
        double distance;
        int32_t x, y;
        bool found;
    };

    double volume_um3(double gap_um) const;
    void survey();

    const MachineParameters& p_;
    Workpiece workpiece_;
    Random places_, flows_;
    double x_ = 0, y_ = 0;              // the wire's axis, on the workpiece
    double seen_x_ = 0, seen_y_ = 0;    // place of the last survey
    bool stale_ = true;
    double gap_ = 1e3, engagement_ = 1;
    Sector sectors_[SECTORS];
    int32_t nearest_x_ = 0, nearest_y_ = 0;     // cell
    double weights_[SECTORS];
    double push_x_ = 0, push_y_ = 0;    // deflection
    double debris_um3_ = 0, flow_ = 0;  // and the logarithm of the flow over its usual value
    double mean_a_ = 0;
    bool broken_ = false;
    Decay slackens_, forgets_, flow_keeps_;     // of the deflection, the mean current and the flow
};

}  // namespace plant
