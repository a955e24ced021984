// SPDX-License-Identifier: Apache-2.0
/* The window of segments around the machine, for the parts of the path only. */
#pragma once
#include "path/coordinate.h"
#include "path/history.h"

extern path_segment window[HAL_SLOTS];  /* holds the segments [window_low, window_high) */
extern uint32_t window_low, window_high;

static inline path_segment *in_window(uint32_t number) { return &window[number % HAL_SLOTS]; }

static inline int32_t end_of(uint32_t number) {
    return moved(in_window(number)->start, in_window(number)->length);
}

/* Write a bound, if it has changed. */
void window_bound(hal_bound bound, int32_t value);
