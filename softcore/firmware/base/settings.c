// SPDX-License-Identifier: Apache-2.0
#include "base/settings.h"

#include "base/move.h"
#include "base/text.h"
#include "base/units.h"
#include "base/watch.h"
#include "hal/hal.h"
#include "hal/regs.h"

#define LAG_TIMES 5 /* time constants until the axes have caught up */
#define COARSEST_CODER 20 /* pulses for an edge, at most */

static uint32_t values[SETTINGS];
static uint32_t edition;
static unsigned differing; /* settings that are not as built */
/* Converted values. They are kept because converting them takes 64-bit divisions. */
static uint32_t lag_clocks, start_rate, acceleration, highest_speed, highest_rate;
static uint32_t axis_rate[HAL_AXES]; /* highest, 0 for no own bound */
static travel_range limits;
static uint64_t arc_gain; /* as of a loop of first order, 2**-32 pulse/clock per pulse */
static uint32_t deviation; /* 1/64 pulse */
static int32_t pitch[HAL_AXES]; /* error of the screw made up for, pulses */
static bool screws;
static uint32_t tangent_step, corner_rate, corner_sine, corner_before, corner_behind;

static uint32_t at_most(uint32_t value, uint32_t limit) { return value < limit ? value : limit; }

/* At least the blanking, before whose end the comparator cannot have answered; never 0. */
static uint32_t short_current(void) {
    uint32_t ns = values[SET_SHORT_CURRENT_NS], blanking = values[SET_BLANKING_NS];
    uint32_t clocks = at_most(units_clocks_of_ns(ns > blanking ? ns : blanking), (1u << 16) - 1);
    return ns ? clocks + !clocks : 0;
}

static void apply_detector(void) {
    hal_short_detector detector = {
        .needed = values[SET_SHORT_NEEDED],
        .window = values[SET_SHORT_WINDOW],
        .duration = at_most(units_clocks_of_us(values[SET_SHORT_DURATION_US]), (1u << 24) - 1),
        .clear = values[SET_CLEAR_NEEDED],
        .blanking = at_most(units_clocks_of_ns(values[SET_BLANKING_NS]), (1u << 16) - 1),
        /* Codes of the converter, whose full scale is 100 V; rounded up, so that no preset is 0. */
        .mean = (values[SET_SHORT_MEAN_MV] * 128 + 3124) / 3125,
        .mean_time = at_most(units_clocks_of_us(values[SET_SHORT_MEAN_US]), (1u << 24) - 1),
        .current = short_current(),
    };
    hal_short_write(&detector);
    hal_discriminator rules = {
        .settle = at_most(units_clocks_of_ns(values[SET_SETTLE_NS]), 255),
        .confirm = at_most(units_clocks_of_ns(values[SET_CONFIRM_NS]), 255),
    };
    hal_discriminate(&rules);
    hal_sense(at_most(units_clocks_of_ns(values[SET_SENSE_ON_NS]), (1u << 16) - 1),
              at_most(units_clocks_of_ns(values[SET_SENSE_OFF_NS]), (1u << 16) - 1));
    hal_follow(at_most(units_clocks_of_us(values[SET_FOLLOW_US]), (1u << 24) - 1));
}

/* An axis of first order with the lag T rounds a corner of the angle a, up to 90 degrees, by
   v T sin(a) / e, and one of more by v T / e, if it has followed before the corner, and keeps its
   speed for T behind it: sooner it would leave the corner while it is further away. With
   feed-forward of the share f the lag is that of the drive, else 1 / K, and the error of its model
   dies away with 1 / K. A model whose lag is another rounds corners by more: by some 1.7 times
   the difference if it is less, else by 3 times; 2 and 3.5 are taken. The drives may be a tenth
   slower. */
