// SPDX-License-Identifier: Apache-2.0
/* What the parts of an arc share: places about it, and the borders of its pieces. For arc.c.

   A place is given in pulses from the start of the arc, by axis of the plane, the second one turned
   as in the type arc_border; the eighths of a turn are those of the tangent, counted as its angle
   `bend`. */
#pragma once
#include "path/arc_type.h"

#define PULSE_BITS 22               /* of a length */
#define PULSE ((int64_t)1 << PULSE_BITS)
#define FINE_BITS 16
#define NO_BORDER UINT32_MAX

/* One copy of what is used in many places: memory is dearer than time here. */
#define SHARED __attribute__((noinline))

int64_t arc_border_square_of(int32_t x, int32_t y);

/* Coordinate of a place on axis `i` from the centre, fine pulses. */
int32_t arc_border_fine_at(const arc *a, unsigned i, int32_t pulses);

/* Path length in the plane after `angle` of the sweep, with the radius there. */
int64_t arc_border_length_to(const arc *a, int64_t angle, int64_t radius);

/* By how much the tangent turns in a piece. */
int64_t arc_border_part_angle(const arc *a);

/* The axis of the plane that is the major one in an eighth of the turn, and how the axes travel. */
unsigned arc_border_major_of(unsigned eighth);
int32_t arc_border_travel_of(unsigned eighth, unsigned axis);

/* Error of a place: the square of its radius less that of the curve, in units of MOVE_FINE. */
int64_t arc_border_error_at(const arc *a, const int32_t at[2], int64_t square);

/* Is the place the nearer one, or is its neighbour outwards (1) or inwards (-1) on `axis`? Where the
   curve goes through the middle the inner one is. */
int arc_border_neighbour(const arc *a, const int32_t at[2], unsigned axis, int64_t square);

/* Border number `index`, from 0, the start, to the number of pieces, the end, in three steps of some
   thousand clocks, or more: true if it is there. */
bool arc_border_step(arc *a, uint32_t index, arc_border *b);
