// SPDX-License-Identifier: Apache-2.0
/* Geometry in the plane of an arc, in whole numbers: vectors in 1/64 pulse, directions in 2**-30.

   No component reaches 2**31, and no length 2**31.5: products of two vectors fit 64 bits. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define VECTOR_UNIT 30   /* fraction bits of a direction */

typedef struct {
    int32_t u, v;       /* along the first and the second axis of the plane */
} vector;

static inline vector vector_sum(vector a, vector b) { return (vector){a.u + b.u, a.v + b.v}; }
static inline vector vector_difference(vector a, vector b) {
    return (vector){a.u - b.u, a.v - b.v};
}
static inline vector vector_left(vector a) { return (vector){-a.v, a.u}; } /* turned by 90 degrees */
static inline vector vector_times(vector a, int32_t k) { return (vector){a.u * k, a.v * k}; }
int64_t vector_dot(vector a, vector b);
int64_t vector_cross(vector a, vector b);       /* positive if b is to the left of a */
uint32_t vector_length(vector a);               /* nearest */
vector vector_unit(vector a);                   /* direction of a vector that is not zero */
vector vector_along(vector unit, int32_t length);   /* rounded */
int32_t vector_part(vector a, vector unit);     /* component of `a` along a direction, rounded */

/* Is direction `a` on the turn from direction `from` to direction `to`? Both ends count as on it.
   If they are equal, the turn is a full one. */
bool vector_within(vector from, vector to, bool ccw, vector a);
