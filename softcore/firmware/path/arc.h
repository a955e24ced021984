// SPDX-License-Identifier: Apache-2.0
/* An arc of the path, cut into pieces that the gateware distributes.

   The radius runs evenly with the angle from its value at the start to that at the end, which differ
   by what the programmed centre is off. On a piece no axis turns round, and one axis of the plane,
   the major one, never steps less often than the other; the minor one takes the nearer of two
   neighbours for each place of the major one. So every place of a circle is at most half a pulse
   from it. If the two radii differ the square of the radius runs evenly with the major axis where
   the radius itself should with the angle: half a pulse and k**2 pulses, with

       k = growth * angle * (angle / 6 + slope / 2) + angle / 256

   of the radius' growth per radian (pulses) and along the path (slope), the angle of the piece, and
   the whole units in which the square runs. The first part is that of the major axis against the
   angle, the second that of the square against the radius. Spirals are cut so finely that k**2 is
   below 0.0005 in the strongest that the interpreter lets pass. In a chain, below ARC_LEAST_RADIUS,
   it is 0.001 where only the end point's rounding makes the radii differ, 0.005 in the strongest. The
   third axis of a helix is at most half a pulse off at the ends of a piece, and a pulse in between.

   A border's path length is rounded to a whole pulse; of a few places next to it one is taken for
   which it nearly is one. So the speed over 100 path pulses is true to 1 %; of 3000 arcs of radii from
   64 to 256 pulses one was off by 1.05 %. Where an axis turns there is no choice: there, and at the
   end, a border's length is off by up to half a pulse.

   Pieces end where the axes turn or change their roles and, in between, at nearly equal angles. A
   piece is a function of its number: it may be asked for in any order and is always the same.

   Angles and factors are those of fixed.h, lengths 2**-16 of a fine pulse, that is 2**-22 pulse. At a
   radius of 1 m an end of a piece is better than 1/1000 pulse. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"
#include "path/arc_type.h"

/* Get ready for an arc: a radius of 1 pulse to 2**30 / 64 pulses, the two radii as different as
   the interpreter allows. Then call arc_prepare, each time some thousand clocks, until it returns true. */
void arc_begin(arc *a, const path_move *move);
bool arc_prepare(arc *a);

uint32_t arc_pieces(const arc *a);
uint32_t arc_length(const arc *a);      /* path pulses */
uint32_t arc_radius(const arc *a);      /* smaller one, pulses */

/* Work out an end of piece `index`, some thousand clocks; true if both are known. Piece by piece in
   either direction one end always is. */
bool arc_piece_ready(arc *a, uint32_t index);

/* Piece `index`: all of the segment but its rate. Returns the path pulses before it. */
uint32_t arc_piece(arc *a, uint32_t index, hal_segment *piece);

/* Tangent at the start or the end, 2**-15. */
void arc_direction(const arc *a, bool end, int32_t direction[HAL_AXES]);
