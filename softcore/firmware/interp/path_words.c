// SPDX-License-Identifier: Apache-2.0
#include "interp/path_words.h"

#include "base/units.h"
#include "gap/depth_series.h"
#include "gap/feed_modes.h"
#include "interp/arc_words.h"

static const char AXIS[HAL_AXES] = {'X', 'Y', 'Z'};

bool path_words_set_position(context *c) {
    if (!(c->b->present & AXIS_LETTERS))
        return fault_at(c->f, FAULT_MISSING, 0, "G92 needs X, Y or Z");
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        const word *w = words_take(c, AXIS[axis]);
        int32_t pulses;
        if (!w)
            continue;
        if (!words_distance(c, w, AXIS[axis], &pulses))
            return false;
        c->p->after.offset[axis] = c->p->after.position[axis] - pulses;
    }
    return true;
}

void path_words_forget_position(context *c) {
    modal *after = &c->p->after;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        after->offset[axis] = after->systems[after->system][axis];
}

/* G10 D R: a wire offset. */
bool path_words_enter_wire(context *c) {
    if (!words_alone(c, BLOCK_BIT('D') | BLOCK_BIT('R')))
        return false;
    modal *after = &c->p->after;
    const word *name = words_take(c, 'D'), *w = words_take(c, 'R');
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

/* G10 L2 P X Y Z: set a work offset, in the machine frame. G10 L20 P X Y Z: set a work offset so
   that the present place has these coordinates. */
bool path_words_enter_system(context *c) {
    modal *after = &c->p->after;
    const word *how = words_take(c, 'L');
    bool here = how && how->number.digits == 20;
    if (how && (how->number.decimals || (how->number.digits != 2 && !here)))
        return fault_at(c->f, FAULT_TABLE, how->column,
                        "G10 L must be L2 or L20; a class of the fluid is entered by G10 W");
    if (!block_has(c->b, 'P'))
        return fault_at(c->f, FAULT_MISSING, how->column,
                        "G10 L%u needs its work offset P; a class of the fluid is entered by G10 W",
                        (uint32_t)how->number.digits);
    uint32_t number = 0;
    if (!words_alone(c, AXIS_LETTERS | BLOCK_BIT('L') | BLOCK_BIT('P')) ||
        !words_whole(c, 'P', 0, PLAN_SYSTEMS, "the work offset", &number))
        return false;
    if (!(c->b->present & AXIS_LETTERS))
        return fault_at(c->f, FAULT_MISSING, 0, "G10 P needs X, Y or Z");
    unsigned system = number ? number - 1 : after->system;
    int32_t *origin = after->systems[system];
    int32_t set[HAL_AXES]; /* the part of the offset that G92 has set */
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        set[axis] = after->offset[axis] - after->systems[after->system][axis];
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        const word *w = words_take(c, AXIS[axis]);
        int32_t pulses;
        if (!w)
            continue;
        if (!words_distance(c, w, AXIS[axis], &pulses))
            return false;
        c->p->here = here;
        if (here)
            pulses = after->position[axis] - set[axis] - pulses;
        if (system == after->system)
            after->offset[axis] += pulses - origin[axis];
        origin[axis] = pulses;
    }
    return true;
}

