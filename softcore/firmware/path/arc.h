// SPDX-License-Identifier: Apache-2.0
/* An arc of the path, cut into pieces that the gateware distributes.

   The radius changes linearly with the angle from its value at the start to that at the end; the
   two differ by the error of the programmed centre. On a piece no axis reverses, and one axis of
   the plane, the major one, never steps less often than the other. For each place of the major
   axis, the minor one takes the nearer of two neighbours. So every place on a circle is at most
   half a pulse from it. If the two radii differ, the gateware lets the square of the radius change
   linearly with the major axis, while the radius itself should change linearly with the angle. The
   error is then at most half a pulse plus k**2 pulses, with

   k = growth * angle * (angle / 6 + slope / 2) + angle / 256

   where growth is the radius' growth per radian (pulses), slope its growth along the path, and
   angle that of the piece. The first term comes from the major axis not being linear in the angle
   and from the square not being linear in the radius, the second from rounding the square to whole
   units in each step. Spirals are cut so finely that k**2 is below 0.0005 for the strongest one
   that the interpreter accepts. In a chain of single steps, below ARC_LEAST_RADIUS, it is 0.001 if
   only the rounding of the end point makes the radii differ, and 0.005 for the strongest spiral.
   The third axis of a helix is at most half a pulse off at the ends of a piece, and a pulse in
   between.

   The path length of a border between pieces is rounded to a whole pulse. Of a few places nearby,
   the border takes one whose path length is nearly a whole number. So the speed over 100 path
   pulses is exact to 1 %; of 3000 arcs with radii from 64 to 256 pulses, one was off by 1.05 %.
   Where an axis reverses there is no choice: there, and at the end, a border's length is off by up
   to half a pulse.

   Pieces end where an axis reverses, where the two axes exchange their roles and, in between, at
   nearly equal angles. A piece depends only on its number: pieces may be asked for in any order and
   are always the same.

   Angles and factors have the units of fixed.h. Lengths are in 2**-16 of a fine pulse, that is
   2**-22 pulse. At a radius of 1 m the end of a piece is exact to 1/1000 pulse. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"
#include "path/arc_type.h"

/* Begin an arc of a radius from 1 pulse to 2**30 / 64 pulses; its two radii may differ as far as
   the interpreter allows. Then call arc_prepare, which takes some thousand clocks, until it returns
   true. */
void arc_begin(arc *a, const path_move *move);
bool arc_prepare(arc *a);

uint32_t arc_pieces(const arc *a);
uint32_t arc_length(const arc *a);      /* path pulses */
uint32_t arc_radius(const arc *a);      /* smaller one, pulses */

/* Calculate an end of piece `index`, which takes some thousand clocks; true if both ends are known.
   One end is always known if pieces are asked for one after the other, in either direction. */
bool arc_piece_ready(arc *a, uint32_t index);

/* Make piece `index`: the whole segment except its rate. Returns the path pulses before it. */
uint32_t arc_piece(arc *a, uint32_t index, hal_segment *piece);

/* Tangent at the start or the end, 2**-15. */
void arc_direction(const arc *a, bool end, int32_t direction[HAL_AXES]);
