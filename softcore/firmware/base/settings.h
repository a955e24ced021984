// SPDX-License-Identifier: Apache-2.0
/* Machine constants that the host writes before a run (`$n=value`) and lists (`$$`). */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"
#include "base/settings_table.h"
#include "base/travel.h"

/* Initial values, into the gateware; `between` is called between the parts, which take their time. */
void settings_init(void (*between)(void));
/* Once more into the registers that the gateware guards: a bit of one may have turned over. */
void settings_renew(void);
uint32_t settings_get(setting which);

/* Setting of a number; SETTINGS if there is none. And the number of a setting. */
setting settings_find(uint32_t number);
uint32_t settings_number(setting which);

/* Must this one stay while the machine moves or machines? What is no setting must. */
bool settings_guard(uint32_t number);

/* Guards that settings have switched off, and coders that step axes do not have: names with commas in
   between; of SETTINGS_MASKED characters. */
#define SETTINGS_MASKED 96
void settings_masked(char *text, size_t size);
bool settings_set(uint32_t number, uint32_t value); /* false: unknown or out of range */

/* Is it one of servo, fluid or feed? After a change of it gap_settings is to be called. */
bool settings_of_gap(uint32_t number);

/* A whole number at `at`, which moves behind it; false if there is none. */
bool settings_read_number(const char *line, uint32_t length, uint32_t *at, uint32_t *value);

/* A line `$n=value`, and what it says. */
bool settings_read(const char *line, uint32_t length, uint32_t *number, uint32_t *value, fault *f);
bool settings_enter(uint32_t number, uint32_t value, fault *f);

/* Settings in the gateware's units. */
uint32_t settings_start_rate(void);
uint32_t settings_acceleration(void);
uint32_t settings_highest_speed(void);  /* um/min, */
uint32_t settings_highest_rate(void);   /* and its rate */
uint32_t settings_curve_rate(uint32_t radius);  /* highest one on an arc; radius in pulses */
const travel_range *settings_travel(void);    /* the soft limits, */
uint32_t settings_travel_um(unsigned axis);     /* and how far they are apart */
const travel_range *settings_travel_now(void); /* ... and the limit switches that are just being left */