static void apply_corners(void) {
    uint32_t percent = values[SET_FEED_FORWARD], loop_us = 1000000 / values[SET_LOOP_GAIN];
    uint32_t drive_us = values[SET_DRIVE_LAG_US];
    uint32_t apart_us = 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        uint32_t model_us = values[SET_MODEL_LAG_X_US + axis];
        uint32_t here = model_us > drive_us ? (model_us - drive_us) * 7 / 2
                                            : (drive_us - model_us) * 2;
        apart_us = here > apart_us ? here : apart_us;
    }
    uint32_t ahead_us = drive_us + apart_us;
    uint32_t lag_us = (percent * ahead_us + (100 - percent) * loop_us) / 100 * 11 / 10;
    uint64_t fine = units_fine_of_nm(values[SET_CORNER_DEVIATION_NM]);
    fine += !fine && values[SET_CORNER_DEVIATION_NM];
    uint64_t rate = units_quotient(fine << 32, units_clocks_of_ns(lag_us * 368) * MOVE_FINE);
    corner_rate = rate < UNITS_RATE_LIMIT ? (uint32_t)rate : UNITS_RATE_LIMIT;
    corner_rate += !corner_rate && fine;
    uint32_t caught_up = LAG_TIMES * lag_us, died_away = 3 * loop_us;
    corner_before = units_clocks_of_us(caught_up > died_away ? caught_up : died_away);
    corner_behind = units_clocks_of_us(lag_us);
    corner_sine = corner_rate && corner_rate < highest_rate
                      ? (uint32_t)units_quotient((uint64_t)corner_rate << 15, highest_rate)
                      : 1u << 15;
}

static void apply_motion(void) {
    hal_short_burst(values[SET_GAIN_PULSES], values[SET_REPEATS],
                    at_most(units_clocks_of_us(values[SET_SETTLE_US]), (1u << 24) - 1));
    start_rate = units_rate(values[SET_START_SPEED_UM_S] * 60);
    acceleration = units_acceleration(values[SET_ACCELERATION_MM_S2]);
    hal_ramp(start_rate, acceleration);
    uint32_t back_speed = values[SET_BACK_START_SPEED_UM_S];
    uint32_t back_acceleration = values[SET_BACK_ACCELERATION_MM_S2];
    hal_ramp_back(back_speed ? units_rate(back_speed * 60) : start_rate,
                  back_acceleration ? units_acceleration(back_acceleration) : acceleration);
    highest_speed = at_most(values[SET_HIGHEST_SPEED_MM_MIN] * 1000,
                            units_speed_of_rate(UNITS_RATE_LIMIT));
    highest_rate = units_rate(highest_speed);
    tangent_step = start_rate / ((highest_rate >> 15) + 1);
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        axis_rate[axis] = units_rate(values[SET_HIGHEST_SPEED_X + axis] * 1000);
}

/* A value times a factor in 2**-14. */
static int32_t by_gain(int32_t value, int32_t factor) {
    return (int32_t)((int64_t)value * factor >> 14);
}

/* The gain by which a loop of first order, without a drive in it, leaves an arc as far as the loop
   in force. With feed-forward of the share f, a drive whose gain is g times K and whose lag is L,
   and the gateware's model of it, whose lag is T, the loop leaves it as far as one of gain
   K / sqrt(c) does, c = ((1 + K T) / g)**2 - 2 (K L (1 + K T) - (K T)**2) / g - f**2: to the
   inside if c is above 0, else to the outside. The drives may be a tenth slower or faster than set:
   g is 0.9 or 1.1. The axis with the greatest c counts. For the plain loop c is below 1, and 1 is
   taken. */
