// SPDX-License-Identifier: Apache-2.0
/* The gap: the condition in force, the effect of the fluid's class on it, and the servo. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "gap/conditions.h"
#include "gap/in_force.h"
#include "hal/hal.h"

void gap_init(void);
void gap_settings(void);                        /* settings of servo or fluid have changed */
void gap_condition(const condition_row *row);   /* put a condition in force */

/* Set the feed mode, with the number of G95 P. `judged` is the condition that the interpreter
   checked it with, 0 for G94; its references come into force, as G10 may have changed them. */
void gap_servo(unsigned mode, const condition_row *judged);
bool gap_serves(void);                          /* the feed goes by the gap, not by F alone */

/* Try levels of the comparators, in 1/1024, with the converter on; or end it. A condition ends it, and
   so does gap_ready. Not while the discharge is on. */
void gap_try(bool on, uint32_t open, uint32_t arc);
void gap_end_trial(void);

/* Enter the row of a class of the fluid. */
void gap_class_enter(unsigned number, const gap_class *row, bool by_hand);
void gap_start(void);                           /* a program starts: forget what tapes have entered */

/* Can machining begin? If the fluid's class is measured it must be known. False with a fault if the
   detector is in trouble; false without one while its first average is still to come. */
bool gap_ready(fault *f);

/* Take an event about the fluid. True if the host must be told the class in force. */
bool gap_fluid(const hal_event *event);

/* State of the machine that decides whether to expect discharges and progress. */
typedef struct {
    bool machining, held;
    bool at_front;              /* there is no way left to go; used only if gap_serves */
} gap_view;

bool gap_settled(void);     /* nothing waits to be written to the gateware */

/* Call in every round. Stages conditions by depth, and raises an alarm if expected discharges or
   progress do not come. True if it wrote to the gateware. */
bool gap_watch(const gap_view *view);
