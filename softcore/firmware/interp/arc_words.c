// SPDX-License-Identifier: Apache-2.0
#include "interp/arc_words.h"

#include "base/settings.h"
#include "base/units.h"
#include "interp/plane.h"

static const char AXIS[HAL_AXES] = {'X', 'Y', 'Z'}, CENTRE[HAL_AXES] = {'I', 'J', 'K'};

static bool too_small(fault *f, uint32_t column) {
    return fault_at(f, FAULT_ARC, column, "the radius of the arc is below one pulse");
}

static bool too_large(fault *f, uint32_t column) {
    return fault_at(f, FAULT_ARC, column, "the radius of the arc is above %p mm",
                    units_radius_limit());
}

/* Largest difference between start and end radius, 1/64 pulse. Inches have four decimals and
   millimetres three, so the last decimal of an inch is 2.54 times as large. */
static int32_t tolerance(const plan *p) {
    uint32_t nm = settings_get(SET_ARC_DIFFERENCE_NM);
    return (int32_t)units_fine_of_nm(p->after.inch ? nm * 254 / 100 : nm);
}

bool arc_words_take(context *c) {
    plan *p = c->p;
    move_plane plane = p->after.plane;
    plane_axes axes = PLANE_AXES[plane];
    const word *radius = words_take(c, 'R');
    uint16_t end = 0;
    for (unsigned axis = HAL_AXES; axis--;)
        end = p->columns[axis] ? p->columns[axis] : end;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        const word *w = words_take(c, CENTRE[axis]);
        if (!w)
            continue;
        if (axis == axes.third)
            return fault_at(c->f, FAULT_PLACE, w->column, "%c has no meaning in the plane G%u",
                            CENTRE[axis], 17 + (uint32_t)plane);
        if (radius)
            return fault_at(c->f, FAULT_CONFLICT, radius->column,
                            "an arc has a centre (I, J, K) or a radius R, not both");
        int32_t *centre = &p->move.centre[axis == axes.second];
        if (!units_fine(w->number, p->after.inch, centre))
            return too_large(c->f, w->column);
        if (w->negative)
            *centre = -*centre;
        p->arc = ARC_CENTRE;
        p->arc_column = p->arc_column ? p->arc_column : w->column;
    }
    if (radius) {
        if (!units_fine(radius->number, p->after.inch, &p->radius))
            return too_large(c->f, radius->column);
        if (radius->negative)
            p->radius = -p->radius;
        p->arc = ARC_RADIUS;
        p->arc_column = radius->column;
    }
    if (p->arc == ARC_NONE)
        return !end || fault_at(c->f, FAULT_MISSING, end,
                                "an arc needs its centre (I, J, K) or its radius R");
    p->moves = p->move.arc = true;
    p->move.ccw = p->after.mode == MODE_CCW;
    return true;
}

/* Is the end further away than the diameter of the largest arc? */
static bool out_of_reach(vector chord) {
    int32_t reach = 2 * units_radius_limit();
    return chord.u > reach || chord.u < -reach || chord.v > reach || chord.v < -reach;
}

/* Find the centre from the radius R. It is left of the chord for the shorter way
   counter-clockwise. */
static bool find_centre(plan *p, fault *f) {
    vector chord = plane_delta(&p->move);
    bool longer = p->radius < 0;
    int32_t radius = longer ? -p->radius : p->radius;
    if (radius < MOVE_FINE)
        return too_small(f, p->arc_column);
    if (!chord.u && !chord.v)
        return fault_at(f, FAULT_ARC, p->arc_column,
                        "an arc of a radius R needs an end point other than its start");
    bool far = out_of_reach(chord);
    vector centre = vector_times(chord, far ? 1 : MOVE_FINE / 2);
    uint32_t half = far ? UINT32_MAX / 2 : vector_length(centre);
    if (half > (uint32_t)(radius + tolerance(p) / 2))
        return fault_at(f, FAULT_ARC, p->arc_column,
                        "the chord of %p mm is longer than the arc's diameter of %p mm",
                        (int32_t)vector_length(chord), radius / (MOVE_FINE / 2));
    int64_t square = (int64_t)radius * radius - vector_dot(centre, centre);
    if (square > 0) {
        int32_t away = (int32_t)units_root((uint64_t)square);
        vector left = vector_left(vector_unit(chord));
        centre = vector_sum(centre, vector_along(left, p->move.ccw == longer ? -away : away));
    }
    p->move.centre[0] = centre.u;
    p->move.centre[1] = centre.v;
    return true;
}

