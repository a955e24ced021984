// SPDX-License-Identifier: Apache-2.0
/* Lines for the roughing planner. They are data of the machine and not part of a program, and they
   hold lists of numbers, which a block cannot have. So they begin with `$`, as settings do:

   $BMcopper_steel      the pair of materials that the lines below enter and plan with; $BM alone
                        tells which it is. Without it the pair has no name
   $BD0,0.5,1,2         depths in mm; this forgets all data of the pair entered before
   $BR1,0,5,-4          finishes, if there are any: a roughness in um Rmax, and by how much the stock
                        on the side differs from that for 1 um, in um
   $BA50                an area in mm2
   $BI6,84,86,88,92,30,25  a current in IP, and the undersize that it needs at each depth, in um;
                        the stock that it leaves on bottom and side may follow
   $BL                  list the data of all pairs, as the lines that would enter them again
   $BF50                take the area of 50 mm2 out, $BFcopper_steel a pair; $BF alone forgets all
   $BP70,110,15         plan: area, undersize, depth; gradient in degrees, seed, and roughness of
                        the finished surface in um Rmax may follow

   G39 P1 puts the last planned staircase in force (result.h).

   All but the last are answered at once. `$BP` is answered at the end of the planning: by a
   line with the undersize that the last step needs, a line for each current from the surface down
   with the depth to which it is used, the stock that the last one leaves, notes if there are any,
   and then ok. Lines that come
   meanwhile wait. While a program runs, the planning waits. The power supply is set in whole IP. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/fault.h"

void roughing_init(void);
void roughing_stop(void);    /* end a planning that is not finished; the data stay */

/* Take a line, without its `$B`. Its text must stay while the planner is busy. It is answered after
   it was carried out. */
void roughing_line(const char *from, uint32_t characters);

bool roughing_busy(void);

/* One step. ROUGHING_WAITS: a program runs, nothing was done. ROUGHING_TELLS: `text` holds a line
   of the result. ROUGHING_ANSWERS: the line was carried out, or is refused with a fault. */
typedef enum { ROUGHING_WAITS, ROUGHING_WORKS, ROUGHING_TELLS, ROUGHING_ANSWERS } roughing_step;
roughing_step roughing_serve(bool program_runs, char *text, size_t size, fault *f);
