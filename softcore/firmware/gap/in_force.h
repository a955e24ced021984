// SPDX-License-Identifier: Apache-2.0
/* The condition in force and the class of the fluid, and what the gateware is told of both. That is
   staged there until hal_condition_commit, or until the gateware switches by depth. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "gap/conditions.h"

#define GAP_CLASSES 4           /* of the fluid: 0 has the highest resistance */
#define GAP_SHARE_PERCENT 50    /* of the open voltage: so much at least must a fluid leave */
#define GAP_SUPPLY_STEP_V 20    /* of the power supply's open voltage */

/* Of a class: presets of the counters, and what share of the open voltage the fluid leaves. */
typedef struct {
    uint8_t dame, open, ok, share_percent;
} gap_class;

void in_force_init(void);                       /* no condition, class 0, the patent's presets */

/* Rows of the classes. What is entered by hand is kept when a program starts (in_force_start). */
gap_class in_force_class(unsigned number);
void in_force_enter_class(unsigned number, const gap_class *row, bool by_hand);
void in_force_start(void);

unsigned in_force_fluid(void);                  /* the class in force */
bool in_force_set_fluid(unsigned number);       /* true if it is another one than before */

/* The condition in force; a null pointer before the first. */
const condition_row *in_force_row(void);
void in_force_set(const condition_row *row);
void in_force_switched(const condition_row *row);  /* the gateware has switched to it by depth */
bool in_force_current_kept(void);               /* the supply's step is what it was at the C */

/* Take the references of a condition as they are now; true if that changes the one in force. */
bool in_force_take_references(const condition_row *row);

void in_force_apply(void);                      /* condition or class have changed: no-load voltage */
void in_force_stage(const condition_row *row); /* stage one for the gateware to switch to */
void in_force_stage_now(void);  /* stage what is in force; without a condition, the class's presets */
