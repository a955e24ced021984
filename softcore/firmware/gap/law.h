// SPDX-License-Identifier: Apache-2.0
/* Feed by the mean gap voltage: the laws of G95 beside the counted classes. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "gap/technology.h"
#include "interp/block.h"

/* Laws of the feed, as G95 P names them; 0 is G94. */
typedef enum { LAW_CONSTANT, LAW_CLASSES, LAW_ZERO, LAW_OFFSET, LAW_REMOVAL, LAWS } law_number;

/* The law of the word P, if it is there, of a G95 that stands at a column. */
bool law_word(const word *w, uint32_t column, uint8_t *law, fault *f);

/* Whether a law has what it needs of a condition, if there is one, and of the settings; else a fault. */
bool law_check(unsigned law, const technology_row *row, uint32_t column, fault *f);

/* Mean voltage of a condition without discharges, off-time included, mV: open voltage by on-time
   over period, of which the fluid leaves a share. */
uint32_t law_no_load_mv(const technology_row *row, uint32_t share_percent);

/* Reference voltage and drop of a row, by words of G10 that may be missing; 0 V for none. */
bool law_references(const word *voltage, const word *drop, technology_row *row, fault *f);

void law_init(void);
void law_select(unsigned law);  /* in force with the next law_settings */
/* Stage the references of a condition with a no-load voltage (a level): that of the row, or the one
   in force. */
void law_stage(const technology_row *row, uint32_t no_load);
uint32_t law_no_load_of(const technology_row *row, uint32_t share_percent);
uint32_t law_no_load(void);
void law_condition(const technology_row *row, uint32_t share_percent);  /* another is in force */
void law_settings(void);        /* settings have changed */
bool law_measures(void);        /* the law in force needs the converter */
bool law_watch(bool machining, const uint32_t counts[4]);   /* in every pass; true: a no-load voltage
                                                               was measured, and is to be staged */
