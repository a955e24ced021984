// SPDX-License-Identifier: Apache-2.0
#include "base/settings.h"

#include "base/text.h"
#include "base/units.h"
#include "hal/hal.h"

#define LARGEST_ERROR ((1u << 17) - 1) /* pulses: range of the error counter */
#define LARGEST_GAIN 400 /* 1/s: what the gateware's model of the drive can express */
#define FARTHEST 20000000 /* um: within UNITS_POSITION_LIMIT */
#define TRAVEL 299000 /* um: 1 mm before the limit switches of the machines that are built in */
#define LAG_TIMES 5 /* time constants of the position loop: the axes are as slow as the command then */

const setting_row SETTINGS_ROWS[SETTINGS] = {
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
    [SET_SOFT_LIMIT_UM] = {100000, 0, FARTHEST, "upper end of the jump axis, um, machine frame"},
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
    [SET_SETTLE_NS] = {1000, 0, 100000, "gap: ignition to comparators read, ns"},
    [SET_CONFIRM_NS] = {500, 0, 100000, "gap: arc or short so long is cut off, ns"},
    [SET_DELAY_LEAST_NS] = {0, 0, 1000000, "gap: shortest ignition delay of a good pulse, ns"},
    [SET_CRITERIA] = {0, 0, 7, "gap: 1 ignition by current, 2 delay tells arcs, 4 noise does"},
    [SET_SERVO_PERIOD_US] = {20000, 1, 300000, "servo: time between steps, us"},
    [SET_SERVO_MODE] = {0, 0, 3, "servo: 0 accumulate, 1 consecutive, 2 total, 3 relative"},
    [SET_SERVO_WINDOW] = {50, 1, 255, "servo: pulses of a window (total)"},
    [SET_SERVO_WEIGHT] = {1, 0, 15, "servo: weight of a good pulse (relative)"},
    [SET_NO_DISCHARGE_UM] = {2000, 0, 1000000, "servo: way without a discharge, um (0 no bound)"},
    [SET_FLUID_MODE] = {0, 0, 2, "fluid: 0 class by hand, 1 as measured, 2 by hand and measured"},
    [SET_FLUID_CLASS] = {0, 0, 3, "fluid: class by hand, 0 highest resistance"},
    [SET_FLUID_THRESHOLD_0] = {3670, 0, 4095, "fluid: code between the classes 0 and 1"},
    [SET_FLUID_THRESHOLD_1] = {2819, 0, 4095, "fluid: code between the classes 1 and 2"},
    [SET_FLUID_THRESHOLD_2] = {707, 0, 4095, "fluid: code between the classes 2 and 3"},
    [SET_FLUID_HYSTERESIS] = {20, 0, 255, "fluid: hysteresis, codes"},
    [SET_FLUID_LOWEST] = {40, 0, 4095, "fluid: lowest code of a sound cell"},
    [SET_FLUID_HIGHEST] = {4030, 0, 4095, "fluid: highest code of a sound cell"},
    [SET_NO_PROGRESS_S] = {600, 0, 86400, "servo: time at the front without progress, s (0 no bound)"},
    [SET_LAW_WINDOW_US] = {20000, 100, 10000000, "feed P2, P3: time of a mean voltage, us"},
    [SET_LAW_GAIN_ZERO] = {500, 1, 1000000, "feed P2: gain, um/min per V"},
    [SET_LAW_GAIN_FEED] = {100, 1, 1000000, "feed P3: gain, um/min per V"},
    [SET_LAW_UNIT_UM] = {10, 1, 6000, "feed P4: unit distance, um"},
    [SET_LAW_LONGEST_MS] = {1000, 1, 60000, "feed P4: longest time of a unit distance, ms"},
    [SET_LAW_LEAST_MV] = {200, 1, 90000, "feed P4: lowest Ex, mV"},
    [SET_LAW_RATIO_LOWEST] = {250, 1, 15999, "feed P4: lowest Es/Ex, 1/1000"},
    [SET_LAW_RATIO_HIGHEST] = {4000, 1, 15999, "feed P4: highest Es/Ex, 1/1000"},
    [SET_LAW_NO_LOAD] = {0, 0, 1, "feed P4: no-load voltage 0 computed, 1 measured in the gap"},
    [SET_ARC_DIFFERENCE_NM] = {2000, 0, 100000,
                               "arc: largest difference of start and end radius, nm"},
    [SET_CURRENT_STEP_MA] = {1500, 50, 15000, "power supply: one step of its current, mA"},
    [SET_LOOP_GAIN] = {50, 1, LARGEST_GAIN, "velocity gain of the position loop, 1/s"},
    [SET_ARC_DEVIATION_NM] = {2000, 0, 1000000,
                              "arc: how far the lag may lead inside, nm (0 no bound)"},
    [SET_LOW_X_UM] = {TRAVEL, 0, FARTHEST, "lower end of X, um below zero"},
    [SET_LOW_Y_UM] = {TRAVEL, 0, FARTHEST, "lower end of Y, um below zero"},
    [SET_LOW_Z_UM] = {TRAVEL, 0, FARTHEST, "lower end of Z, um below zero"},
    [SET_HIGH_X_UM] = {TRAVEL, 0, FARTHEST, "upper end of X, um"},
    [SET_HIGH_Y_UM] = {TRAVEL, 0, FARTHEST, "upper end of Y, um"},
    [SET_HIGH_Z_UM] = {TRAVEL, 0, FARTHEST, "upper end of Z, um"},
};

