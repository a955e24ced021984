// SPDX-License-Identifier: Apache-2.0
/* The last staircase that the planner has found, as a depth series. G39 P1 puts it in force.

   Each current has the condition that conditions_planned gives it at the time when the staircase is
   found. No staircase is held during planning, nor if the power supply cannot be set to all its
   currents. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "gap/conditions.h"

void result_forget(void);

/* Add a current in IP and the depth to which it is used. Currents come from the surface down. */
void result_add(uint32_t ip, uint32_t depth_um);

/* Hold the staircase after its last current. False if it is empty, or if the power supply cannot be
   set to one of the currents. */
bool result_hold(void);

/* Hold one step that agrees with any block. For a check without a machine, which cannot know what
   will be planned. */
void result_presume(void);

/* Number of steps held; 0 after a change of the power supply's setting. */
unsigned result_count(void);
const condition_row *result_row(unsigned step);
const condition_row *result_first(void); /* a copy of the first row, valid until the next call */
int32_t result_depth(unsigned step);    /* where the step begins, pulses below Z 0 */
