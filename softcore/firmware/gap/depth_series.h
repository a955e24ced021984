// SPDX-License-Identifier: Apache-2.0
/* The depth series (G39): conditions that the machine switches to by depth. The next step is staged
   in the gateware, which switches by itself when the jump axis reaches the depth. The firmware then
   stages the following step. If steps lie so close together that staging is too slow, they are
   switched late, each as soon as it is staged.

   The depth is the furthest position of the jump axis since the series began. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "gap/conditions.h"

#define DEPTH_SERIES_STEPS 32

typedef struct {
    int32_t depth;              /* machine frame */
    condition_row row;
} depth_step;

/* May this step follow, with the condition `row` from `depth` on and this feed mode? Depth and
   `offset`, the origin of the program frame, are in the machine frame. False with a fault. */
bool depth_series_check(int32_t depth, int32_t offset, const condition_row *row, unsigned mode,
                        uint32_t column, fault *f);
void depth_series_add(int32_t depth, const condition_row *row);

/* Do the condition in force and all further steps have the references that a feed mode needs? True
   without a series; false with a fault. */
bool depth_series_check_mode(unsigned mode, uint32_t column, fault *f);

/* A condition, in force or in a further step, whose pulses end before the comparators are read; a
   null pointer if there is none. */
const condition_row *depth_series_unseen(void);

/* End the series; the condition in force stays. False while a switch is still to be told: call
   again. */
bool depth_series_end(void);
void depth_series_drop(void);       /* end it at once, even if a switch is still to be told */
void depth_series_replaced(void);   /* the condition in force is no longer one of a series */
bool depth_series_reached(void);    /* the condition in force is one of a series */

/* Take the staged step back from the gateware, so that the condition in force can be staged. False
   while the stage may not be written. Notices a switch that has come meanwhile. */
bool depth_series_take_stage(void);

/* Stage the next step if the stage is free; true if it did. Call in every round of the main
   loop. */
bool depth_series_step(void);
bool depth_series_waits(void);      /* a step is still to be staged */

/* Call when the gateware tells that it has switched. Returns the step, or a null pointer if this
   switch was told already. */
const depth_step *depth_series_switched(void);