static uint32_t values[SETTINGS];
/* Kept: their conversions divide 64-bit numbers. */
static uint32_t start_rate, acceleration, highest_speed, highest_rate;
static travel_range limits;
static uint64_t gain; /* of the position loop, 2**-32 pulse/clock per pulse */
static uint32_t deviation; /* 1/64 pulse */

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
    hal_discriminator rules = {
        .settle = at_most(units_clocks_of_ns(values[SET_SETTLE_NS]), 255),
        .confirm = at_most(units_clocks_of_ns(values[SET_CONFIRM_NS]), 255),
        .delay_least = at_most(units_clocks_of_ns(values[SET_DELAY_LEAST_NS]), (1u << 16) - 1),
        .current = values[SET_CRITERIA] & 1,
        .delay = values[SET_CRITERIA] & 2,
        .noise = values[SET_CRITERIA] & 4,
    };
    hal_discriminate(&rules);
    hal_sense(at_most(units_clocks_of_ns(values[SET_SENSE_ON_NS]), (1u << 16) - 1),
              at_most(units_clocks_of_ns(values[SET_SENSE_OFF_NS]), (1u << 16) - 1));
}

static void apply_motion(void) {
    hal_series(values[SET_GAIN_PULSES], values[SET_REPEATS],
               at_most(units_clocks_of_us(values[SET_SETTLE_US]), (1u << 24) - 1));
    start_rate = units_rate(values[SET_START_SPEED_UM_S] * 60);
    acceleration = units_acceleration(values[SET_ACCELERATION_MM_S2]);
    hal_ramp(start_rate, acceleration);
    highest_speed = at_most(values[SET_HIGHEST_SPEED_MM_MIN] * 1000,
                            units_speed_of_rate(UNITS_RATE_LIMIT));
    highest_rate = units_rate(highest_speed);
}

/* The loop's gain bounds speeds on arcs, and is that of the gateware's model of the drives. */
static void apply_arcs(void) {
    gain = units_gain(values[SET_LOOP_GAIN]);
    hal_lag_time(at_most(units_clocks_of_us(LAG_TIMES * 1000000 / values[SET_LOOP_GAIN]),
                         (1u << 28) - 1));
    deviation = units_fine_of_nm(values[SET_ARC_DEVIATION_NM]);
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        hal_axis_gain(axis, units_gain_of_tick(values[SET_LOOP_GAIN]));
}

static void apply_travel(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        uint32_t high = values[SET_HIGH_X_UM + axis];
        if (axis == hal_jump_axis())
            high = at_most(high, values[SET_SOFT_LIMIT_UM]);
        limits.low[axis] = -units_pulses_of_um(values[SET_LOW_X_UM + axis]);
        limits.high[axis] = units_pulses_of_um(high);
        hal_axis_limits(axis, limits.low[axis], limits.high[axis]);
    }
}

static void write_errors(unsigned axis) {
    hal_axis_errors(axis, values[SET_FOLLOW_STOPPED], values[SET_FOLLOW_MOVING],
                    values[SET_WINDOW]);
}

static void apply_axes(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        write_errors(axis);
        hal_axis_mode(axis, values[SET_STEP_AXES] >> axis & 1,
                      values[SET_REVERSED_ENCODERS] >> axis & 1);
        hal_axis_step_time(axis, at_most(units_clocks_of_ns(values[SET_STEP_WIDTH_NS]), 255),
                           at_most(units_clocks_of_ns(values[SET_STEP_SPACE_NS]), 255),
                           at_most(units_clocks_of_ns(values[SET_STEP_SETUP_NS]), 255));
    }
}

static void write_fluid(void) {
    hal_fluid_required(values[SET_FLUID_REQUIRED]);
}

static void apply_machine(void) {
    hal_auxiliary_timeout(units_clocks_of_us(values[SET_FIN_MS] * 1000));
    write_fluid();
}

void settings_renew(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        hal_axis_limits(axis, limits.low[axis], limits.high[axis]);
        write_errors(axis);
        hal_axis_gain(axis, units_gain_of_tick(values[SET_LOOP_GAIN]));
    }
    write_fluid();
}

void settings_init(void (*between)(void)) {
    for (unsigned i = 0; i < SETTINGS; i++)
        values[i] = SETTINGS_ROWS[i].initial;
    apply_gap();
    between();
    apply_motion();
    between();
    apply_arcs();
    apply_axes();
    between();
    apply_travel();
    between();
    apply_machine();
}

