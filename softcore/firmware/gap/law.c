// SPDX-License-Identifier: Apache-2.0
#include "gap/law.h"

#include "base/settings.h"
#include "base/units.h"
#include "hal/hal.h"

/* A level is 2**-16 of the converter's full scale, 100 V at the gap; K is for a sixteenth of it. */
#define LEVELS(mv) ((mv) * 2048 / 3125)
#define GAIN_STEP(gain) ((gain) * 25 / 4)

#define CLEAN_PULSES 64         /* open pulses that a no-load voltage is measured with, at least, */
#define CLEAN_WINDOWS 3         /* and windows: the first may have begun before, the last may have begun
                                   to see a discharge that is not counted before its pulse ends */

static unsigned law;
static uint32_t no_load;                /* level: computed, or measured */
static uint32_t discharges, opens;      /* when the last discharge was noticed, */
static uint8_t windows;                 /* means taken when one was noticed, */
static unsigned clean;                  /* and those without a discharge */
static uint32_t before;                 /* level: the last of them */

bool law_word(const word *w, uint32_t column, uint8_t *number, fault *f) {
    if (!w)
        return fault_at(f, FAULT_MISSING, column, "G95 needs its law, P1 to P4");
    if (w->number.decimals || w->number.digits < LAW_CLASSES || w->number.digits >= LAWS)
        return fault_at(f, FAULT_NUMBER, w->column, "the law of G95 must be P1 to P4");
    *number = (uint8_t)w->number.digits;
    return true;
}

bool law_check(unsigned number, const technology_row *row, uint32_t column, fault *f) {
    if (number < LAW_ZERO || !row)
        return true;
    bool by_drop = number == LAW_REMOVAL;
    if (!(by_drop ? row->drop_mv : row->reference_mv))
        return fault_at(f, FAULT_CONDITION, column,
                        "G95 P%u needs a reference %s, %c of G10, which the condition C%u does not have",
                        number, by_drop ? "drop Es" : "voltage Vs", by_drop ? 'U' : 'V', row->number);
    if (by_drop && settings_get(SET_LAW_RATIO_LOWEST) > settings_get(SET_LAW_RATIO_HIGHEST))
        return fault_at(f, FAULT_SETTING, column,
                        "the lowest ratio Es/Ex of the settings is above the highest");
    return true;
}

/* At most 300 V, 2000 us: below 2**32. */
uint32_t law_no_load_mv(const technology_row *row, uint32_t share_percent) {
    return row->open_v * share_percent * 10 * row->on_us / (row->on_us + row->off_us);
}

static bool reference(char letter, const word *w, const technology_row *row, uint32_t *mv, fault *f) {
    uint32_t bound = law_no_load_mv(row, 100);
    /* Thousandths, as of a speed. */
    if ((!w || units_speed(w->number, false, mv)) && (!*mv || *mv < bound))
        return true;
    return fault_at(f, FAULT_TABLE, w ? w->column : 0,
                    "the reference %c must be below the mean without discharges, %u mV", letter, bound);
}

bool law_references(const word *voltage, const word *drop, technology_row *row, fault *f) {
    return reference('V', voltage, row, &row->reference_mv, f) &&
           reference('U', drop, row, &row->drop_mv, f);
}

bool law_measures(void) { return law >= LAW_ZERO; }

void law_settings(void) {
    if (!law_measures()) {
        /* Without a law the rest does not matter, and its conversions take their time. */
        static const hal_law none;
        hal_law_write(&none);
        return;
    }
    bool distance = law == LAW_REMOVAL;
    uint32_t gain = settings_get(law == LAW_ZERO ? SET_LAW_GAIN_ZERO : SET_LAW_GAIN_FEED);
    uint32_t us = distance ? settings_get(SET_LAW_LONGEST_MS) * 1000 : settings_get(SET_LAW_WINDOW_US);
    uint32_t pulses = (uint32_t)units_pulses_of_um(settings_get(SET_LAW_UNIT_UM));
    hal_law words = {
        .law = law < LAW_ZERO ? 0 : law - LAW_CLASSES,
        .measure = law_measures(),
        .unit = !distance ? 0 : pulses < UINT16_MAX ? pulses : UINT16_MAX,
        .window = units_clocks_of_us(us),
        .least = LEVELS(settings_get(SET_LAW_LEAST_MV)),
        .lowest = settings_get(SET_LAW_RATIO_LOWEST) * 4096 / 1000,
        .highest = settings_get(SET_LAW_RATIO_HIGHEST) * 4096 / 1000,
        .gain = units_rate(GAIN_STEP(gain)),
        .fastest = units_rate(settings_highest_speed()),
    };
    hal_law_write(&words);
}

void law_init(void) {
    law = LAW_CONSTANT;
    no_load = 0;
    clean = 0;
}


void law_select(unsigned number) { law = number; }

uint32_t law_no_load_of(const technology_row *row, uint32_t share_percent) {
    return LEVELS(law_no_load_mv(row, share_percent));
}

uint32_t law_no_load(void) { return no_load; }

void law_stage(const technology_row *row, uint32_t level) {
    hal_law_references(level, LEVELS(row->reference_mv), LEVELS(row->drop_mv));
}

void law_condition(const technology_row *row, uint32_t share_percent) {
    no_load = law_no_load_of(row, share_percent);
    clean = 0;
}

bool law_watch(bool machining, const uint32_t counts[4]) {
    if (!law_measures() || !settings_get(SET_LAW_NO_LOAD))
        return false;
    hal_law_state state = hal_law_read();
    uint32_t sum = counts[1] + counts[2] + counts[3];
    if (sum != discharges || !machining || !state.known) {
        discharges = sum;
        opens = counts[0];
        windows = state.windows;
        clean = 0;
        return false;
    }
    if (state.windows == windows)
        return false;
    windows = state.windows;
    clean += clean < CLEAN_WINDOWS;
    bool measured = clean == CLEAN_WINDOWS && counts[0] - opens >= CLEAN_PULSES && no_load != before;
    if (measured)
        no_load = before;
    before = state.mean;
    return measured;
}
