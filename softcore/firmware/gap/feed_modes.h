// SPDX-License-Identifier: Apache-2.0
/* Feed modes by the mean gap voltage: those of G95 other than the counted pulse classes. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "gap/conditions.h"

/* Feed modes with the numbers of G95 P; 0 is G94. */
typedef enum {
    FEED_CONSTANT, FEED_CLASSES, FEED_ZERO, FEED_OFFSET, FEED_REMOVAL, FEED_DISCHARGE, FEED_MODES
} feed_mode;

/* Does a condition, if there is one, have the references that a feed mode needs, and do the
   settings agree? False with a fault. */
bool feed_modes_check(unsigned mode, const condition_row *row, uint32_t column, fault *f);

/* Mean voltage of a condition without discharges, off-time included, mV: open voltage times on-time
   over period, times the share that the fluid leaves. */
uint32_t feed_modes_no_load_mv(const condition_row *row, uint32_t share_percent);

void feed_modes_init(void);
void feed_modes_select(unsigned mode);  /* in force with the next feed_modes_settings */

/* Stage the references of a condition with a no-load voltage (a level). */
void feed_modes_stage(const condition_row *row, uint32_t no_load);

/* No-load voltage (a level) as calculated for a condition, and as in force, which may be
   measured. */
uint32_t feed_modes_no_load_of(const condition_row *row, uint32_t share_percent);
uint32_t feed_modes_no_load(void);
void feed_modes_condition(const condition_row *row, uint32_t share_percent); /* put it in force */
void feed_modes_settings(void);         /* call when settings have changed */
bool feed_modes_measures(void);         /* the feed mode in force needs the converter */

/* Call in every pass. True: a new no-load voltage was measured and must be staged. */
bool feed_modes_watch(bool machining, const uint32_t counts[4]);