/* How much the radius at the end, pulses, differs from the one at the start: 1/64 pulse. It may be a
   sixteenth of the chord, or, from half a turn on, of the diameter; UINT32_MAX if it is more. */
static uint32_t difference_of(const path_move *move, uint32_t *end) {
    vector centre = plane_centre(move), chord = plane_delta(move);
    uint32_t start = vector_length(centre);
    if (out_of_reach(chord)) {
        vector centre_pulses = {centre.u / MOVE_FINE, centre.v / MOVE_FINE};
        *end = vector_length(vector_difference(chord, centre_pulses));
        return UINT32_MAX;
    }
    vector fine = vector_times(chord, MOVE_FINE), to = vector_difference(fine, centre);
    int64_t turn = vector_cross(to, centre); /* from the radius of the start to that of the end */
    bool less = turn && (turn > 0) == move->ccw;
    uint32_t length = less ? vector_length(fine) : 2 * start, last = vector_length(to);
    uint32_t difference = start < last ? last - start : start - last;
    *end = (last + MOVE_FINE / 2) / MOVE_FINE;
    return difference > length / 16 ? UINT32_MAX : difference;
}

bool arc_words_round(const path_move *move) {
    uint32_t end;
    return difference_of(move, &end) != UINT32_MAX;
}

/* Check that the centre is as far from the end as from the start, apart from rounding. */
static bool check_centre(plan *p, fault *f) {
    uint32_t start = vector_length(plane_centre(&p->move)), end;
    if (start < MOVE_FINE)
        return too_small(f, p->arc_column);
    if (start > (uint32_t)units_radius_limit() * MOVE_FINE)
        return too_large(f, p->arc_column);
    if (difference_of(&p->move, &end) > (uint32_t)tolerance(p))
        return fault_at(f, FAULT_ARC, p->arc_column,
                        "the radii of the arc differ: %p mm at its start, %p mm at its end",
                        (int32_t)((start + MOVE_FINE / 2) / MOVE_FINE), (int32_t)end);
    return true;
}

static bool check_travel(plan *p, const travel_range *t, fault *f) {
    int32_t start[HAL_AXES];
    if (t->onto_low | t->onto_high)
        return fault_at(f, FAULT_TRAVEL, p->arc_column, "only a line leads off a limit switch");
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        start[axis] = p->after.position[axis] - p->move.delta[axis];
    unsigned axis = plane_beyond(start, &p->move, t);
    return axis == HAL_AXES ||
           fault_at(f, FAULT_TRAVEL, p->arc_column, "the arc goes beyond the travel of %c", AXIS[axis]);
}

plan_result arc_words_step(plan *p, const travel_range *t, fault *f) {
    bool right = true;
    switch (p->arc) {
    case ARC_NONE: return PLAN_DONE;
    case ARC_RADIUS:
        right = find_centre(p, f);
        p->arc = ARC_TRAVEL;
        break;
    case ARC_CENTRE:
        right = check_centre(p, f);
        p->arc = ARC_TRAVEL;
        break;
    case ARC_TRAVEL:
        right = check_travel(p, t, f);
        p->arc = ARC_NONE;
        break;
    }
    return !right ? PLAN_FAULT : p->arc == ARC_NONE ? PLAN_DONE : PLAN_MORE;
}
