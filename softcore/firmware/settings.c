// SPDX-License-Identifier: Apache-2.0
#include "settings.h"

#include "hal.h"
#include "units.h"

#define LARGEST_ERROR ((1u << 17) - 1) /* pulses: range of the error counter */

const setting_row SETTING_ROWS[SETTINGS] = {
    [SET_SHORT_NEEDED] = {4, 1, 32, "short: shorted pulses needed"},
    [SET_SHORT_WINDOW] = {5, 1, 32, "short: of the last pulses"},
    [SET_SHORT_DURATION_US] = {0, 0, 300000, "short: or shorted for so long, us (0 never)"},
    [SET_CLEAR_NEEDED] = {3, 1, 255, "short: clear samples that end it"},
    [SET_BLANKING_NS] = {3000, 0, 1000000, "gap: pulse start to comparators read, ns"},
    [SET_SENSE_ON_NS] = {10000, 100, 1000000, "sensing pulse on-time, ns"},
    [SET_SENSE_OFF_NS] = {40000, 100, 1000000, "sensing pulse off-time, ns"},
    [SET_GAIN_PULSES] = {10, 1, 65535, "depth that ends a series of shorts, pulses"},
    [SET_REPEATS] = {20, 0, 255, "shorts in a series that halt (0 no bound)"},
    [SET_SETTLE_US] = {500, 0, 300000, "rest at the limit before the halt, us"},
    [SET_START_SPEED_UM_S] = {10000, 1, 1000000, "start/stop speed, um/s"},
    [SET_ACCELERATION_MM_S2] = {1000, 1, 100000, "acceleration, mm/s2"},
    [SET_HIGHEST_SPEED_MM_MIN] = {1800, 1, 60000, "highest speed and rapid feed, mm/min"},
    [SET_FOLLOW_STOPPED] = {LARGEST_ERROR, 1, LARGEST_ERROR, "following error at rest, pulses"},
    [SET_FOLLOW_MOVING] = {LARGEST_ERROR, 1, LARGEST_ERROR, "following error in motion, pulses"},
    [SET_SOFT_LIMIT_UM] = {100000, 0, 20000000, "upper end of the jump axis, um, machine frame"},
    [SET_STEP_AXES] = {0, 0, 7, "axes with step/direction output, mask"},
    [SET_REVERSED_ENCODERS] = {0, 0, 7, "axes whose encoder counts down, mask"},
    [SET_STEP_WIDTH_NS] = {1000, 1, 100000, "step pulse width, ns"},
    [SET_STEP_SPACE_NS] = {1000, 1, 100000, "step pulse space, ns"},
    [SET_STEP_SETUP_NS] = {1000, 1, 100000, "direction before step, ns"},
    [SET_WINDOW] = {1, 1, 4095, "following error up to which an axis is in position, pulses"},
    [SET_TV] = {0, 0, 1, "tape: TV check"},
    [SET_BLOCK_SKIP] = {1, 0, 1, "blocks with / are skipped"},
    [SET_OPTIONAL_STOP] = {0, 0, 1, "M01 stops"},
    [SET_FIN_MS] = {500, 1, 60000, "longest wait for the machine side, ms"},
    [SET_FLUID_REQUIRED] = {1, 0, 1, "low fluid trips while discharging"},
};

static uint32_t values[SETTINGS];
static uint32_t start_rate, acceleration; /* kept: their conversions divide 64-bit numbers */

static uint32_t at_most(uint32_t value, uint32_t limit) { return value < limit ? value : limit; }

static void apply_gap(void) {
    hal_short_detector detector = {
        .needed = values[SET_SHORT_NEEDED],
        .window = values[SET_SHORT_WINDOW],
        .duration = at_most(units_clocks_of_us(values[SET_SHORT_DURATION_US]), (1u << 24) - 1),
        .clear = values[SET_CLEAR_NEEDED],
        .blanking = at_most(units_clocks_of_ns(values[SET_BLANKING_NS]), (1u << 16) - 1),
    };
    hal_short_write(&detector);
    hal_sense(at_most(units_clocks_of_ns(values[SET_SENSE_ON_NS]), (1u << 16) - 1),
              at_most(units_clocks_of_ns(values[SET_SENSE_OFF_NS]), (1u << 16) - 1));
}

static void apply_motion(void) {
    hal_series(values[SET_GAIN_PULSES], values[SET_REPEATS],
               at_most(units_clocks_of_us(values[SET_SETTLE_US]), (1u << 24) - 1));
    start_rate = units_rate(values[SET_START_SPEED_UM_S] * 60);
    acceleration = units_acceleration(values[SET_ACCELERATION_MM_S2]);
    hal_ramp(start_rate, acceleration);
}

static void apply_axes(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        hal_axis_errors(axis, values[SET_FOLLOW_STOPPED], values[SET_FOLLOW_MOVING],
                        values[SET_WINDOW]);
        hal_axis_mode(axis, values[SET_STEP_AXES] >> axis & 1,
                      values[SET_REVERSED_ENCODERS] >> axis & 1);
        hal_axis_step_time(axis, at_most(units_clocks_of_ns(values[SET_STEP_WIDTH_NS]), 255),
                           at_most(units_clocks_of_ns(values[SET_STEP_SPACE_NS]), 255),
                           at_most(units_clocks_of_ns(values[SET_STEP_SETUP_NS]), 255));
    }
}

static void apply_machine(void) {
    hal_auxiliary_timeout(units_clocks_of_us(values[SET_FIN_MS] * 1000));
    hal_fluid_required(values[SET_FLUID_REQUIRED]);
}

void settings_init(void) {
    for (unsigned i = 0; i < SETTINGS; i++)
        values[i] = SETTING_ROWS[i].initial;
    apply_gap();
    apply_motion();
    apply_axes();
    apply_machine();
}

uint32_t settings_get(setting which) { return values[which]; }

bool settings_set(uint32_t which, uint32_t value) {
    if (which >= SETTINGS || value < SETTING_ROWS[which].lowest ||
        value > SETTING_ROWS[which].highest)
        return false;
    values[which] = value;
    /* Only the group of the setting: conversions take 64-bit divisions. */
    if (which <= SET_SENSE_OFF_NS)
        apply_gap();
    else if (which <= SET_ACCELERATION_MM_S2)
        apply_motion();
    else if (which <= SET_WINDOW)
        apply_axes();
    else
        apply_machine();
    return true;
}

uint32_t settings_start_rate(void) { return start_rate; }
uint32_t settings_acceleration(void) { return acceleration; }

uint32_t settings_highest_speed(void) {
    uint32_t bound = units_speed_of_rate(UNITS_RATE_LIMIT);
    return at_most(values[SET_HIGHEST_SPEED_MM_MIN] * 1000, bound);
}

int32_t settings_soft_limit(void) { return units_pulses_of_um(values[SET_SOFT_LIMIT_UM]); }
