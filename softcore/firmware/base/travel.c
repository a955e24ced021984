// SPDX-License-Identifier: Apache-2.0
#include "base/travel.h"

#include "base/units.h"

#define ALL(place) {place, place, place}

const travel_range TRAVEL_ALL = {.low = ALL(-UNITS_POSITION_LIMIT),
                                 .high = ALL(UNITS_POSITION_LIMIT)};

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
