// SPDX-License-Identifier: Apache-2.0
// The gap of a wire machine: a wire in its kerf.
#pragma once

#include "gap.hpp"
#include "wire.hpp"

namespace plant {

class WireGap : public Gap {
public:
    WireGap(uint64_t seed, const MachineParameters& p, const GapForces& forces)
        : Gap(seed, p, forces), wire_(seed, p) {}

    void start() override;
    const Wire& wire() const { return wire_; }
    Workpiece& workpiece() { return wire_.workpiece(); }

protected:
    double area_mm2() const override { return wire_.area_mm2(); }
    bool interrupted() const override { return wire_.broken(); }
    bool shorted_for_a_while() const override { return random_short_us_ > 0; }
    double hazard() const override;
    double crater_mm3(double microseconds) override;
    void remove(double mm3, double microseconds) override;
    void change(const Place& place, double dt) override;

private:
    void touch(const Place& place);

    Wire wire_;
    double touched_x_um_ = 0, touched_y_um_ = 0;    // where the contact was closest
    double random_short_us_ = 0;  // remaining time of a random short
};

}  // namespace plant
