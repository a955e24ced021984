// SPDX-License-Identifier: Apache-2.0
/* Fixed-point numbers with 62 fraction bits: factors from -1 to 1, and angles in turns.

   The product of a length and a factor is a length in the same unit. Products and ratios are exact
   except for the bits that are cut off. Sine and cosine are exact to 2**-48, angles to 2**-56 turn.
   There is no 64-bit division, which would take about a thousand clocks. */
#pragma once
#include <stdint.h>

#define FIXED_ONE ((int64_t)1 << 62)
#define FIXED_TURN ((int64_t)1 << 62)
#define FIXED_PI 3622009729038561421        /* 2**-60 */
#define FIXED_PER_RADIAN 733972625820500307 /* turns */

/* The inverse of a divisor that is used many times: 2**123 / (divisor << shift). */
typedef struct {
    int64_t inverse;
    unsigned shift;
} fixed_divisor;

/* Shift left, of either sign; shift right by at least one bit, rounded to the nearest. */
static inline int64_t fixed_scaled(int64_t value, unsigned bits) {
    return value * ((int64_t)1 << bits);
}
static inline int64_t fixed_rounded(int64_t value, unsigned bits) {
    return (value + ((int64_t)1 << (bits - 1))) >> bits;
}

static inline int64_t fixed_magnitude(int64_t value) { return value < 0 ? -value : value; }

/* Product of two factors, rounded towards zero. */
int64_t fixed_product(int64_t a, int64_t b);

/* numerator / denominator as a factor; 0 <= numerator <= denominator < 2**62 + 1. */
int64_t fixed_ratio(int64_t numerator, int64_t denominator);

/* Make a divisor from a value above 0; and value / divisor as a factor, with value <= divisor. */
fixed_divisor fixed_divisor_of(int64_t value);
int64_t fixed_fraction(int64_t value, const fixed_divisor *d);

/* Sine and cosine of an angle from 0 to FIXED_TURN. */
void fixed_sine_cosine(int64_t angle, int64_t *sine, int64_t *cosine);

/* Angle of a point other than the origin, from 0 to below FIXED_TURN. */
int64_t fixed_angle_of(int32_t x, int32_t y);
