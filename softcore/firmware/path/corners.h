// SPDX-License-Identifier: Apache-2.0
/* Where the machine must be slow: at corners, and before a lower feed. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

/* Find what the junction between a segment of the window and the next one allows. */
void corners_join(uint32_t number);

/* The same, when only their rates have changed. */
void corners_join_rates(uint32_t number);

void corners_forget(void);      /* what was found does not hold any more */

/* Find where the machine must be slow next, in each direction, and how slow. `at` is its segment. */
void corners_update(uint32_t at);

/* Was that done for the segment in this slot, and is there nothing more to do in it? */
bool corners_known_in(unsigned slot);
