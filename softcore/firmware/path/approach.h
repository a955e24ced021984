// SPDX-License-Identifier: Apache-2.0
/* Remembers the direction that led to the work, and finds moves that lead away from it. With the
   discharge off, contact stops the machine, except on moves by which the electrode leaves the
   cavity or the point that it touched: see rtl.gap.contact. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/move.h"

#define APPROACH_ONE 64     /* length of a direction vector */

void approach_init(void);

/* Call when the discharge goes off, or the electrode touches, in a segment of this direction. The
   direction is kept until the next call, also over alarms and new paths. */
void approach_note(const int8_t way[HAL_AXES]);

/* Does a line lead away from the work? It does if at least an eighth of its length goes against
   that direction, so that a line along a wall is still watched; or if it goes straight up the jump
   axis, like a jump. */
bool approach_leads_away(const path_move *line);
