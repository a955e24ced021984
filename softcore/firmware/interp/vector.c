// SPDX-License-Identifier: Apache-2.0
#include "interp/vector.h"

#include "base/units.h"

int64_t vector_dot(vector a, vector b) { return (int64_t)a.u * b.u + (int64_t)a.v * b.v; }
__attribute__((noinline)) int64_t vector_cross(vector a, vector b) {
    return vector_dot((vector){-a.v, a.u}, b);
}

uint32_t vector_length(vector a) { return units_root((uint64_t)vector_dot(a, a)); }

static uint32_t magnitude(int32_t value) {
    return value < 0 ? 0u - (uint32_t)value : (uint32_t)value;
}

static int32_t part(int32_t value, uint32_t length) {
    int32_t rounded = (int32_t)((((uint64_t)magnitude(value) << VECTOR_UNIT) + length / 2) / length);
    return value < 0 ? -rounded : rounded;
}

vector vector_unit(vector a) {
    /* Scaled to 30 bits, so that the length is exact to the last bit of a direction. */
    while ((magnitude(a.u) | magnitude(a.v)) < 1u << 29)
        a = vector_times(a, 2);
    uint32_t length = vector_length(a);
    return (vector){part(a.u, length), part(a.v, length)};
}

static int32_t reduced(int64_t product) {
    return (int32_t)((product + (1 << (VECTOR_UNIT - 1))) >> VECTOR_UNIT);
}

vector vector_along(vector unit, int32_t length) {
    return (vector){reduced((int64_t)unit.u * length), reduced((int64_t)unit.v * length)};
}

int32_t vector_part(vector a, vector unit) { return reduced(vector_dot(a, unit)); }

bool vector_within(vector from, vector to, bool ccw, vector a) {
    if (!ccw) {
        vector swap = from;
        from = to;
        to = swap;
    }
    int64_t turn = vector_cross(from, to);
    if (turn > 0 || (turn == 0 && vector_dot(from, to) < 0))
        return vector_cross(from, a) >= 0 && vector_cross(a, to) >= 0;
    /* The way is more than half a turn: `a` is on it if it is not on the other, shorter way. */
    return turn == 0 || !(vector_cross(to, a) > 0 && vector_cross(a, from) > 0);
}
