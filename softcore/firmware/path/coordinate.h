// SPDX-License-Identifier: Apache-2.0
/* Coordinates along the path, in path pulses from its first point. They wrap around at 2**32. */
#pragma once
#include <stdint.h>

static inline int32_t moved(int32_t coordinate, uint32_t length) {
    return (int32_t)((uint32_t)coordinate + length);
}
static inline int32_t moved_back(int32_t coordinate, uint32_t length) {
    return (int32_t)((uint32_t)coordinate - length);
}
/* How far `a` lies beyond `b`. Compare coordinates only by this. */
static inline int32_t difference(int32_t a, int32_t b) {
    return (int32_t)((uint32_t)a - (uint32_t)b);
}
