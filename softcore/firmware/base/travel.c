// SPDX-License-Identifier: Apache-2.0
#include "base/travel.h"

#include "base/settings.h"
#include "base/units.h"

#define ALL(place) {place, place, place}

const travel_range TRAVEL_ALL = {.low = ALL(-UNITS_POSITION_LIMIT),
                                 .high = ALL(UNITS_POSITION_LIMIT)};

const travel_range *travel_now(void) {
    static travel_range off;
    hal_limits limits = hal_limits_read();
    if (!limits.leaving)
        return settings_travel();
    off = *settings_travel();
    off.onto_low = limits.low;
    off.onto_high = limits.high;
    return &off;
}

bool travel_onto(const travel_range *t, unsigned axis, bool up) {
    return (up ? t->onto_high : t->onto_low) >> axis & 1;
}

bool travel_refuses(const travel_range *t, unsigned axis, int32_t from, int32_t to) {
    if (to > from && (to > t->high[axis] || t->onto_high >> axis & 1))
        return true;
    if (to < from && (to < t->low[axis] || t->onto_low >> axis & 1))
        return true;
    return to > UNITS_POSITION_LIMIT || to < -UNITS_POSITION_LIMIT;
}
