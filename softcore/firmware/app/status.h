// SPDX-License-Identifier: Apache-2.0
/* The status report. States and fields are those of grbl 1.1 in its order; our own fields
   follow. */
#pragma once
#include <stdbool.h>

#define STATUS_BYTES 255    /* bytes that the receive queue holds beside a mark */

void status_init(void);

bool status_idle(void);     /* nothing runs, is held or locked, and the axes rest at the front */

void status_want(void);     /* ask for a report */
bool status_wanted(void);   /* a report was asked for and is not yet complete */
void status_tell(void);     /* build its next part; a whole report is too long for one pass */

/* `$G`: modal words in grbl's order. G80 means that no G00 to G03 is active. Feed in mm/min. */
void status_tell_modes(void);
