// SPDX-License-Identifier: Apache-2.0
/* Fixed point with 62 bits behind the point: factors from -1 to 1, and angles in turns.

   A length may stand for a factor: its product with one is a length in the same unit. Products and
   ratios are exact but for what is cut off; sine and cosine are good to 2**-48, angles to 2**-56
   turn. No 64-bit division: it costs about a thousand clocks. */
#pragma once
#include <stdint.h>

#define FIXED_ONE ((int64_t)1 << 62)
#define FIXED_TURN ((int64_t)1 << 62)
#define FIXED_PI 3622009729038561421        /* 2**-60 */
#define FIXED_PER_RADIAN 733972625820500307 /* turns */

/* 2**123 / (divisor << shift): divides by a length that many are compared with. */
typedef struct {
    int64_t inverse;
    unsigned shift;
} fixed_divisor;

/* A shift to the left, of either sign; and one to the right, to the nearest, by at least one bit. */
static inline int64_t fixed_scaled(int64_t value, unsigned bits) {
    return value * ((int64_t)1 << bits);
}
static inline int64_t fixed_rounded(int64_t value, unsigned bits) {
    return (value + ((int64_t)1 << (bits - 1))) >> bits;
}

static inline int64_t fixed_magnitude(int64_t value) { return value < 0 ? -value : value; }

/* Product of two factors, towards zero. */
int64_t fixed_product(int64_t a, int64_t b);

/* numerator / denominator as a factor; 0 <= numerator <= denominator < 2**62 + 1. */
int64_t fixed_ratio(int64_t numerator, int64_t denominator);

/* Of a value above 0; and value / divisor as a factor, value at most the divisor. */
fixed_divisor fixed_divisor_of(int64_t value);
int64_t fixed_fraction(int64_t value, const fixed_divisor *d);

/* Of an angle from 0 to FIXED_TURN. */
void fixed_sine_cosine(int64_t angle, int64_t *sine, int64_t *cosine);

/* Angle of a place that is not the origin, 0 to below FIXED_TURN. */
int64_t fixed_angle_of(int32_t x, int32_t y);
