// SPDX-License-Identifier: Apache-2.0
#include "interp/gap_words.h"

#include "base/settings.h"
#include "base/units.h"
#include "base/watch.h"
#include "gap/feed_modes.h"

bool gap_words_feed_mode(const word *w, uint32_t column, uint8_t *mode, fault *f) {
    if (!w)
        return fault_at(f, FAULT_MISSING, column, "G95 needs its feed mode, P1 to P5");
    if (w->number.decimals || w->number.digits < FEED_CLASSES || w->number.digits >= FEED_MODES)
        return fault_at(f, FAULT_NUMBER, w->column, "the feed mode of G95 must be P1 to P5");
    *mode = (uint8_t)w->number.digits;
    return true;
}

static bool presets(context *c, uint32_t values[3]) {
    return words_whole(c, 'X', 0, 255, "the preset of arcs and shorts", &values[0]) &&
           words_whole(c, 'Y', 0, 255, "the preset of open pulses", &values[1]) &&
           words_whole(c, 'Z', 0, 255, "the preset of good pulses", &values[2]);
}

/* The current in IP, rounded to the nearest step of the power supply. */
static bool current(context *c, condition_row *row) {
    const word *w = words_take(c, 'I');
    uint32_t milli_ip, level, step_ma = settings_get(SET_CURRENT_STEP_MA);
    if (!w)
        return true;
    if (w->negative || !units_speed(w->number, false, &milli_ip) || milli_ip > UINT16_MAX)
        return fault_at(c->f, FAULT_TABLE, w->column, "the current I is out of range");
    row->milli_ip = (uint16_t)milli_ip;
    if (!conditions_level(row, &level))
        return fault_at(c->f, FAULT_TABLE, w->column,
                        "the current I must be 0 to %u steps of the power supply, %u mA each (1 IP is "
                        "%u mA)", hal_level_limit(), step_ma, (uint32_t)CONDITIONS_IP_MA);
    row->milli_ip = (uint16_t)(level * step_ma * 1000 / CONDITIONS_IP_MA);
    return true;
}

static bool reference(char letter, const word *w, const condition_row *row, uint32_t *mv, fault *f) {
    uint32_t bound = feed_modes_no_load_mv(row, 100);
    /* units_speed gives thousandths, here mV. */
    if ((!w || units_speed(w->number, false, mv)) && (!*mv || *mv < bound))
        return true;
    return fault_at(f, FAULT_TABLE, w ? w->column : 0,
                    "the reference %c must be below the mean without discharges, %u mV", letter, bound);
}

/* A word that stands for a setting and has its range. A row keeps 1 more than the number. */
static bool instead_of(context *c, char letter, setting which, const char *what, uint32_t *one_more) {
    uint32_t value = *one_more - 1;
    const settings_table_row *range = settings_row(which);
    if (!words_whole(c, letter, range->lowest, range->highest, what, &value))
        return false;
    *one_more = value + 1;
    return true;
}

/* How pulses are counted and judged. */
static bool rules(context *c, condition_row *row) {
    uint32_t counting = row->counting, window = row->window, weight = row->weight,
             criteria = row->criteria;
    if (!instead_of(c, 'J', SET_SERVO_MODE, "the way to count", &counting) ||
        !instead_of(c, 'W', SET_SERVO_WINDOW, "the window", &window) ||
        !instead_of(c, 'S', SET_SERVO_WEIGHT, "the weight of a good pulse", &weight) ||
        !instead_of(c, 'F', SET_CRITERIA, "the criteria", &criteria) ||
        !instead_of(c, 'T', SET_DELAY_LEAST_NS, "the shortest ignition delay", &row->delay_least_ns))
        return false;
    row->counting = (uint8_t)counting;
    row->window = (uint16_t)window;
    row->weight = (uint8_t)weight;
    row->criteria = (uint8_t)criteria;
    return true;
}

/* Reference voltage V and drop U of a row. Words may be missing; 0 V means that there is none. */
static bool references(const word *voltage, const word *drop, condition_row *row, fault *f) {
    return reference('V', voltage, row, &row->reference_mv, f) &&
           reference('U', drop, row, &row->drop_mv, f);
}

/* From where the on-time counts, and how long a pulse waits for its ignition. */
static bool ignition(context *c, uint32_t on_us, condition_row *row) {
    uint32_t from = row->from_ignition, wait = row->wait_us;
    const word *longest = block_has(c->b, 'B') ? BLOCK_WORD(c->b, 'B') : 0;
    if (!words_whole(c, 'A', 0, CONDITIONS_RELAXATION, "where the on-time counts from", &from) ||
        !words_whole(c, 'B', 0, CONDITIONS_PULSE_US, "the longest wait for the ignition", &wait))
        return false;
    if (longest && from != 1)
        return fault_at(c->f, FAULT_TABLE, longest->column,
                        "the longest wait B needs A1, the on-time from the ignition");
    row->from_ignition = (uint8_t)from;
    row->wait_us = from == 1 ? (uint16_t)wait : 0;
    if (from && on_us + (row->wait_us ? row->wait_us : on_us) > CONDITIONS_PULSE_US)
        return fault_at(c->f, FAULT_TABLE, longest ? longest->column : 0,
                        "the on-time P and the wait B (without B as long as P) must not be above "
                        "%u us together", (uint32_t)CONDITIONS_PULSE_US);
    return true;
}

