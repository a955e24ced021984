// SPDX-License-Identifier: Apache-2.0
/* How far each axis may go, in pulses of the machine frame. The gateware keeps the same limits by
   itself: what passed here and should not have only trips it. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

typedef struct {
    int32_t low[HAL_AXES], high[HAL_AXES];
    /* Axes on a limit switch that is just being left, bit 0 X: no way further onto it. */
    uint8_t onto_low, onto_high;
} travel_range;

extern const travel_range TRAVEL_ALL;     /* without the limits of a machine */

/* May an axis not go from one place to another? From outside its limits it may come back. */
bool travel_refuses(const travel_range *t, unsigned axis, int32_t from, int32_t to);

/* Is it for the limit switch on that way? */
bool travel_onto(const travel_range *t, unsigned axis, bool up);