static uint64_t gain_on_arcs(uint32_t per_s, uint32_t percent) {
    uint64_t in_force = units_gain(per_s);
    if (!percent)
        return in_force;
    static const int32_t per_gain[] = {18204, 14895}; /* 1 / g, 2**-14 */
    /* K T and K L in thousandths, so all squares are in millionths: with the greatest gain and lags
       they fit 32 bits. */
    int32_t lag = (int32_t)(per_s * values[SET_DRIVE_LAG_US] / 1000);
    int32_t lead = (int32_t)(percent * percent * 100), most = 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t model = (int32_t)(per_s * values[SET_MODEL_LAG_X_US + axis] / 1000);
        int32_t square = (1000 + model) * (1000 + model);
        int32_t second = 2 * (lag * (1000 + model) - model * model);
        for (unsigned i = 0; i < 2; i++) {
            int32_t c = by_gain(by_gain(square, per_gain[i]) - second, per_gain[i]) - lead;
            c = c < 0 ? -c : c;
            most = c > most ? c : most;
        }
    }
    return units_quotient(in_force * 1000, units_root((uint64_t)most));
}

static void write_model(unsigned axis) {
    uint32_t us = values[SET_MODEL_LAG_X_US + axis];
    hal_axis_model(axis, units_gain_of_tick(values[SET_LOOP_GAIN]), ((32u << 16) + us / 2) / us);
}

/* The gain of the position loop limits speeds on arcs. The gateware's model of the drives uses it
   too, and the velocity feed-forward makes up its lag. */
static void apply_loop(void) {
    arc_gain = gain_on_arcs(values[SET_LOOP_GAIN], values[SET_FEED_FORWARD]);
    watch_between();
    hal_lead(units_lead(values[SET_FEED_FORWARD], values[SET_LOOP_GAIN]));
    lag_clocks = at_most(units_clocks_of_us(LAG_TIMES * 1000000 / values[SET_LOOP_GAIN]),
                         (1u << 28) - 1);
    hal_lag_time(lag_clocks);
    deviation = units_fine_of_nm(values[SET_ARC_DEVIATION_NM]);
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        write_model(axis);
}

static uint32_t upper_end_um(unsigned axis) {
    uint32_t high = values[SET_HIGH_X_UM + axis];
    return axis == hal_jump_axis() ? at_most(high, values[SET_SOFT_LIMIT_UM]) : high;
}

static void apply_travel(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        limits.low[axis] = -units_pulses_of_um(values[SET_LOW_X_UM + axis]);
        limits.high[axis] = units_pulses_of_um(upper_end_um(axis));
        hal_axis_limits(axis, limits.low[axis], limits.high[axis]);
    }
}

uint32_t settings_edge(unsigned axis) {
    uint32_t steps = values[SET_GEAR_STEPS_X + axis];
    return values[SET_STEP_AXES] >> axis & 1 ? 1
                                             : (values[SET_GEAR_PULSES_X + axis] + steps - 1) / steps;
}

/* An axis between two edges of its coder goes to and fro over one of them. */
static void write_errors(unsigned axis) {
    uint32_t edge = settings_edge(axis), window = values[SET_WINDOW];
    hal_axis_errors(axis, values[SET_FOLLOW_STOPPED], values[SET_FOLLOW_MOVING],
                    edge > 1 && window < edge ? edge : window);
}

static void write_mode(unsigned axis) {
    const setting offset = (setting)(SET_DRIVE_OFFSET_X + axis);
    hal_drive drive = {
        .step = values[SET_STEP_AXES] >> axis & 1,
        .reverse = values[SET_REVERSED_ENCODERS] >> axis & 1,
        .swap = values[SET_REVERSED_DRIVES] >> axis & 1,
        .offset = (int32_t)(values[offset] - settings_row(offset)->initial),
        .friction = values[SET_DRIVE_FRICTION_X + axis],
    };
    hal_axis_mode(axis, &drive);
}

static bool gear_fits(unsigned axis) {
    return values[SET_GEAR_STEPS_X + axis] <= values[SET_GEAR_PULSES_X + axis];
}

/* The supervision of a coder wants an edge of both phases within 64 pulses. */
static bool coder_fits(unsigned axis) {
    return values[SET_STEP_AXES] >> axis & 1 ||
           values[SET_GEAR_PULSES_X + axis] <= COARSEST_CODER * values[SET_GEAR_STEPS_X + axis];
}

