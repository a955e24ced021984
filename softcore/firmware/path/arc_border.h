// SPDX-License-Identifier: Apache-2.0
/* Places near an arc, and the borders of its pieces. Only for arc.c.

   A place is given in pulses from the start of the arc, for each axis of the plane; the second axis
   has its sign turned for a clockwise arc, as in the type arc_border. The eighths of a turn are
   those of the tangent, whose angle counts like `bend`. */
#pragma once
#include "path/arc_type.h"

#define PULSE_BITS 22               /* a length is in 2**-22 pulse */
#define PULSE ((int64_t)1 << PULSE_BITS)
#define FINE_BITS 16
#define NO_BORDER UINT32_MAX

/* Not inlined: here memory is scarcer than time. */
#define SHARED __attribute__((noinline))

int64_t arc_border_square_of(int32_t x, int32_t y);

/* Coordinate of a place on axis `i` from the centre, fine pulses. */
int32_t arc_border_fine_at(const arc *a, unsigned i, int32_t pulses);

/* Path length in the plane after `angle` of the sweep, with the radius there. */
int64_t arc_border_length_to(const arc *a, int64_t angle, int64_t radius);

/* Angle by which the tangent turns in a piece. */
int64_t arc_border_part_angle(const arc *a);

/* The major axis of the plane in an eighth of the turn, and the direction in which an axis
   travels. */
unsigned arc_border_major_of(unsigned eighth);
int32_t arc_border_travel_of(unsigned eighth, unsigned axis);

/* Error of a place: the square of its radius less that of the curve, in units of MOVE_FINE. */
int64_t arc_border_error_at(const arc *a, const int32_t at[2], int64_t square);

/* Is a place the nearest one to the curve on `axis` (0), or its neighbour outwards (1) or inwards
   (-1)? If the curve passes half-way between two, the inner one counts as nearer. */
int arc_border_neighbour(const arc *a, const int32_t at[2], unsigned axis, int64_t square);

/* Calculate border number `index`: 0 is the start, the number of pieces is the end. It takes three
   or more calls of some thousand clocks each: true when `b` is complete. */
bool arc_border_step(arc *a, uint32_t index, arc_border *b);
