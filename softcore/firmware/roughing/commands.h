// SPDX-License-Identifier: Apache-2.0
/* Lines for the roughing planner. They are the machine's own data, not part of a program, and lists of
   numbers, which no block can have; so they begin with `$`, as settings do:

   $BD0,0.5,1,2         depths in mm; what was entered before is forgotten
   $BA50                an area in mm2
   $BI6,84,86,88,92     a current in IP, and the undersize that it needs at each depth, in um
   $BP70,110,15         plan: area, undersize, depth; gradient in degrees and seed may follow

   What has been planned last is what G39 P1 puts in force (result.h).

   The first three are answered at once, the last when the planning is over: a line for each current
   from the surface down, then ok. Lines that come meanwhile wait. While a program runs, so does the
   planning. The supply is set in whole IP. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"

void roughing_init(void);
void roughing_stop(void);    /* forget a planning that is not over; the data stay */

/* A line from behind `$B` on, which must stay where it is as long as the planner is busy. It is answered
   when it has been carried out. */
void roughing_line(const char *from, uint32_t characters);

bool roughing_busy(void);

/* One step. While a program runs there is nothing to do (ROUGHING_WAITS). ROUGHING_TELLS: a line of the
   result is in `text`. ROUGHING_ANSWERS: the line has been carried out, or is refused with a fault. */
typedef enum { ROUGHING_WAITS, ROUGHING_WORKS, ROUGHING_TELLS, ROUGHING_ANSWERS } roughing_step;
roughing_step roughing_serve(bool program_runs, char *text, size_t size, fault *f);
