// SPDX-License-Identifier: Apache-2.0
// The wire of a wire machine in its kerf: where it is, how wide its gap is, and what it removes.
#pragma once

#include <cstdint>

#include "random.hpp"
#include "workpiece.hpp"

namespace plant {

// Units are in the names; the sources of the numbers are in wire.toml.
struct WireParameters {
    double diameter_mm = 0.2;
    double thickness_mm = 10;
    double cell_um = 2;
    double start_x_mm = 0, start_y_mm = 0;  // where it stands at the start, on the workpiece
    double removal_scale = 60;
    double crater_us = 3;          // discharge of the table of craters
    double deflection_um_a = 0.5;  // per mean ampere, away from the discharges
    double deflection_ms = 5;
    double break_a = 5;            // mean current of the discharges that breaks it; 0: none does
    double break_ms = 20;          // of so long
    // Ignition: mean delay (square g^2 + linear g + constant) / ln 2
    double delay_square_us = 0.48;
    double delay_linear_us = -3.69;
    double delay_constant_us = 14.05;
    double delay_least_um = 3.84;  // the law is not taken below
    double reach_um = 80;          // wider than this nothing ignites
    double engagement_um = 4;      // places so much wider ignite e times more rarely; 0: all alike
    // Debris
    double flow_mm3_s = 3;         // fluid through the gap, as wide as
    double flow_gap_um = 25;       // this or wider; with the cube of the width below
    double flow_debris = 3;        // e-fold less for so much of it
    double flow_spread = 0;        // deviation of the logarithm of the flow, along with time
    double flow_time_s = 5;        // for which it is much the same
    double clog_least = 0.3;       // debris that shorts a gap of no width,
    double clog_per_um = 0.02;     // more for each um of width,
    double clog_most = 0.95;       // at most
    double random_short_per_us = 0.001;  // in a gap of no width,
    double random_short_um = 40;   // none from this width on
    double random_short_us = 100;  // how long they last
};

class Wire {
public:
    explicit Wire(uint64_t seed) : places_(seed, 4), flows_(seed, 5) {}

    void configure(const WireParameters& p) { p_ = p; }
    void reset(const Stock& stock);

    double radius_um() const { return p_.diameter_mm * 500; }
    double area_mm2() const;   // of the half that faces the work
    const WireParameters& parameters() const { return p_; }

    // Once per tick of dt seconds: the axes are at a place, from the start.
    void tick(double x_um, double y_um, double dt);

    // Narrowest place between wire and work, beyond `reach_um` just that; negative where they meet.
    double gap_um() const { return gap_; }
    // Share of a half circle that is as near as the narrowest place, places weighted by how easily
    // they ignite.
    double engagement() const { return engagement_; }
    double hazard_per_us(double gap_um) const;

    // Crater of a discharge, um3, not scaled: drawn.
    double crater_um3(double amps, double us, Random& random) const;
    // A discharge has removed so much, scaled, and carried so much charge.
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

    WireParameters p_;
    Workpiece workpiece_;
    Random places_, flows_;
    double x_ = 0, y_ = 0;              // the wire's axis, on the workpiece
    double seen_x_ = 0, seen_y_ = 0;    // where it was surveyed last
    bool stale_ = true;
    double gap_ = 1e3, engagement_ = 1;
    Sector sectors_[SECTORS];
    double weights_[SECTORS];
    double push_x_ = 0, push_y_ = 0;    // deflection
    double debris_um3_ = 0, flow_ = 0;  // and the logarithm of what the flow is times its usual
    double mean_a_ = 0;
    bool broken_ = false;
};

}  // namespace plant
