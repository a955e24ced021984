// SPDX-License-Identifier: Apache-2.0
/* Machine constants that the host writes before a run (`$n=value`) and lists (`$$`). */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"
#include "base/travel.h"

typedef enum {
    SET_SHORT_NEEDED, SET_SHORT_WINDOW, SET_SHORT_DURATION_US, SET_CLEAR_NEEDED, SET_BLANKING_NS,
    SET_SENSE_ON_NS, SET_SENSE_OFF_NS, SET_GAIN_PULSES, SET_REPEATS, SET_SETTLE_US,
    SET_START_SPEED_UM_S, SET_ACCELERATION_MM_S2, SET_HIGHEST_SPEED_MM_MIN,
    SET_FOLLOW_STOPPED, SET_FOLLOW_MOVING, SET_SOFT_LIMIT_UM,
    SET_STEP_AXES, SET_REVERSED_ENCODERS, SET_STEP_WIDTH_NS, SET_STEP_SPACE_NS, SET_STEP_SETUP_NS,
    SET_WINDOW, SET_TV, SET_BLOCK_SKIP, SET_OPTIONAL_STOP, SET_FIN_MS, SET_FLUID_REQUIRED,
    SET_SETTLE_NS, SET_CONFIRM_NS, SET_DELAY_LEAST_NS, SET_CRITERIA,
    SET_SERVO_PERIOD_US, SET_SERVO_MODE, SET_SERVO_WINDOW, SET_SERVO_WEIGHT, SET_NO_DISCHARGE_UM,
    SET_FLUID_MODE, SET_FLUID_CLASS, SET_FLUID_THRESHOLD_0, SET_FLUID_THRESHOLD_1,
    SET_FLUID_THRESHOLD_2, SET_FLUID_HYSTERESIS, SET_FLUID_LOWEST, SET_FLUID_HIGHEST,
    SET_NO_PROGRESS_S,
    SET_LAW_WINDOW_US, SET_LAW_GAIN_ZERO, SET_LAW_GAIN_FEED, SET_LAW_UNIT_UM, SET_LAW_LONGEST_MS,
    SET_LAW_LEAST_MV, SET_LAW_RATIO_LOWEST, SET_LAW_RATIO_HIGHEST, SET_LAW_NO_LOAD,
    SET_ARC_DIFFERENCE_NM, SET_CURRENT_STEP_MA, SET_LOOP_GAIN, SET_ARC_DEVIATION_NM,
    SET_LOW_X_UM, SET_LOW_Y_UM, SET_LOW_Z_UM, SET_HIGH_X_UM, SET_HIGH_Y_UM, SET_HIGH_Z_UM,
    SETTINGS
} setting;

typedef struct {
    uint32_t initial, lowest, highest;
    const char *name;
} setting_row;

extern const setting_row SETTINGS_ROWS[SETTINGS];

/* Initial values, into the gateware; `between` is called between the parts, which take their time. */
void settings_init(void (*between)(void));
/* Once more into the registers that the gateware guards: a bit of one may have turned over. */
void settings_renew(void);
uint32_t settings_get(setting which);
/* Must this one stay while the machine moves or machines? All but those that only tune it. */
bool settings_guard(uint32_t which);

/* Guards that settings have switched off, and coders that step axes do not have: names with commas in
   between; of SETTINGS_MASKED characters. */
#define SETTINGS_MASKED 96
void settings_masked(char *text, size_t size);
bool settings_set(uint32_t which, uint32_t value);  /* false: unknown or out of range */

/* Is it one of servo, fluid or feed? After a change of it gap_settings is to be called. */
bool settings_of_gap(uint32_t which);

/* A line `$n=value`, and what it says. */
bool settings_read(const char *line, uint32_t length, uint32_t *which, uint32_t *value, fault *f);
bool settings_enter(uint32_t which, uint32_t value, fault *f);

/* Settings in the gateware's units. */
uint32_t settings_start_rate(void);
uint32_t settings_acceleration(void);
uint32_t settings_highest_speed(void);  /* um/min, */
uint32_t settings_highest_rate(void);   /* and its rate */
uint32_t settings_curve_rate(uint32_t radius);  /* highest one on an arc; radius in pulses */
const travel_range *settings_travel(void);    /* the soft limits */
const travel_range *settings_travel_now(void); /* ... and the limit switches that are just being left */
