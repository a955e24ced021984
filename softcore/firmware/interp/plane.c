// SPDX-License-Identifier: Apache-2.0
#include "interp/plane.h"

#include "base/units.h"

const plane_axes PLANE_AXES[3] = {[PLANE_XY] = {0, 1, 2}, [PLANE_ZX] = {2, 0, 1},
                                  [PLANE_YZ] = {1, 2, 0}};

int64_t vector_dot(vector a, vector b) { return (int64_t)a.u * b.u + (int64_t)a.v * b.v; }
int64_t vector_cross(vector a, vector b) { return vector_dot((vector){-a.v, a.u}, b); }

uint32_t vector_length(vector a) { return units_root((uint64_t)vector_dot(a, a)); }

static uint32_t magnitude(int32_t value) {
    return value < 0 ? 0u - (uint32_t)value : (uint32_t)value;
}

static int32_t part(int32_t value, uint32_t length) {
    int32_t rounded = (int32_t)((((uint64_t)magnitude(value) << PLANE_UNIT) + length / 2) / length);
    return value < 0 ? -rounded : rounded;
}

vector vector_unit(vector a) {
    /* With 30 leading bits the length is exact to the last bit of a direction. */
    while ((magnitude(a.u) | magnitude(a.v)) < 1u << 29)
        a = vector_times(a, 2);
    uint32_t length = vector_length(a);
    return (vector){part(a.u, length), part(a.v, length)};
}

static int32_t reduced(int64_t product) {
    return (int32_t)((product + (1 << (PLANE_UNIT - 1))) >> PLANE_UNIT);
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
    /* More than half a turn: not inside what is left of it. */
    return turn == 0 || !(vector_cross(to, a) > 0 && vector_cross(a, from) > 0);
}

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
    vector reach = {radius, 0}; /* the furthest points of the circle, one after the other */
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
