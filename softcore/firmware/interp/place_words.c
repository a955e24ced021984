// SPDX-License-Identifier: Apache-2.0
#include "interp/place_words.h"

#include "gap/feed_modes.h"
#include "interp/path_words.h"

void place_words_store(context *c, unsigned number) {
    modal *after = &c->p->after;
    c->p->act = ACT_TABLE;
    c->p->here = true;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        after->places[number][axis] = after->position[axis];
    after->stored[number] = true;
}

static bool moves(const path_move *m) { return m->delta[0] || m->delta[1] || m->delta[2]; }

bool place_words_go(context *c, unsigned number, uint32_t highest_speed, const travel_range *t) {
    plan *p = c->p;
    modal *after = &p->after;
    uint32_t column = c->column[G_ONCE], code = number ? 30 : 28;
    bool all = !(c->b->present & AXIS_LETTERS);
    if (after->side)
        return fault_at(c->f, FAULT_MODE, column, "G%u needs G40", code);
    if (!after->stored[number])
        return fault_at(c->f, FAULT_MISSING, column,
                        "G%u has no place to go to; go there once and store it by G%u.1", code, code);
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        bool named = block_has(c->b, "XYZ"[axis]);
        int32_t over, end, place = after->places[number][axis];
        if (!path_words_target(c, t, axis, after->offset[axis], &over))
            return false;
        end = all || named ? place : over;
        if (travel_refuses(t, axis, over, end))
            return fault_at(c->f, FAULT_TRAVEL, column, "the place of G%u is beyond the travel of %c",
                            code, "XYZ"[axis]);
        p->corner.delta[axis] = over - after->position[axis];
        p->move.delta[axis] = end - over;
        after->position[axis] = end;
    }
    p->moves = moves(&p->move) || moves(&p->corner);
    p->corners = moves(&p->corner) && moves(&p->move);
    if (moves(&p->corner) && !p->corners)
        p->move = p->corner;
    p->speed = p->corner_speed = highest_speed;
    p->rapid = p->corner_rapid = true;
    if (p->moves) {
        after->served = FEED_CONSTANT;
        p->changes_servo = c->before->served != FEED_CONSTANT;
    }
    return true;
}