__attribute__((noinline, section(".rare"))) bool settings_gears(fault *f) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        unsigned steps = settings_number((setting)(SET_GEAR_STEPS_X + axis));
        unsigned pulses = settings_number((setting)(SET_GEAR_PULSES_X + axis));
        if (!gear_fits(axis))
            return fault_at(f, FAULT_SETTING, 0, "the gear of %c has more steps ($%u) than pulses ($%u)",
                            "XYZ"[axis], steps, pulses);
        if (!coder_fits(axis))
            return fault_at(f, FAULT_SETTING, 0,
                            "the coder of %c has more than %u pulses ($%u) for an edge ($%u)", "XYZ"[axis],
                            COARSEST_CODER, pulses, steps);
    }
    return true;
}

bool settings_screws(void) { return screws; }
int32_t settings_pitch(unsigned axis) { return pitch[axis]; }
void settings_put_pitch(unsigned axis, int32_t pulses) {
    pitch[axis] = pulses;
    hal_axis_pitch(axis, pulses);
}

void settings_renew_screw(unsigned axis) {
    settings_put_pitch(axis, 0);
    hal_axis_backlash(axis, values[SET_BACKLASH_X + axis]);
}

/* Writing gear and backlash begins both anew. A gear that does not fit is not written; the position
   cannot be known again before it fits. */
void settings_renew_drives(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        write_errors(axis);
        write_mode(axis);
        if (gear_fits(axis))
            hal_axis_gear(axis, values[SET_GEAR_STEPS_X + axis], values[SET_GEAR_PULSES_X + axis]);
        settings_renew_screw(axis);
    }
}

/* Clocks of a time of the step pulses: an axis's own one, or that of all. */
static uint32_t step_clocks(unsigned all, unsigned own) {
    return at_most(units_clocks_of_ns(values[own] ? values[own] : values[all]), 255);
}

static void apply_axes(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        watch_between();
        write_errors(axis);
        write_mode(axis);
        hal_axis_step_time(axis, step_clocks(SET_STEP_WIDTH_NS, SET_STEP_WIDTH_X_NS + axis),
                           step_clocks(SET_STEP_SPACE_NS, SET_STEP_SPACE_X_NS + axis),
                           step_clocks(SET_STEP_SETUP_NS, SET_STEP_SETUP_X_NS + axis));
    }
}

static void write_fluid(void) {
    hal_fluid_required(values[SET_FLUID_REQUIRED]);
}

static void apply_side(void) {
    hal_auxiliary_timeout(units_clocks_of_us(values[SET_FIN_MS] * 1000));
    write_fluid();
}

void settings_renew(void) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        hal_axis_limits(axis, limits.low[axis], limits.high[axis]);
        write_errors(axis);
        write_model(axis);
        hal_axis_pitch(axis, pitch[axis]);
    }
    write_fluid();
}

void settings_init(void (*stored)(void), void (*between)(void)) {
    for (unsigned i = 0; i < SETTINGS; i++)
        values[i] = settings_row((setting)i)->initial;
    screws = false;
    differing = 0;
    edition++;
    between();
    stored();
    between();
    apply_detector();
    between();
    apply_motion();
    between();
    apply_loop();
    between();
    apply_axes();
    between();
    apply_corners();
    settings_renew_drives();
    between();
    apply_travel();
    between();
    apply_side();
}

uint32_t settings_get(setting which) { return values[which]; }

static unsigned row_of(unsigned which) {
    return which < SETTINGS_ALIKE                      ? which
           : which < SETTINGS_ALIKE + SETTINGS_SO_MANY ? SETTINGS_ALIKE
                                                       : which - (SETTINGS_SO_MANY - 1);
}

const settings_table_row *settings_row(setting which) { return &SETTINGS_TABLE_ROWS[row_of(which)]; }

