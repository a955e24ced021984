// SPDX-License-Identifier: Apache-2.0
/* Which way has led to the work, and does a move lead away from it? With the discharge off contact
   stops the machine, but for the moves by which it gets out of what it has cut, or touched: see
   rtl.gap.contact. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/move.h"

#define APPROACH_ONE 64     /* a direction has parts of this, by axis */

void approach_init(void);

/* The discharge goes off, or the electrode touches, in a segment of this direction. It is kept until
   the next such, through alarms and paths. */
void approach_note(const int8_t way[HAL_AXES]);

/* A line away from the work: against that direction by an eighth of its length at least, so that what
   goes along a wall is watched; or straight up the jump axis, as a jump goes. */
bool approach_leads_away(const path_move *line);
