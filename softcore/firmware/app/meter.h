// SPDX-License-Identifier: Apache-2.0
/* Measures for the status report whether the machine moves, and how fast. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

void meter_init(void);
void meter_step(void);          /* call in every round of the main loop */
void meter_path_begins(void);   /* call when the path coordinate begins again at 0 */

/* Ramp and axes have been at their commanded place for a while. */
bool meter_rests(void);

/* Speed along the path in either direction, um/min: a mean over a quarter to half a second. */
uint32_t meter_feed(void);
