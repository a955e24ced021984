// SPDX-License-Identifier: Apache-2.0
#include "path/crossing.h"

#include "base/move.h"

/* Has the major axis of a piece made `steps` after `count` pulses? */
static bool major_made(const hal_segment *s, uint32_t steps, uint32_t count) {
    uint64_t whole = (uint64_t)s->length << s->shift;
    int64_t paced = (int64_t)((uint64_t)count * s->start.pace);
    if (count)
        paced += (int64_t)s->change * ((int64_t)count * (count - 1) / 2);
    return 2 * paced >= (int64_t)((2 * (uint64_t)steps - 1) * whole);
}

/* Has the minor axis made `steps` when the major one has made `count`? Sums up the error of the
   gateware's recurrence. */
static bool minor_made(const hal_segment *s, uint32_t steps, uint32_t count) {
    int64_t n = count, m = (int64_t)steps - 1;
    int64_t across = s->start.across + 2 * MOVE_FINE * m;
    int64_t error = s->start.error + n * (s->start.along + MOVE_FINE * n) +
                    m * ((int64_t)s->start.across + MOVE_FINE * m);
    int64_t middle = error + across / 2 + MOVE_FINE / 4;
    return s->outward ? middle < 0 : middle >= 0;
}

/* The least count up to `most` for which a step has been made. */
static uint32_t least(const hal_segment *s, uint32_t steps, uint32_t most,
                      bool (*made)(const hal_segment *, uint32_t, uint32_t)) {
    uint32_t below = 0;
    while (most - below > 1) {
        uint32_t middle = below + (most - below) / 2;
        if (made(s, steps, middle))
            most = middle;
        else
            below = middle;
    }
    return most;
}

/* For a line: the least k with floor((2 k m + n) / 2n) >= drop. */
__attribute__((noinline)) uint32_t crossing_of(const hal_segment *move, uint32_t drop, unsigned axis) {
    if (move->arc && (axis == move->major || axis == move->minor)) {
        int32_t travel = move->delta[move->major];
        uint32_t steps = travel < 0 ? 0u - (uint32_t)travel : (uint32_t)travel;
        if (axis == move->minor)
            drop = least(move, drop, steps, minor_made);
        return least(move, drop, move->length, major_made);
    }
    uint32_t magnitude = 0u - (uint32_t)move->delta[axis];
    uint64_t numerator = (uint64_t)move->length * (2 * drop - 1);
    uint64_t divisor = 2 * (uint64_t)magnitude;
    return (uint32_t)((numerator + divisor - 1) / divisor);
}
