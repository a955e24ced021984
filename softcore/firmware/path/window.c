// SPDX-License-Identifier: Apache-2.0
#include "path/window.h"

path_segment window_segments[HAL_SLOTS];
uint32_t window_low, window_high;
int32_t window_bounds[BOUNDS];

void window_bound(hal_bound bound, int32_t value) {
    if (window_bounds[bound] != value) {
        window_bounds[bound] = value;
        hal_bound_write(bound, value);
    }
}
