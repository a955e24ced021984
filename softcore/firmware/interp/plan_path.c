// SPDX-License-Identifier: Apache-2.0
/* Where a block leads: lines, arcs, the frame that they are in, and the side of the wire. */
#include "base/settings.h"
#include "base/units.h"
#include "gap/law.h"
#include "gap/series.h"
#include "interp/plan_words.h"
#include "interp/plane.h"

#include <stddef.h>

static const char AXIS[HAL_AXES] = {'X', 'Y', 'Z'}, CENTRE[HAL_AXES] = {'I', 'J', 'K'};

void plan_copy(modal *to, const modal *from) {
    __builtin_memcpy(to, from,
                     to->edition == from->edition ? offsetof(modal, edition) : sizeof *to);
}

void plan_edit(modal *state) {
    static uint32_t editions;
    state->edition = ++editions;
}

/* The work offset in force becomes another; what G92 has set stays on top. */
void select_system(modal *state, unsigned system) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        state->offset[axis] += state->systems[system][axis] - state->systems[state->system][axis];
    state->system = (uint8_t)system;
}

bool plan_set_position(context *c) {
    if (!(c->b->present & AXIS_LETTERS))
        return fault_at(c->f, FAULT_MISSING, 0, "G92 needs X, Y or Z");
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        const word *w = take(c, AXIS[axis]);
        int32_t pulses;
        if (!w)
            continue;
        if (!distance(c, w, AXIS[axis], &pulses))
            return false;
        c->p->after.offset[axis] = c->p->after.position[axis] - pulses;
    }
    return true;
}

/* G10 D R: a wire offset. */
bool enter_wire(context *c) {
    if (!alone(c, BLOCK_BIT('D') | BLOCK_BIT('R')))
        return false;
    modal *after = &c->p->after;
    const word *name = take(c, 'D'), *w = take(c, 'R');
    uint32_t number = block_name(c->b, 'D');
    int32_t pulses;
    if (number < 1 || number >= PLAN_WIRES)
        return fault_at(c->f, FAULT_TABLE, name->column, "a wire offset is D1 to D%u; D0 is nothing",
                        (uint32_t)PLAN_WIRES - 1);
    if (!w)
        return fault_at(c->f, FAULT_MISSING, 0, "G10 D needs the distance R");
    if (w->negative || !units_distance(w->number, after->inch, &pulses) ||
        pulses > units_radius_limit() / 10)
        return fault_at(c->f, FAULT_TABLE, w->column, "the wire offset R must be 0 to %p mm",
                        units_radius_limit() / 10);
    if (after->side && after->wire == number && after->wires[number] != pulses)
        return fault_at(c->f, FAULT_CONFLICT, name->column,
                        "the wire offset D%u is in force and cannot change before G40", number);
    after->wires[number] = pulses;
    after->wires_given |= (uint16_t)(1u << number);
    return true;
}

/* G10 P X Y Z: a work offset, in the machine frame. */
bool enter_system(context *c) {
    if (!alone(c, AXIS_LETTERS | BLOCK_BIT('P')))
        return false;
    modal *after = &c->p->after;
    uint32_t number = 1;
    if (!whole(c, 'P', 1, PLAN_SYSTEMS, "the work offset", &number))
        return false;
    if (!(c->b->present & AXIS_LETTERS))
        return fault_at(c->f, FAULT_MISSING, 0, "G10 P needs X, Y or Z");
    int32_t *origin = after->systems[number - 1];
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        const word *w = take(c, AXIS[axis]);
        int32_t pulses;
        if (!w)
            continue;
        if (!distance(c, w, AXIS[axis], &pulses))
            return false;
        if (number - 1 == after->system)
            after->offset[axis] += pulses - origin[axis];
        origin[axis] = pulses;
    }
    return true;
}

/* G40, G41, G42: the side of the path on which the wire goes from the next motion on. */
bool plan_wire(context *c, bool mdi) {
    modal *after = &c->p->after;
    if (c->g[G_WIRE] < 0)
        return true;
    after->side = (int8_t)(c->g[G_WIRE] == 410 ? 1 : c->g[G_WIRE] == 420 ? -1 : 0);
    if (!after->side)
        return true;
    if (mdi)
        return fault_at(c->f, FAULT_REFUSED, c->column[G_WIRE],
                        "the wire offset (G41, G42) is for tapes; by hand it is not in this version");
    const word *w = take(c, 'D');
    uint32_t number = w ? block_name(c->b, 'D') : after->wire;
    if (number == PLAN_NO_WIRE)
        return fault_at(c->f, FAULT_MISSING, c->column[G_WIRE], "G%u needs its wire offset D",
                        (uint32_t)c->g[G_WIRE] / 10);
    if (number >= PLAN_WIRES || (number && !(after->wires_given >> number & 1)))
        return fault_at(c->f, FAULT_TABLE, w ? w->column : c->column[G_WIRE],
                        "the wire offset D%u has not been entered (G10 D R)", number);
    after->wire = (uint8_t)number;
    if (c->before->side && (c->before->side != after->side || c->before->wire != number))
        return fault_at(c->f, FAULT_CONFLICT, c->column[G_WIRE],
                        "between two wire offsets there must be G40 with a motion");
    return true;
}

bool plan_plane(context *c) {
    if (c->g[G_PLANE] >= 0)
        c->p->after.plane = (move_plane)(c->g[G_PLANE] / 10 - 17);
    if (c->before->side && c->p->after.plane != c->before->plane)
        return fault_at(c->f, FAULT_CONFLICT, c->column[G_PLANE],
                        "the plane cannot change under a wire offset (G41, G42)");
    return true;
}

