// SPDX-License-Identifier: Apache-2.0
#include "interp/retraction.h"

#include "base/units.h"

const char RETRACTION_LETTERS[ITEMS] = {'R', 'L', 'H', 'E', 'Q', 'Z'};

#define ALL_BUT_CEILING ((1u << ITEM_Z) - 1)

retraction_layer retraction_combined(const retraction_memory *memory) {
    retraction_layer set = memory->mdi;
    set.given |= memory->tape.given;
    for (unsigned item = 0; item < ITEMS; item++)
        if (memory->tape.given & (1u << item))
            set.value[item] = memory->tape.value[item];
    return set;
}

static bool whole(unsigned given) { return (given & ALL_BUT_CEILING) == ALL_BUT_CEILING; }

bool retraction_complete(const retraction_memory *memory) {
    return whole(memory->mdi.given | memory->tape.given);
}

bool retraction_check(const retraction_memory *memory, bool complete, uint32_t highest_speed,
                      const uint32_t columns[ITEMS], fault *f) {
    const retraction_layer set = retraction_combined(memory);
    for (unsigned item = 0; item < ITEM_Z; item++) {
        char letter = RETRACTION_LETTERS[item];
        if (!(set.given & (1u << item))) {
            if (complete)
                return fault_at(f, FAULT_RETRACTION, 0,
                                "the retraction data lack %c, and there is no default", letter);
            continue;
        }
        if (set.value[item] < 0 || (set.value[item] == 0 && item != ITEM_Q))
            return fault_at(f, FAULT_RETRACTION, columns[item],
                            "%c of the retraction data must be above zero", letter);
        bool speed = item == ITEM_R || item == ITEM_H || item == ITEM_E;
        if (speed && (uint32_t)set.value[item] > highest_speed)
            return fault_at(f, FAULT_RETRACTION, columns[item],
                            "the speed %c is above the machine's %u mm/min", letter,
                            highest_speed / 1000);
    }
    uint8_t both = 1u << ITEM_L | 1u << ITEM_Q;
    if ((set.given & both) == both && set.value[ITEM_Q] > set.value[ITEM_L])
        return fault_at(f, FAULT_RETRACTION, columns[ITEM_Q] ? columns[ITEM_Q] : columns[ITEM_L],
                        "the changeover distance Q is greater than the retractable limit L");
    return true;
}

hal_retraction retraction_rates(const retraction_layer *set, const retraction_jump *jump,
                                uint32_t start_rate, uint32_t acceleration) {
    hal_retraction data = {.valid = whole(set->given)};
    if (!data.valid)
        return data;
    data.rate = units_rate((uint32_t)set->value[ITEM_R]);
    data.limit = (uint32_t)set->value[ITEM_L];
    data.high_rate = units_rate((uint32_t)set->value[ITEM_H]);
    data.low_rate = units_rate((uint32_t)set->value[ITEM_E]);
    data.changeover = (uint32_t)set->value[ITEM_Q];
    data.low_lead = units_braking(data.low_rate, start_rate, acceleration);
    if (jump->period) {
        data.jump_distance = (uint32_t)jump->distance;
        data.jump_rate = units_rate(jump->speed);
        data.jump_high_rate = units_rate(jump->high);
    }
    return data;
}
