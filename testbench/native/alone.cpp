// SPDX-License-Identifier: Apache-2.0
// The plant alone; a test drives the outputs of a controller.
#include "station.hpp"

using bench::Station;

namespace {

struct Alone {
    explicit Alone(uint64_t seed) : station(seed) {
        from.contactor = 1;
        station.machine.close_contactor();
    }
    Station station;
    plant::FromController from;
    plant::ToController to;
    uint32_t references[3] = {0, 0, 0};  // densities of the streams, in 1/32768
};

// Whether an evenly spread bit stream of a density in 1/32768 is high in this clock.
bool high(uint64_t clock, uint32_t density) {
    return ((clock + 1) * density >> 15) != (clock * density >> 15);
}

uint64_t packed(const plant::ToController& to) {
    return static_cast<uint64_t>(to.enc_a) | static_cast<uint64_t>(to.enc_b) << 3 |
           static_cast<uint64_t>(to.gap_high) << 6 | static_cast<uint64_t>(to.gap_arc) << 7 |
           static_cast<uint64_t>(to.gap_short) << 8 | static_cast<uint64_t>(to.gap_current) << 9 |
           static_cast<uint64_t>(to.fin) << 10 | static_cast<uint64_t>(to.estop) << 11 |
           static_cast<uint64_t>(to.fluid_low) << 12 |
           static_cast<uint64_t>(to.drive_fault) << 13 |
           static_cast<uint64_t>(to.limit_low) << 16 | static_cast<uint64_t>(to.limit_high) << 19 |
           static_cast<uint64_t>(to.gap_noise) << 22 | static_cast<uint64_t>(to.adc_data) << 23 |
           static_cast<uint64_t>(to.enc_index) << 24;
}

}  // namespace

extern "C" {

Alone* alone_create(uint64_t seed) { return new Alone(seed); }
void alone_free(Alone* a) { delete a; }
void* alone_station(Alone* a) { return &a->station; }

void alone_outputs(Alone* a, uint32_t drive_enable, uint32_t gap_on, uint32_t gap_sense,
                   uint32_t gap_level, uint32_t gap_supply, uint32_t strobe, uint32_t code,
                   uint32_t contactor) {
    a->from.drive_enable = static_cast<uint8_t>(drive_enable);
    a->from.gap_on = static_cast<uint8_t>(gap_on);
    a->from.gap_sense = static_cast<uint8_t>(gap_sense);
    a->from.gap_level = static_cast<uint8_t>(gap_level);
    a->from.gap_supply = static_cast<uint8_t>(gap_supply);
    a->from.auxiliary_strobe = static_cast<uint8_t>(strobe);
    a->from.auxiliary_code = static_cast<uint16_t>(code);
    a->from.contactor = static_cast<uint8_t>(contactor);
}

void alone_step(Alone* a, uint32_t step, uint32_t dir) {
    a->from.step = static_cast<uint8_t>(step);
    a->from.dir = static_cast<uint8_t>(dir);
}

// Pins of the converter.
void alone_serial(Alone* a, uint32_t select, uint32_t clock, uint32_t command) {
    a->from.adc_select = static_cast<uint8_t>(select);
    a->from.adc_clock = static_cast<uint8_t>(clock);
    a->from.adc_command = static_cast<uint8_t>(command);
}

// Densities of the references of the comparators.
void alone_references(Alone* a, uint32_t open, uint32_t arc, uint32_t shorted) {
    a->references[0] = open;
    a->references[1] = arc;
    a->references[2] = shorted;
}

// Runs until an input of the controller under `mask` changes, or for a number of clocks; returns
// how many. `density` is the velocity command of Z in 1/32768, as an evenly spread bit stream.
uint64_t alone_run(Alone* a, uint64_t clocks, int32_t density, uint64_t mask, uint64_t* inputs) {
    static_assert(plant::Z == 2, "");
    const uint64_t before = packed(a->to) & mask;
    const uint32_t size = static_cast<uint32_t>(density < 0 ? -density : density);
    uint8_t rx;
    uint64_t run = 0;
    while (run < clocks) {
        const uint64_t now = a->station.clock;
        a->from.dac = high(now, size) ? 1u << plant::Z : 0;
        unsigned reference = 0;
        for (unsigned i = 0; i < 3; ++i)
            reference |= static_cast<unsigned>(high(now, a->references[i])) << i;
        a->from.gap_reference = static_cast<uint8_t>(reference);
        a->from.dac_negative = density < 0 ? 1u << plant::Z : 0;
        a->station.step(a->from, true, a->to, rx);
        ++run;
        if ((packed(a->to) & mask) != before)
            break;
    }
    *inputs = packed(a->to);
    return run;
}

}  // extern "C"
