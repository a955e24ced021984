// SPDX-License-Identifier: Apache-2.0
/* Feed by the mean gap voltage: the laws of G95 beside the counted classes. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "gap/conditions.h"

/* Laws of the feed, as G95 P names them; 0 is G94. */
typedef enum { FEED_CONSTANT, FEED_CLASSES, FEED_ZERO, FEED_OFFSET, FEED_REMOVAL, FEED_MODES } feed_mode;

/* Whether a law has what it needs of a condition, if there is one, and of the settings; else a fault. */
bool feed_modes_check(unsigned mode, const condition_row *row, uint32_t column, fault *f);

/* Mean voltage of a condition without discharges, off-time included, mV: open voltage by on-time
   over period, of which the fluid leaves a share. */
uint32_t feed_modes_no_load_mv(const condition_row *row, uint32_t share_percent);

void feed_modes_init(void);
void feed_modes_select(unsigned mode);  /* in force with the next feed_modes_settings */
/* Stage the references of a condition with a no-load voltage (a level): that of the row, or the one
   in force. */
void feed_modes_stage(const condition_row *row, uint32_t no_load);
uint32_t feed_modes_no_load_of(const condition_row *row, uint32_t share_percent);
uint32_t feed_modes_no_load(void);
void feed_modes_condition(const condition_row *row, uint32_t share_percent);  /* another is in force */
void feed_modes_settings(void);        /* settings have changed */
bool feed_modes_measures(void);        /* the law in force needs the converter */
bool feed_modes_watch(bool machining, const uint32_t counts[4]);   /* in every pass; true: a no-load voltage
                                                               was measured, and is to be staged */
