// SPDX-License-Identifier: Apache-2.0
/* G39: a step of the series of conditions by depth, or its end. */
#include "plan_words.h"
#include "series.h"

bool plan_series(context *c, unsigned jump_axis) {
    plan *p = c->p;
    const modal *after = &p->after;
    if (jump_axis >= HAL_AXES)
        return fault_at(c->f, FAULT_REFUSED, c->column[G_ONCE],
                        "G39 is for machines with a jump axis (sinkers)");
    char letter = "XYZ"[jump_axis];
    if (!alone(c, BLOCK_BIT(letter) | BLOCK_BIT('C')))
        return false;
    const word *depth = take(c, letter), *name = take(c, 'C');
    if (!depth && !name)
        return true;
    if (!depth || !name)
        return fault_at(c->f, FAULT_MISSING, depth ? depth->column : name->column,
                        "a step of G39 needs its depth %c and its condition C", letter);
    if (!after->condition)
        return fault_at(c->f, FAULT_CONDITION, c->column[G_ONCE],
                        "G39 without a machining condition (C) before it");
    if (after->side)
        return fault_at(c->f, FAULT_CONFLICT, c->column[G_ONCE],
                        "G39 and a wire offset (G41, G42) exclude each other");
    int32_t pulses;
    if (!distance(c, depth, letter, &pulses) || !find_condition(c, name, &p->series))
        return false;
    /* Kept in the machine's frame, like the ceiling of G36. */
    p->series_depth = pulses + after->offset[jump_axis];
    return series_check(p->series_depth, after->offset[jump_axis], p->series, after->servo,
                        depth->column, c->f);
}
