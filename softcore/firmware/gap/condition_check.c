// SPDX-License-Identifier: Apache-2.0
#include "gap/condition_check.h"

#include "base/settings.h"
#include "gap/feed_modes.h"
#include "gap/in_force.h"

/* 1 more than a value that the setting could have, or 0. */
static bool instead_of(uint32_t one_more, setting which) {
    const settings_table_row *range = settings_row(which);
    return !one_more || (one_more - 1 >= range->lowest && one_more - 1 <= range->highest);
}

static bool below(uint32_t reference_mv, uint32_t no_load_mv) {
    return !reference_mv || reference_mv < no_load_mv;
}

static bool pulse(const condition_row *r) {
    uint32_t wait = r->wait_us ? r->wait_us : r->on_us;
    return r->on_us >= 1 && r->on_us <= CONDITIONS_PULSE_US && r->off_us >= 1 &&
           r->off_us <= CONDITIONS_OFF_US && r->rest_us <= CONDITIONS_OFF_US &&
           (r->from_ignition ? r->on_us + wait <= CONDITIONS_PULSE_US : !r->wait_us) &&
           (r->from_ignition != CONDITIONS_RELAXATION || !r->wait_us);
}

static bool levels(const condition_row *r) {
    condition_row usual = conditions_draft(r->number);
    return r->open_v >= CONDITIONS_OPEN_V_LOWEST && r->open_v <= CONDITIONS_OPEN_V_HIGHEST &&
           r->open_v % GAP_SUPPLY_STEP_V == 0 && r->open_percent >= 1 && r->open_percent <= 99 &&
           r->arc_v == usual.arc_v && r->short_v == usual.short_v &&
           r->open_v * r->open_percent * GAP_SHARE_PERCENT > r->arc_v * 10000u;
}

bool condition_check_row(const condition_row *r) {
    uint32_t level;
    if (!conditions_level(r, &level) || !pulse(r) || !levels(r) || !r->step ||
        !instead_of(r->counting, SET_SERVO_MODE) || !instead_of(r->window, SET_SERVO_WINDOW) ||
        !instead_of(r->weight, SET_SERVO_WEIGHT) || !instead_of(r->criteria, SET_CRITERIA) ||
        !instead_of(r->delay_least_ns, SET_DELAY_LEAST_NS))
        return false;
    uint32_t no_load_mv = feed_modes_no_load_mv(r, 100);
    return below(r->reference_mv, no_load_mv) && below(r->drop_mv, no_load_mv);
}
