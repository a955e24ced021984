// SPDX-License-Identifier: Apache-2.0
/* Where a segment that leads down meets a height. */
#pragma once
#include <stdint.h>

#include "hal/hal.h"

/* Path pulses into `move` after which an axis, beginning `drop` pulses above a height, is no longer above
   it. The segment gets there. */
uint32_t crossing_of(const hal_segment *move, uint32_t drop, unsigned axis);
