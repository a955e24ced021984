// SPDX-License-Identifier: Apache-2.0
/* One move of the programmed path: a line, or an arc in one of the three planes. The third axis may
   move in proportion to the arc (helix). */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

#define MOVE_FINE 64    /* parts of a pulse in which the centre of an arc is given */

/* Planes (G17 G18 G19) and their first and second axis: X Y, Z X, Y Z. From the first to the second axis is
   counter-clockwise. */
typedef enum { PLANE_XY, PLANE_ZX, PLANE_YZ } move_plane;

typedef struct {
    int32_t delta[HAL_AXES];    /* pulses */
    bool arc, ccw;
    move_plane plane;
    int32_t centre[2];          /* from the start of the arc, 1/64 pulse, by axis of the plane */
} path_move;
