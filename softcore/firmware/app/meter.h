// SPDX-License-Identifier: Apache-2.0
/* Does the machine move, and how fast: for the status report. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

void meter_init(void);
void meter_step(void);          /* in every round of the main loop */
void meter_path_begins(void);   /* the path coordinate begins anew */

/* Ramp and axes are where they were told to be, and have been for a while. */
bool meter_rests(void);

/* Speed along the path, either way, as a mean over a quarter to half a second: um/min. */
uint32_t meter_feed(void);
