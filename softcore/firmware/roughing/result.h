// SPDX-License-Identifier: Apache-2.0
/* The staircase that the planner has found last, as a series of conditions: what G39 P1 puts in force.

   Each current has the condition that host/roughing gives it (conditions_planned), as it is when
   the staircase is found. Nothing is held while one is being planned, nor if the supply cannot be
   set to all of its currents. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "gap/conditions.h"

void result_forget(void);

/* Add a current, in IP, and the depth to which it is used; from the surface down. */
void result_add(uint32_t ip, uint32_t depth_um);

/* All are there: hold them. False if there is none, or the supply cannot be set to one of them. */
bool result_hold(void);

/* For a check without a machine, which cannot know what will have been planned: hold one step that
   any block goes with. */
void result_presume(void);

/* Steps held; none after a change of the supply's setting. */
unsigned result_count(void);
const condition_row *result_row(unsigned step);
const condition_row *result_first(void);  /* the first, which stays until this is called again */
int32_t result_depth(unsigned step);   /* from which on, pulses below Z 0 */
