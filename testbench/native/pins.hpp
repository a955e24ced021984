// SPDX-License-Identifier: Apache-2.0
// The pins of a controller's class, Verilator's or ours.
#pragma once

#include <cstdint>

#include "plant.hpp"

namespace bench {

// The controller's inputs from a clock on.
struct Inputs {
    uint64_t clock;
    plant::ToController to;
    uint8_t rx;
};

// Reads the controller's outputs. `shown` is set if one may have changed that is not among the
// first, which change in most clocks: those, and tx, are OFTEN in controller.py.
template <class Controller>
void outputs(Controller& controller, plant::FromController& from) {
    from.dac = static_cast<uint8_t>(controller.dac());
    from.gap_reference = static_cast<uint8_t>(controller.gap_reference());
    from.adc_select = static_cast<uint8_t>(controller.adc_select());
    from.adc_clock = static_cast<uint8_t>(controller.adc_clock());
    from.adc_command = static_cast<uint8_t>(controller.adc_command());
    if (!controller.shown)
        return;
    controller.shown = false;
    from.dac_negative = static_cast<uint8_t>(controller.dac_negative());
    from.step = static_cast<uint8_t>(controller.step());
    from.dir = static_cast<uint8_t>(controller.dir());
    from.drive_enable = static_cast<uint8_t>(controller.drive_enable());
    from.gap_on = static_cast<uint8_t>(controller.gap_on());
    from.gap_sense = static_cast<uint8_t>(controller.gap_sense());
    from.gap_level = static_cast<uint8_t>(controller.gap_level());
    from.gap_supply = static_cast<uint8_t>(controller.gap_supply());
    from.flash_select = static_cast<uint8_t>(controller.flash_select());
    from.flash_clock = static_cast<uint8_t>(controller.flash_clock());
    from.flash_command = static_cast<uint8_t>(controller.flash_command());
    from.auxiliary_strobe = static_cast<uint8_t>(controller.auxiliary_strobe());
    from.auxiliary_code = static_cast<uint16_t>(controller.auxiliary_code());
    from.contactor = static_cast<uint8_t>(controller.contactor());
    from.safe = static_cast<uint8_t>(controller.safe());
}

template <class Controller>
void apply(Controller& controller, const plant::ToController& to, uint8_t rx) {
    controller.set_rx(rx);
    controller.set_enc_a(to.enc_a);
    controller.set_enc_b(to.enc_b);
    controller.set_enc_index(to.enc_index);
    controller.set_gap_high(to.gap_high);
    controller.set_gap_arc(to.gap_arc);
    controller.set_gap_short(to.gap_short);
    controller.set_gap_current(to.gap_current);
    controller.set_gap_noise(to.gap_noise);
    controller.set_adc_data(to.adc_data);
    controller.set_flash_data(to.flash_data);
    controller.set_estop(to.estop);
    controller.set_drive_fault(to.drive_fault);
    controller.set_limit_low(to.limit_low);
    controller.set_limit_high(to.limit_high);
    controller.set_fluid_low(to.fluid_low);
    controller.set_fin(to.fin);
    controller.set_arm(to.arm);
    controller.set_power_good(to.power_good);
}

}  // namespace bench