setting settings_find(uint32_t number) {
    if (number < SETTINGS_FIRST || number > SETTINGS_LAST)
        return SETTINGS;
    uint32_t alike = number - SETTINGS_TABLE_ROWS[SETTINGS_ALIKE].number;
    if (alike < SETTINGS_SO_MANY)
        return (setting)(SETTINGS_ALIKE + alike);
    unsigned row = number - SETTINGS_FIRST; /* if no number is left out before it */
    if (row >= SETTINGS_ROWS || SETTINGS_TABLE_ROWS[row].number != number)
        for (row = 0; row < SETTINGS_ROWS && SETTINGS_TABLE_ROWS[row].number != number;)
            row++;
    return (setting)(row <= SETTINGS_ALIKE ? row : row + SETTINGS_SO_MANY - 1);
}

uint32_t settings_number(setting which) {
    unsigned row = row_of(which);
    return SETTINGS_TABLE_ROWS[row].number + (row == SETTINGS_ALIKE ? which - row : 0);
}

bool settings_guard(uint32_t number) {
    setting which = settings_find(number);
    return which == SETTINGS || settings_row(which)->guards;
}

bool settings_switch(uint32_t number) {
    setting which = settings_find(number);
    return which != SETTINGS && settings_row(which)->any_time;
}

void settings_masked(char *text, size_t size) {
    size_t at = 0;
    *text = '\0';
    for (unsigned i = 0; i < SETTINGS_GUARDS; i++) {
        const settings_table_guard *guard = &SETTINGS_TABLE_GUARDS[i];
        if (!values[guard->which])
            at += text_print(text + at, size - at, "%s%s", at ? "," : "", guard->name);
    }
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        if (values[SET_STEP_AXES] >> axis & 1)
            at += text_print(text + at, size - at, "%scoder %c", at ? "," : "", "XYZ"[axis]);
}

const char *settings_short(void) {
    if (values[SET_SHORT_MEAN_MV])
        return values[SET_SHORT_CURRENT_NS] ? "|Ss:mean,current" : "|Ss:mean";
    return values[SET_SHORT_CURRENT_NS] ? "|Ss:current" : "";
}

bool settings_of_gap(uint32_t number) {
    setting which = settings_find(number);
    if (which >= SETTINGS)
        return false;
    setting_group group = settings_row(which)->group;
    return group == GROUP_GAP || group == GROUP_DETECTOR;
}

bool settings_of_drive(uint32_t number) {
    setting which = settings_find(number);
    if (which >= SETTINGS)
        return false;
    setting_group group = settings_row(which)->group;
    return group == GROUP_DRIVES || group == GROUP_PITCH || which == SET_STEP_AXES;
}

uint32_t settings_edition(void) { return edition; }

unsigned settings_differing(void) { return differing; }
bool settings_differs(setting which) { return values[which] != settings_row(which)->initial; }

bool settings_load(uint32_t number, uint32_t value) {
    setting which = settings_find(number);
    if (which == SETTINGS || value < settings_row(which)->lowest ||
        value > settings_row(which)->highest)
        return false;
    differing -= settings_differs(which);
    values[which] = value;
    differing += settings_differs(which);
    screws = screws || settings_row(which)->group == GROUP_PITCH;
    edition++;
    return true;
}

bool settings_set(uint32_t number, uint32_t value) {
    setting which = settings_find(number);
    uint32_t before = which < SETTINGS ? values[which] : 0;
    if (!settings_load(number, value))
        return false;
    uint8_t group = settings_row(which)->group;
    if (before == value && (group == GROUP_DRIVES || group == GROUP_PITCH))
        return true;
    /* Apply only the group of this setting: conversions take 64-bit divisions. */
    switch (group) {
    case GROUP_DETECTOR: apply_detector(); break;
    case GROUP_MOTION: apply_motion(); break;
    case GROUP_TRAVEL: apply_travel(); break;
    case GROUP_AXES: apply_axes(); break;
    case GROUP_DRIVES:
    case GROUP_PITCH: settings_renew_drives(); break;
    case GROUP_SIDE: apply_side(); break;
    case GROUP_LOOP: apply_loop(); break;
    default: break; /* read where it is needed */
    }
    if (group == GROUP_MOTION || group == GROUP_LOOP) {
        watch_between();
        apply_corners();
    }
    return true;
}

