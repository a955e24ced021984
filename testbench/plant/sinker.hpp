// SPDX-License-Identifier: Apache-2.0
// The gap of a die-sinking machine: an electrode above the workpiece, or in a cavity with sides.
#pragma once

#include "cavity.hpp"
#include "gap.hpp"

namespace plant {

class SinkerGap : public Gap {
public:
    using Gap::Gap;

    void start() override;
    double depth_um() const { return depth_; }  // of the cavity
    void keep_discharges() { cavity_.keep(); }
    const Cavity& cavity() const { return cavity_; }  // empty if the machine has no sides

protected:
    double area_mm2() const override { return p_.gap.area_mm2; }
    double hazard() const override;
    double crater_mm3(double microseconds) override;
    void remove(double mm3, double microseconds) override;
    void change(const Place& place, double dt) override;

private:
    double stretch();
    double distance_um(const Place& place) const;

    double height_ = 0, depth_ = 0;
    bool sides_ = false;
    Cavity cavity_;
};

}  // namespace plant
