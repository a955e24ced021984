// SPDX-License-Identifier: Apache-2.0
/* The operator walks along the path: back from the front, and forward again (`$WALK`).

   The gateware goes back to the place ordered, and lets nothing pass it on the way forward. In a walk
   the machine reports a hold. The hold itself is lifted only away from the front, so that the place
   ordered bounds every way forward. A `!` puts it in force again, until the next `$WALK`. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

/* No walk: also after an alarm, a reset, and before a new path. */
void walk_drop(void);

/* A line `$WALK=mm`. Begins a walk, or changes the place of the one under way. */
void walk_line(const char *line, uint32_t length, fault *f);

void walk_hold(void);       /* a `!` came */
void walk_end(void);        /* `~`: the machine comes to the front, and goes on */
void walk_step(void);       /* call in every round */

/* Does the status tell a distance before the front? In a walk, and in any hold behind the front. */
bool walk_told(void);

/* Distance before the front that was ordered, 0 for no walk; and that of the machine. In pulses. */
int32_t walk_goal(void);
int32_t walk_distance(void);