bool settings_read_number(const char *line, uint32_t length, uint32_t *at, uint32_t *value) {
    uint32_t from = *at;
    *value = 0;
    while (*at < length && line[*at] >= '0' && line[*at] <= '9' && *at - from < 9)
        *value = *value * 10 + (uint32_t)(line[(*at)++] - '0');
    return *at > from;
}

bool settings_read(const char *line, uint32_t length, uint32_t *number, uint32_t *value, fault *f) {
    uint32_t at = 1;
    return (settings_read_number(line, length, &at, number) && at < length && line[at++] == '=' &&
            settings_read_number(line, length, &at, value) && at == length) ||
           fault_at(f, FAULT_SETTING, at, "a setting reads $number=value");
}

bool settings_enter(uint32_t number, uint32_t value, fault *f) {
    return settings_set(number, value) ||
           fault_at(f, FAULT_SETTING, 0, "setting %u does not exist or is out of range", number);
}

uint32_t settings_start_rate(void) { return start_rate; }
uint32_t settings_tangent_step(void) { return tangent_step; }
uint32_t settings_corner_rate(void) { return corner_rate; }
uint32_t settings_corner_sine(void) { return corner_sine; }
uint32_t settings_corner_before(void) { return corner_before; }
uint32_t settings_corner_behind(void) { return corner_behind; }
uint32_t settings_lag_clocks(void) { return lag_clocks; }
uint32_t settings_acceleration(void) { return acceleration; }

/* Two limits. The acceleration v*v/R; the start/stop speed is always allowed. The deviation: a loop
   of gain K lags by v/K, so that on an arc the axes run inside by R (1 - 1/sqrt(1 + (v/KR)**2)),
   which is less than v*v/(2 R K*K). `arc_gain` is that K for the loop in force. */
uint32_t settings_curve_rate(uint32_t radius) {
    /* `square` is in units of 2**-36 = 2**28 * 2**-64 pulse**2/clock**2. */
    uint64_t square = (uint64_t)acceleration * radius;
    uint32_t root = units_root(square << 8);
    uint32_t most = root >= UNITS_RATE_LIMIT >> 10 ? UNITS_RATE_LIMIT : root << 10;
    most = most > start_rate ? most : start_rate;
    if (!values[SET_ARC_DEVIATION_NM])
        return most;
    /* The root of 2 R times the deviation is in 2**-11 pulse. */
    uint64_t rate = arc_gain * units_root((uint64_t)radius * deviation << 17) >> 11;
    rate = rate ? rate : 1;
    return rate < most ? (uint32_t)rate : most;
}

uint32_t settings_highest_speed(void) { return highest_speed; }
uint32_t settings_highest_rate(void) { return highest_rate; }
uint32_t settings_axis_rate(unsigned axis) { return axis_rate[axis]; }
uint32_t settings_axis_speed(unsigned axis) {
    uint32_t own = values[SET_HIGHEST_SPEED_X + axis] * 1000;
    return own ? at_most(own, highest_speed) : highest_speed;
}
uint32_t settings_axis_resolution(unsigned axis) {
    uint32_t most = (uint32_t)units_pulses_of_um(1000) * 1000;
    return (uint32_t)units_quotient((uint64_t)most * values[SET_GEAR_STEPS_X + axis],
                                    values[SET_GEAR_PULSES_X + axis]);
}

const travel_range *settings_travel(void) { return &limits; }
uint32_t settings_travel_um(unsigned axis) { return values[SET_LOW_X_UM + axis] + upper_end_um(axis); }

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