/* G40, G41, G42: the side of the path on which the wire goes from the next motion on. */
bool path_words_wire(context *c, bool mdi) {
    modal *after = &c->p->after;
    if (c->g[G_WIRE] < 0)
        return true;
    after->side = (int8_t)(c->g[G_WIRE] == 410 ? 1 : c->g[G_WIRE] == 420 ? -1 : 0);
    if (!after->side)
        return true;
    if (mdi)
        return fault_at(c->f, FAULT_REFUSED, c->column[G_WIRE],
                        "the wire offset (G41, G42) is for tapes; by hand it is not in this version");
    const word *w = words_take(c, 'D');
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

bool path_words_plane(context *c) {
    if (c->g[G_PLANE] >= 0)
        c->p->after.plane = (move_plane)(c->g[G_PLANE] / 10 - 17);
    if (c->before->side && c->p->after.plane != c->before->plane)
        return fault_at(c->f, FAULT_CONFLICT, c->column[G_PLANE],
                        "the plane cannot change under a wire offset (G41, G42)");
    return true;
}

static bool refuse_way(context *c, const travel_range *t, unsigned axis, bool up) {
    uint32_t column = BLOCK_WORD(c->b, AXIS[axis])->column;
    if (travel_onto(t, axis, up))
        return fault_at(c->f, FAULT_TRAVEL, column, "%c leads further onto its %s limit switch",
                        AXIS[axis], up ? "upper" : "lower");
    return fault_at(c->f, FAULT_TRAVEL, column, "%c is beyond the travel", AXIS[axis]);
}

static inline __attribute__((always_inline)) bool target_of(context *c, const travel_range *t, unsigned axis, int32_t frame,
                       int32_t *target) {
    int32_t at = c->p->after.position[axis], pulses;
    const word *w = words_take(c, AXIS[axis]);
    *target = at;
    if (!w)
        return true;
    if (!words_distance(c, w, AXIS[axis], &pulses))
        return false;
    /* At most 4 * 2**28: no overflow. */
    *target = pulses + (c->p->after.incremental ? at : frame);
    if (travel_refuses(t, axis, at, *target))
        return refuse_way(c, t, axis, *target > at);
    return true;
}

bool path_words_target(context *c, const travel_range *t, unsigned axis, int32_t frame,
                       int32_t *target) {
    return target_of(c, t, axis, frame, target);
}

/* G53: this block's coordinates are those of the machine. */
static bool judge_frame(context *c) {
    if (c->g[G_FRAME] < 0)
        return true;
    const modal *after = &c->p->after;
    const char *needs = after->incremental ? "G90" : after->side ? "G40" : 0;
    if (after->mode != MODE_RAPID && after->mode != MODE_FEED)
        needs = "G00 or G01";
    return !needs || fault_at(c->f, FAULT_MODE, c->column[G_FRAME], "G53 needs %s", needs);
}

bool path_words_move(context *c, uint32_t highest_speed, const travel_range *t) {
    modal *after = &c->p->after;
    if (!judge_frame(c))
        return false;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t target;
        if (!block_has(c->b, AXIS[axis]))
            continue;
        uint16_t column = BLOCK_WORD(c->b, AXIS[axis])->column;
        if (after->mode == MODE_NONE)
            return fault_at(c->f, FAULT_MODE, column, "%c without G00, G01, G02 or G03", AXIS[axis]);
        if (!target_of(c, t, axis, c->g[G_FRAME] < 0 ? after->offset[axis] : 0, &target))
            return false;
        c->p->move.delta[axis] = target - after->position[axis];
        c->p->moves = c->p->moves || c->p->move.delta[axis] != 0;
        c->p->columns[axis] = column;
        after->position[axis] = target;
    }
    if (after->mode >= MODE_CW && !arc_words_take(c))
        return false;
    if (c->p->moves) {
        after->served = after->mode != MODE_RAPID ? after->servo : FEED_CONSTANT;
        c->p->changes_servo = after->served != c->before->served;
        if (after->served && !c->before->machining && !c->p->machining_on)
            return fault_at(c->f, FAULT_MODE, 0, "under servo (G95) there is no way without M03");
        /* Check again: G10 may have changed the row since the G95. */
        if (c->p->changes_servo && !depth_series_reached() &&
            !feed_modes_check(after->served, after->condition, 0, c->f))
            return false;
        if (after->served && !retraction_complete(&after->memory))
            return fault_at(c->f, FAULT_RETRACTION, 0, "G95 needs retraction data (G36) before it");
    }
    c->p->rapid = after->mode == MODE_RAPID;
    c->p->speed = c->p->rapid ? highest_speed : after->feed;
    if (c->p->moves && !c->p->speed)
        return fault_at(c->f, FAULT_FEED, c->column[G_MOTION], "G0%u without a feed F",
                        (uint32_t)after->mode - 1);
    return true;
}
