// SPDX-License-Identifier: Apache-2.0
/* The gap: the condition in force, what the fluid's class makes of it, and the servo. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "gap/conditions.h"
#include "gap/in_force.h"
#include "hal/hal.h"

void gap_init(void);
void gap_settings(void);                        /* settings of servo and fluid have changed */
void gap_condition(const condition_row *row);  /* put a condition in force */
/* Law of the feed, as G95 P has it, and the row of the program's condition, by whose references as they
   are now it was judged; 0 for G94. */
void gap_servo(unsigned mode, const condition_row *judged);
bool gap_serves(void);                          /* the feed goes by the gap, not by F alone */

/* Enter the row of a class of the fluid. */
void gap_class_enter(unsigned number, const gap_class *row, bool by_hand);
void gap_start(void);                           /* a program starts: forget what tapes have entered */

/* Whether the class that the fluid is to have by measurement is known; false with a fault if it cannot
   be, or without one while the first average is still to come. */
bool gap_ready(fault *f);

/* The gateware tells of the fluid. True if the host is to be told of the class in force. */
bool gap_fluid(const hal_event *event);

/* What of the machine decides whether discharges and depth must come. */
typedef struct {
    bool machining, held;
    bool at_front;              /* nothing is left to go; looked at only if gap_serves */
} gap_view;

bool gap_settled(void);     /* nothing waits until the gateware can take it */

/* In every round: conditions by depth; discharges and depth must come. True if it took its time. */
bool gap_watch(const gap_view *view);