static bool too_small(fault *f, uint32_t column) {
    return fault_at(f, FAULT_ARC, column, "the radius of the arc is below one pulse");
}

static bool too_large(fault *f, uint32_t column) {
    return fault_at(f, FAULT_ARC, column, "the radius of the arc is above %p mm",
                    units_radius_limit());
}

/* What start and end radius may differ by, 1/64 pulse. */
static int32_t tolerance(void) {
    return (int32_t)units_fine_of_nm(settings_get(SET_ARC_DIFFERENCE_NM));
}

/* Words of an arc: what they say is judged by plan_arc_step. */
static bool plan_arc(context *c) {
    plan *p = c->p;
    move_plane plane = p->after.plane;
    plane_axes axes = PLANE_AXES[plane];
    const word *radius = take(c, 'R');
    uint16_t end = 0;
    for (unsigned axis = HAL_AXES; axis--;)
        end = p->columns[axis] ? p->columns[axis] : end;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        const word *w = take(c, CENTRE[axis]);
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

static bool refuse_way(context *c, const travel_range *t, unsigned axis, bool up) {
    uint32_t column = BLOCK_WORD(c->b, AXIS[axis])->column;
    if (travel_onto(t, axis, up))
        return fault_at(c->f, FAULT_TRAVEL, column, "%c leads further onto its %s limit switch",
                        AXIS[axis], up ? "upper" : "lower");
    return fault_at(c->f, FAULT_TRAVEL, column, "%c is beyond the travel", AXIS[axis]);
}

bool plan_move(context *c, uint32_t highest_speed, const travel_range *t) {
    modal *after = &c->p->after;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        const word *w = take(c, AXIS[axis]);
        int32_t pulses;
        if (!w)
            continue;
        if (after->mode == MODE_NONE)
            return fault_at(c->f, FAULT_MODE, w->column, "%c without G00, G01, G02 or G03",
                            AXIS[axis]);
        if (!distance(c, w, AXIS[axis], &pulses))
            return false;
        /* Four times 2**28 at most: no overflow. */
        int32_t target = pulses + (after->incremental ? after->position[axis] : after->offset[axis]);
        if (travel_refuses(t, axis, after->position[axis], target))
            return refuse_way(c, t, axis, target > after->position[axis]);
        c->p->move.delta[axis] = target - after->position[axis];
        c->p->moves = c->p->moves || c->p->move.delta[axis] != 0;
        c->p->columns[axis] = w->column;
        after->position[axis] = target;
    }
    if (after->mode >= MODE_CW && !plan_arc(c))
        return false;
    if (c->p->moves) {
        after->served = after->mode != MODE_RAPID ? after->servo : LAW_CONSTANT;
        c->p->changes_servo = after->served != c->before->served;
        if (after->served && !c->before->machining && !c->p->machining_on)
            return fault_at(c->f, FAULT_MODE, 0, "under servo (G95) there is no way without M03");
        /* G10 may have changed the row since the G95. */
        if (c->p->changes_servo && !series_reached() &&
            !law_check(after->served, after->condition, 0, c->f))
            return false;
        retraction_layer set = retraction_combined(&after->memory);
        if (after->served && !retraction_complete(&set))
            return fault_at(c->f, FAULT_RETRACTION, 0, "G95 needs retraction data (G36) before it");
    }
    c->p->speed = after->mode == MODE_RAPID ? highest_speed : after->feed;
    if (c->p->moves && !c->p->speed)
        return fault_at(c->f, FAULT_FEED, c->column[G_MOTION], "G0%u without a feed F",
                        (uint32_t)after->mode - 1);
    return true;
}

/* Is the end of the arc so far away that no arc reaches it? */
static bool out_of_reach(vector chord) {
    int32_t reach = 2 * units_radius_limit();
    return chord.u > reach || chord.u < -reach || chord.v > reach || chord.v < -reach;
}

/* From the radius to the centre: left of the chord for the shorter way counter-clockwise. */
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
    if (half > (uint32_t)(radius + tolerance() / 2))
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

/* The centre is as far from the end as from the start, but for the rounding of its numbers: within
   the setting, and a sixteenth of the chord or, from half a turn on, of the diameter. */
static bool check_centre(plan *p, fault *f) {
    vector centre = plane_centre(&p->move), chord = plane_delta(&p->move);
    uint32_t start = vector_length(centre), end, difference;
    if (start < MOVE_FINE)
        return too_small(f, p->arc_column);
    if (start > (uint32_t)units_radius_limit() * MOVE_FINE)
        return too_large(f, p->arc_column);
    if (out_of_reach(chord)) {
        vector centre_pulses = {centre.u / MOVE_FINE, centre.v / MOVE_FINE};
        end = vector_length(vector_difference(chord, centre_pulses));
        difference = UINT32_MAX;
    } else {
        vector fine = vector_times(chord, MOVE_FINE), to = vector_difference(fine, centre);
        int64_t turn = vector_cross(to, centre); /* from the radius of the start to that of the end */
        bool less = turn && (turn > 0) == p->move.ccw;
        uint32_t length = less ? vector_length(fine) : 2 * start;
        end = vector_length(to);
        difference = start < end ? end - start : start - end;
        if (difference > length / 16)
            difference = UINT32_MAX;
        end = (end + MOVE_FINE / 2) / MOVE_FINE;
    }
    if (difference > (uint32_t)tolerance())
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

plan_result plan_arc_step(plan *p, const travel_range *t, fault *f) {
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
