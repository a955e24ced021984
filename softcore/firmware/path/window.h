// SPDX-License-Identifier: Apache-2.0
/* The window of segments around the machine, for the parts of the path only. */
#pragma once
#include "path/coordinate.h"
#include "path/history.h"

extern path_segment window_segments[HAL_SLOTS];    /* [window_low, window_high), by number */
extern uint32_t window_low, window_high;
extern int32_t window_bounds[BOUNDS];               /* as written */

static inline path_segment *window_segment(uint32_t number) {
    return &window_segments[number % HAL_SLOTS];
}

static inline int32_t window_end(uint32_t number) {
    return moved(window_segment(number)->start, window_segment(number)->length);
}

/* Write a bound, if it has changed. */
void window_bound(hal_bound bound, int32_t value);
