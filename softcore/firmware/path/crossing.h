// SPDX-License-Identifier: Apache-2.0
/* Where a descending segment passes a height. */
#pragma once
#include <stdint.h>

#include "hal/hal.h"

/* Path pulses of `move` until an axis, which begins `drop` pulses above a height, is no longer
   above it. The segment must reach this height. */
uint32_t crossing_of(const hal_segment *move, uint32_t drop, unsigned axis);
