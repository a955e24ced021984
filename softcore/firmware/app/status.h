// SPDX-License-Identifier: Apache-2.0
/* The status report, in the manner of grbl 1.1: its states, its fields in its order, then our own. */
#pragma once
#include <stdbool.h>

#define STATUS_BYTES 255    /* that the receive queue holds beside a mark: a sender may count them ahead */

void status_init(void);

/* A report is wanted; and the next part of it, as all at once would take too long for one pass of the
   main loop. False if none is wanted. */
void status_want(void);
bool status_tell(void);
