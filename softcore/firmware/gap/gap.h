// SPDX-License-Identifier: Apache-2.0
/* The gap: the condition in force, what the fluid's class makes of it, and the servo. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "gap/technology.h"
#include "hal/hal.h"

#define GAP_CLASSES 4           /* of the fluid: 0 has the highest resistance */
#define GAP_SHARE_PERCENT 50    /* of the open voltage: so much at least must a fluid leave */
#define GAP_SUPPLY_STEP_V 20    /* of the power supply's open voltage */

/* Of a class: presets of the counters, and what share of the open voltage the fluid leaves. */
typedef struct {
    uint8_t dame, open, ok, share_percent;
} gap_class;

void gap_init(void);
void gap_settings(void);                        /* settings of servo and fluid have changed */
void gap_condition(const technology_row *row);  /* put a condition in force */
void gap_stage(const technology_row *row);      /* stage one for the gateware to switch to */
void gap_switched(const technology_row *row);   /* it has */
const technology_row *gap_row(void);            /* the condition in force, or a null pointer */
bool gap_current_kept(void);                    /* the supply's step is what it was at the C */
/* Law of the feed, as G95 P has it, and the row of the program's condition, by whose references as they
   are now it was judged; 0 for G94. */
void gap_servo(unsigned law, const technology_row *judged);
bool gap_serves(void);                          /* the feed goes by the gap, not by F alone */

gap_class gap_class_row(unsigned number);
void gap_class_enter(unsigned number, const gap_class *row, bool by_hand);
void gap_start(void);                           /* a program starts: forget what tapes have entered */

/* Whether the class that the fluid is to have by measurement is known; false with a fault if it cannot
   be, or without one while the first average is still to come. */
bool gap_ready(fault *f);
void gap_fluid(const hal_event *event, uint64_t cycle); /* the gateware tells of the fluid */
/* In every round: conditions by depth; discharges and depth must come. True if it took its time. */
bool gap_watch(void);
