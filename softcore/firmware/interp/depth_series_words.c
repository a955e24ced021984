// SPDX-License-Identifier: Apache-2.0
#include "interp/depth_series_words.h"

#include "gap/depth_series.h"
#include "gap/feed_modes.h"
#include "roughing/result.h"

/* G39 P1: the first condition of the planned staircase acts like a C, the others are its depth
   series. */
static bool plan_planned(context *c, const word *which, const word *other, unsigned jump_axis) {
    plan *p = c->p;
    unsigned steps = result_count();
    if (other)
        return fault_at(c->f, FAULT_CONFLICT, other->column,
                        "G39 P1 takes depths and conditions from what has been planned");
    if (which->number.decimals || which->number.digits != 1)
        return fault_at(c->f, FAULT_NUMBER, which->column,
                        "G39 takes P1 only: what has been planned last");
    if (!steps)
        return fault_at(c->f, FAULT_CONDITION, which->column,
                        "G39 P1 without a staircase that has been planned ($BP)");
    for (unsigned step = 0; step < steps; step++)
        if (!feed_modes_check(p->after.servo, result_row(step), which->column, c->f) ||
            !words_seen(c, result_row(step), which->column))
            return false;
    p->act = ACT_PLANNED;
    p->changes_condition = true;
    p->after.condition = result_first();
    p->step_depth = p->after.offset[jump_axis];
    return true;
}

bool depth_series_words_take(context *c, unsigned jump_axis) {
    plan *p = c->p;
    const modal *after = &p->after;
    if (jump_axis >= HAL_AXES)
        return fault_at(c->f, FAULT_REFUSED, c->column[G_ONCE],
                        "G39 is for machines with a jump axis (sinkers)");
    char letter = "XYZ"[jump_axis];
    if (!words_alone(c, BLOCK_BIT(letter) | BLOCK_BIT('C') | BLOCK_BIT('P')))
        return false;
    const word *depth = words_take(c, letter), *name = words_take(c, 'C'), *which = words_take(c, 'P');
    if (!depth && !name && !which)
        return true;
    if (after->side)
        return fault_at(c->f, FAULT_CONFLICT, c->column[G_ONCE],
                        "G39 and a wire offset (G41, G42) exclude each other");
    if (which)
        return plan_planned(c, which, depth ? depth : name, jump_axis);
    if (!depth || !name)
        return fault_at(c->f, FAULT_MISSING, depth ? depth->column : name->column,
                        "a step of G39 needs its depth %c and its condition C", letter);
    if (!after->condition)
        return fault_at(c->f, FAULT_CONDITION, c->column[G_ONCE],
                        "G39 without a machining condition (C) before it");
    int32_t pulses;
    if (!words_distance(c, depth, letter, &pulses) || !words_condition(c, name, &p->step_condition))
        return false;
    /* In the machine frame, like the ceiling of G36. */
    p->step_depth = pulses + after->offset[jump_axis];
    return depth_series_check(p->step_depth, after->offset[jump_axis], p->step_condition,
                              after->servo, depth->column, c->f);
}
