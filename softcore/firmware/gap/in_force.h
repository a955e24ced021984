// SPDX-License-Identifier: Apache-2.0
/* The condition in force and the class of the fluid, and the values for the gateware that follow
   from them. These are staged there until hal_condition_commit, or until the gateware switches by
   depth. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "gap/conditions.h"

#define GAP_CLASSES 4           /* of the fluid: 0 has the highest resistance */
#define GAP_SHARE_PERCENT 50    /* least share of the open voltage that a fluid may leave */
#define GAP_SUPPLY_STEP_V 20    /* step of the power supply's open voltage */

/* A class: presets of the counters, and the share of the open voltage that the fluid leaves. */
typedef struct {
    uint8_t dame, open, ok, share_percent;
} gap_class;

void in_force_init(void);                       /* no condition, class 0, its presets */

/* Rows of the classes. The start of a program (in_force_start) keeps the rows entered by hand. */
gap_class in_force_class(unsigned number);
void in_force_enter_class(unsigned number, const gap_class *row, bool by_hand);
void in_force_start(void);
const gap_class *in_force_kept_class(unsigned number);  /* by hand, or the first */
uint32_t in_force_edition(void);    /* a number that every change of them changes */
void in_force_forget_classes(void);

unsigned in_force_fluid(void);                  /* the class in force */
bool in_force_set_fluid(unsigned number);       /* true if the class has changed */

/* The condition in force; a null pointer before the first. */
const condition_row *in_force_row(void);
void in_force_set(const condition_row *row);
void in_force_switched(const condition_row *row);  /* the gateware has switched to it by depth */
bool in_force_current_kept(void);               /* the supply's step has not changed since the C */

/* Copy a condition's references into the one in force; true if they differed. */
bool in_force_take_references(const condition_row *row);

/* Levels of the comparators that are tried in place of the condition's, until a condition is set. */
void in_force_try(bool on, uint32_t open, uint32_t arc);
bool in_force_tries(void);

void in_force_apply(void);      /* renew the no-load voltage: condition or class has changed */
void in_force_stage(const condition_row *row);  /* stage a condition for a switch by depth */
void in_force_stage_now(void);  /* stage the condition in force; without one, the class's presets */
