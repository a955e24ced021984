// SPDX-License-Identifier: Apache-2.0
/* The series of conditions by depth (G39). Its next step is staged in the gateware, which switches by
   itself when the jump axis has reached the depth; firmware then stages the step behind it. Steps that
   lie closer than that takes are switched late, one after the other, each at once when it is staged.

   Only the furthest position of the jump axis since the series began counts. */
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

/* Whether a step may follow: from a depth (machine frame, of which `offset` is the program frame's
   origin) on a condition, for a law of the feed. */
bool depth_series_check(int32_t depth, int32_t offset, const condition_row *row, unsigned mode,
                        uint32_t column, fault *f);
void depth_series_add(int32_t depth, const condition_row *row);

/* Whether the condition in force and those to come have what a law needs of them; true without a
   series. */
bool depth_series_check_mode(unsigned mode, uint32_t column, fault *f);

/* A condition in force or to come of whose pulses no short would be seen; a null pointer if there is
   none. */
const condition_row *depth_series_unseen(void);

/* No further step: what is in force stays. False while a switch is still to be told: call again. */
bool depth_series_end(void);
void depth_series_drop(void);         /* the same at once, whatever is still to be told */
void depth_series_replaced(void);     /* the condition in force is none of a series any more */
bool depth_series_reached(void);      /* it is one */

/* Take the stage from the gateware, for the condition in force; false while it may not be written. A
   switch that has come meanwhile is noticed. */
bool depth_series_take_stage(void);

/* Stage the next step, if the stage is free; true if it took that time. In every round of the main
   loop. */
bool depth_series_step(void);
bool depth_series_waits(void);     /* for the gateware to take what was staged last */

/* The gateware tells that it has switched: the step, or a null pointer if that has been told. */
const depth_step *depth_series_switched(void);