bool gap_words_condition(context *c, bool mdi) {
    if (!words_alone(c, AXIS_LETTERS | BLOCK_BIT('C') | BLOCK_BIT('I') | BLOCK_BIT('P') |
                      BLOCK_BIT('Q') | BLOCK_BIT('R') | BLOCK_BIT('E') | BLOCK_BIT('H') |
                      BLOCK_BIT('K') | BLOCK_BIT('L') | BLOCK_BIT('U') | BLOCK_BIT('V') |
                      BLOCK_BIT('J') | BLOCK_BIT('W') | BLOCK_BIT('S') | BLOCK_BIT('F') |
                      BLOCK_BIT('T') | BLOCK_BIT('A') | BLOCK_BIT('B')))
        return false;
    const word *name = words_take(c, 'C'), *sign = words_take(c, 'K'), *step = words_take(c, 'L');
    condition_row row = conditions_draft(block_name(c->b, 'C'));
    uint32_t on = row.on_us, off = row.off_us, rest = row.rest_us, open = row.open_v,
             percent = row.open_percent, counts[3] = {row.dame, row.open, row.ok};
    if (!current(c, &row) || !words_whole(c, 'P', 1, CONDITIONS_PULSE_US, "the on-time", &on) ||
        !words_whole(c, 'Q', 1, CONDITIONS_OFF_US, "the off-time", &off) ||
        !words_whole(c, 'R', 0, CONDITIONS_OFF_US, "the rest after an arc", &rest) ||
        !words_whole(c, 'E', CONDITIONS_OPEN_V_LOWEST, CONDITIONS_OPEN_V_HIGHEST, "the open voltage", &open) ||
        !words_whole(c, 'H', 1, 99, "the open level", &percent) || !presets(c, counts) ||
        !rules(c, &row) || !ignition(c, on, &row))
        return false;
    if (sign && (sign->number.decimals || sign->number.digits != 1))
        return fault_at(c->f, FAULT_TABLE, sign->column, "the polarity K must be 1 or -1");
    int32_t pulses = row.step;
    if (step && (!words_distance(c, step, 'L', &pulses) || pulses < 1 || pulses > UINT16_MAX))
        return fault_at(c->f, FAULT_TABLE, step->column, "the servo step L is out of range");
    if (!on || !off)
        return fault_at(c->f, FAULT_MISSING, 0, "a new condition needs its times P and Q");
    if (open % GAP_SUPPLY_STEP_V)
        return fault_at(c->f, FAULT_TABLE, BLOCK_WORD(c->b, 'E')->column,
                        "the open voltage E must be a multiple of %u V", (uint32_t)GAP_SUPPLY_STEP_V);
    /* The class of the fluid may lower the open level to GAP_SHARE_PERCENT. */
    if (open * percent * GAP_SHARE_PERCENT <= row.arc_v * 10000u)
        return fault_at(c->f, FAULT_TABLE, name->column,
                        "the open level (%u %% of %u V) must be above twice the arc level of %u V",
                        percent, open, (uint32_t)row.arc_v);
    watch_between(); /* to read so many words takes long, and to judge the condition does too */
    row.on_us = (uint16_t)on;
    row.off_us = (uint16_t)off;
    row.rest_us = (uint16_t)rest;
    row.open_v = (uint16_t)open;
    row.open_percent = (uint8_t)percent;
    row.negative = sign ? sign->negative : row.negative;
    row.step = (uint16_t)pulses;
    row.dame = (uint8_t)counts[0];
    row.open = (uint8_t)counts[1];
    row.ok = (uint8_t)counts[2];
    if (!references(words_take(c, 'V'), words_take(c, 'U'), &row, c->f))
        return false;
    if (!conditions_enter(&row, mdi))
        return fault_at(c->f, FAULT_TABLE, name->column, "no more than %u conditions can be entered",
                        (uint32_t)CONDITIONS_ENTERED);
    return true;
}

bool gap_words_class(context *c) {
    if (!words_alone(c, AXIS_LETTERS | BLOCK_BIT('W') | BLOCK_BIT('H')))
        return false;
    uint32_t number = 0;
    if (!words_whole(c, 'W', 0, GAP_CLASSES - 1, "the fluid's class", &number))
        return false;
    gap_class row = in_force_class(number);
    uint32_t share = row.share_percent, counts[3] = {row.dame, row.open, row.ok};
    if (!presets(c, counts) ||
        !words_whole(c, 'H', GAP_SHARE_PERCENT, 100, "the share of the open voltage", &share))
        return false;
    c->p->class_number = number;
    c->p->class_row = (gap_class){(uint8_t)counts[0], (uint8_t)counts[1], (uint8_t)counts[2],
                                  (uint8_t)share};
    return true;
}