uint32_t settings_get(setting which) { return values[which]; }

bool settings_guard(uint32_t which) {
    return !((which >= SET_TV && which <= SET_OPTIONAL_STOP) ||
             (which >= SET_SERVO_PERIOD_US && which <= SET_SERVO_WEIGHT) ||
             (which >= SET_LAW_WINDOW_US && which <= SET_ARC_DIFFERENCE_NM));
}

void settings_masked(char *text, size_t size) {
    static const struct {
        setting which;
        const char *guard;
    } guards[] = {{SET_FLUID_REQUIRED, "fluid"}, {SET_REPEATS, "repeats"},
                  {SET_NO_DISCHARGE_UM, "no discharge"}, {SET_NO_PROGRESS_S, "no progress"}};
    size_t at = 0;
    *text = '\0';
    for (unsigned i = 0; i < sizeof guards / sizeof *guards; i++)
        if (!values[guards[i].which])
            at += text_print(text + at, size - at, "%s%s", at ? "," : "", guards[i].guard);
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        if (values[SET_STEP_AXES] >> axis & 1)
            at += text_print(text + at, size - at, "%scoder %c", at ? "," : "", "XYZ"[axis]);
}

bool settings_of_gap(uint32_t which) {
    return which >= SET_SERVO_PERIOD_US && which <= SET_LAW_NO_LOAD;
}

bool settings_set(uint32_t which, uint32_t value) {
    if (which >= SETTINGS || value < SETTINGS_ROWS[which].lowest ||
        value > SETTINGS_ROWS[which].highest)
        return false;
    values[which] = value;
    /* Only the group of the setting: conversions take 64-bit divisions. */
    if (which <= SET_SENSE_OFF_NS)
        apply_gap();
    else if (which <= SET_HIGHEST_SPEED_MM_MIN)
        apply_motion();
    else if (which == SET_SOFT_LIMIT_UM || which >= SET_LOW_X_UM)
        apply_travel();
    else if (which <= SET_WINDOW)
        apply_axes();
    else if (which <= SET_FLUID_REQUIRED)
        apply_machine();
    else if (which <= SET_CRITERIA)
        apply_gap();
    else if (!settings_of_gap(which))
        apply_arcs();
    return true;
}

static bool read_unsigned(const char *line, uint32_t length, uint32_t *at, uint32_t *value) {
    uint32_t from = *at;
    *value = 0;
    while (*at < length && line[*at] >= '0' && line[*at] <= '9' && *at - from < 9)
        *value = *value * 10 + (uint32_t)(line[(*at)++] - '0');
    return *at > from;
}

bool settings_read(const char *line, uint32_t length, uint32_t *which, uint32_t *value, fault *f) {
    uint32_t at = 1;
    return (read_unsigned(line, length, &at, which) && at < length && line[at++] == '=' &&
            read_unsigned(line, length, &at, value) && at == length) ||
           fault_at(f, FAULT_SETTING, at, "a setting reads $number=value");
}

bool settings_enter(uint32_t which, uint32_t value, fault *f) {
    return settings_set(which, value) ||
           fault_at(f, FAULT_SETTING, 0, "setting %u does not exist or is out of range", which);
}

uint32_t settings_start_rate(void) { return start_rate; }
uint32_t settings_acceleration(void) { return acceleration; }

/* The acceleration v*v/R, which the start/stop speed has for nothing. And a loop of the gain K lags
   by v/K: on an arc it then runs inside by R (1 - 1/sqrt(1 + (v/KR)**2)), which is less than
   v*v/(2 R K*K); a speed loop behind it makes it less still. */
uint32_t settings_curve_rate(uint32_t radius) {
    /* 2**-64 pulse**2/clock**2 are 2**-36 pulse/clock**2 times pulse times 2**28. */
    uint64_t square = (uint64_t)acceleration * radius;
    uint32_t root = units_root(square << 8);
    uint32_t most = root >= UNITS_RATE_LIMIT >> 10 ? UNITS_RATE_LIMIT : root << 10;
    most = most > start_rate ? most : start_rate;
    if (!values[SET_ARC_DEVIATION_NM])
        return most;
    /* Of 2 R times the deviation, in 2**-11 pulse. */
    uint64_t rate = gain * units_root((uint64_t)radius * deviation << 17) >> 11;
    rate = rate ? rate : 1;
    return rate < most ? (uint32_t)rate : most;
}

uint32_t settings_highest_speed(void) { return highest_speed; }
uint32_t settings_highest_rate(void) { return highest_rate; }

const travel_range *settings_travel(void) { return &limits; }

const travel_range *settings_travel_now(void) {
    static travel_range off;
    hal_limits switches = hal_limits_read();
    if (!switches.leaving)
        return &limits;
    off = limits;
    off.onto_low = switches.low;
    off.onto_high = switches.high;
    return &off;
}
