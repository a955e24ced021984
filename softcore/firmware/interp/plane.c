// SPDX-License-Identifier: Apache-2.0
#include "interp/plane.h"

const plane_axes PLANE_AXES[3] = {[PLANE_XY] = {0, 1, 2}, [PLANE_ZX] = {2, 0, 1},
                                  [PLANE_YZ] = {1, 2, 0}};

vector plane_delta(const path_move *move) {
    plane_axes axes = PLANE_AXES[move->plane];
    return (vector){move->delta[axes.first], move->delta[axes.second]};
}

vector plane_centre(const path_move *move) {
    return (vector){move->centre[0], move->centre[1]};
}

bool plane_moves(const path_move *move) {
    plane_axes axes = PLANE_AXES[move->plane];
    return move->arc || move->delta[axes.first] || move->delta[axes.second];
}

unsigned plane_beyond(const int32_t start[HAL_AXES], const path_move *move,
                      const travel_range *t) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        if (travel_refuses(t, axis, start[axis], start[axis] + move->delta[axis]))
            return axis;
    if (!move->arc)
        return HAL_AXES;
    plane_axes axes = PLANE_AXES[move->plane];
    vector centre = plane_centre(move), from = vector_times(centre, -1);
    vector to = vector_difference(vector_times(plane_delta(move), MOVE_FINE), centre);
    int32_t radius = (int32_t)vector_length(from);
    vector reach = {radius, 0}; /* one after the other the four extreme points of the circle */
    for (unsigned k = 0; k < 4; k++, reach = vector_left(reach)) {
        if (!vector_within(from, to, move->ccw, reach))
            continue;
        unsigned axis = k & 1 ? axes.second : axes.first;
        int32_t away = k & 1 ? centre.v + reach.v : centre.u + reach.u;
        away = (away + (away < 0 ? -1 : 1) * (MOVE_FINE / 2)) / MOVE_FINE;
        if (travel_refuses(t, axis, start[axis], start[axis] + away))
            return axis;
    }
    return HAL_AXES;
}
