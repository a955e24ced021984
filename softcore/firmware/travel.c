// SPDX-License-Identifier: Apache-2.0
#include "travel.h"

#include "settings.h"
#include "units.h"

#define ALL(place) {place, place, place}

const travel_range TRAVEL_ALL = {.low = ALL(-UNITS_POSITION_LIMIT),
                                 .high = ALL(UNITS_POSITION_LIMIT)};

const travel_range *travel_now(void) {
    static travel_range now;
    hal_limits limits = hal_limits_read();
    now = *settings_travel();
    if (limits.leaving) {
        now.onto_low = limits.low;
        now.onto_high = limits.high;
    }
    return &now;
}

bool travel_onto(const travel_range *t, unsigned axis, bool up) {
    return (up ? t->onto_high : t->onto_low) >> axis & 1;
}

bool travel_refuses(const travel_range *t, unsigned axis, int32_t from, int32_t to) {
    if (to > UNITS_POSITION_LIMIT || to < -UNITS_POSITION_LIMIT)
        return true;
    if (to == from)
        return false;
    return (to > from ? to > t->high[axis] : to < t->low[axis]) || travel_onto(t, axis, to > from);
}
