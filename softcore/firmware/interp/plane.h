// SPDX-License-Identifier: Apache-2.0
/* Moves in the plane of G17, G18 or G19. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/move.h"
#include "base/travel.h"
#include "interp/vector.h"

/* First and second axis of a plane, and the axis at right angles to it. */
typedef struct {
    uint8_t first, second, third;
} plane_axes;

extern const plane_axes PLANE_AXES[3];

vector plane_delta(const path_move *move);      /* of a move, in its plane: pulses */
vector plane_centre(const path_move *move);     /* of an arc, from its start */
bool plane_moves(const path_move *move);        /* is there any motion in the plane? */

/* The first axis on which a move from `start` leaves the travel, or HAL_AXES. */
unsigned plane_beyond(const int32_t start[HAL_AXES], const path_move *move,
                      const travel_range *t);
