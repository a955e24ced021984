// SPDX-License-Identifier: Apache-2.0
#include "gap/feed_modes.h"

#include "base/settings.h"
#include "base/units.h"
#include "hal/hal.h"

/* A level is 2**-16 of the converter's full scale, 100 V at the gap. K is for 1/16 of full
   scale. */
#define LEVELS(mv) ((mv) * 2048 / 3125)
#define GAIN_STEP(gain) ((gain) * 25 / 4)

/* A no-load voltage is measured over at least so many open pulses and windows without a counted
   discharge. Three windows, since the first and the last may each contain part of a discharge: one
   that was counted before, or one whose pulse has not ended yet. */
#define CLEAN_PULSES 64
#define CLEAN_WINDOWS 3

static unsigned mode;
static uint32_t no_load;                /* level: computed, or measured */
static uint32_t discharges, opens;      /* counts when the last discharge was noticed */
static uint8_t windows;                 /* windows that the gateware had counted at the last look */
static unsigned clean;                  /* windows without a discharge, up to CLEAN_WINDOWS */
static uint32_t before;                 /* level: mean of the last of them */

bool feed_modes_check(unsigned number, const condition_row *row, uint32_t column, fault *f) {
    if (number < FEED_ZERO || !row)
        return true;
    bool by_drop = number >= FEED_REMOVAL;
    if (!(by_drop ? row->drop_mv : row->reference_mv))
        return fault_at(f, FAULT_CONDITION, column,
                        "G95 P%u needs a reference %s, %c of G10, which the condition C%u does not have",
                        number, by_drop ? "drop Es" : "voltage Vs", by_drop ? 'U' : 'V', row->number);
    if (by_drop && settings_get(SET_FEED_MODE_RATIO_LOWEST) > settings_get(SET_FEED_MODE_RATIO_HIGHEST))
        return fault_at(f, FAULT_SETTING, column,
                        "the lowest ratio Es/Ex of the settings is above the highest");
    return true;
}

/* At most 300 V, 2000 us: below 2**32. An open pulse lasts for the on-time, or for the wait. */
uint32_t feed_modes_no_load_mv(const condition_row *row, uint32_t share_percent) {
    uint32_t wait_us = conditions_wait_us(row), open_us = wait_us ? wait_us : row->on_us;
    return row->open_v * share_percent * 10 * open_us / (open_us + row->off_us);
}

bool feed_modes_measures(void) { return mode >= FEED_ZERO; }

void feed_modes_settings(void) {
    if (!feed_modes_measures()) {
        /* In the other modes these words have no effect, and converting them takes time. */
        static const hal_feed_mode none;
        hal_feed_mode_write(&none);
        return;
    }
    bool distance = mode >= FEED_REMOVAL, shares = mode == FEED_DISCHARGE;
    uint32_t gain = settings_get(mode == FEED_ZERO ? SET_FEED_MODE_GAIN_ZERO : SET_FEED_MODE_GAIN_FEED);
    uint32_t us = distance ? settings_get(SET_FEED_MODE_LONGEST_MS) * 1000 : settings_get(SET_FEED_MODE_WINDOW_US);
    uint32_t pulses = (uint32_t)units_pulses_of_um(settings_get(shares ? SET_FEED_MODE_DISCHARGE_UM : SET_FEED_MODE_UNIT_UM));
    hal_feed_mode words = {
        .mode = (shares ? FEED_REMOVAL : mode) - FEED_CLASSES,
        .measure = true,
        .shares = shares,
        .unit = !distance ? 0 : pulses < UINT16_MAX ? pulses : UINT16_MAX,
        .window = units_clocks_of_us(us),
        /* Of a share the bounds of Es/Ex are enough. */
        .least = shares ? 1 : LEVELS(settings_get(SET_FEED_MODE_LEAST_MV)),
        .lowest = settings_get(SET_FEED_MODE_RATIO_LOWEST) * 4096 / 1000,
        .highest = settings_get(SET_FEED_MODE_RATIO_HIGHEST) * 4096 / 1000,
        .gain = units_rate(GAIN_STEP(gain)),
        .fastest = units_rate(settings_highest_speed()),
    };
    hal_feed_mode_write(&words);
}

void feed_modes_init(void) {
    mode = FEED_CONSTANT;
    no_load = 0;
    clean = 0;
}

void feed_modes_select(unsigned number) { mode = number; }

uint32_t feed_modes_no_load_of(const condition_row *row, uint32_t share_percent) {
    return LEVELS(feed_modes_no_load_mv(row, share_percent));
}

uint32_t feed_modes_no_load(void) { return no_load; }

void feed_modes_stage(const condition_row *row, uint32_t level) {
    /* Of the time, 2**-16: the voltage of a discharge counts as 0. At most on over period. */
    uint32_t share = row->open_v ? (row->drop_mv << 13) / (row->open_v * 125u) : 0;
    hal_feed_mode_references(level, LEVELS(row->reference_mv), LEVELS(row->drop_mv), share);
}

void feed_modes_condition(const condition_row *row, uint32_t share_percent) {
    no_load = feed_modes_no_load_of(row, share_percent);
    clean = 0;
}

bool feed_modes_watch(bool machining, const uint32_t counts[4]) {
    if (!feed_modes_measures() || mode == FEED_DISCHARGE || !settings_get(SET_FEED_MODE_NO_LOAD))
        return false;
    hal_feed_mode_state state = hal_feed_mode_read();
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
