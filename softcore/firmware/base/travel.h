// SPDX-License-Identifier: Apache-2.0
/* The travel of each axis, in pulses of the machine frame. The gateware guards the same limits
   itself: a mistake here would only make it trip. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

typedef struct {
    int32_t low[HAL_AXES], high[HAL_AXES];
    /* Axes that are leaving a limit switch, bit 0 X. They may not move further onto it. */
    uint8_t onto_low, onto_high;
} travel_range;

extern const travel_range TRAVEL_ALL;     /* without the limits of a machine */

/* Is an axis forbidden to move between two places? From outside its limits it may come back. */
bool travel_refuses(const travel_range *t, unsigned axis, int32_t from, int32_t to);

/* Does a limit switch forbid this direction? */
bool travel_onto(const travel_range *t, unsigned axis, bool up);
