// SPDX-License-Identifier: Apache-2.0
/* The status report, in the manner of grbl 1.1: its states, its fields in its order, then our own. */
#pragma once
#include <stdbool.h>

#define STATUS_BYTES 255    /* that the receive queue holds beside a mark: a sender may count them ahead */

void status_init(void);

/* Ask for a report; is one asked for; say the next part of it, as all at once would take too long for
   one pass of the main loop. */
void status_want(void);
bool status_wanted(void);
void status_tell(void);
