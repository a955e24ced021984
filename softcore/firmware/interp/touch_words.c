// SPDX-License-Identifier: Apache-2.0
#include "interp/touch_words.h"

#include "base/settings.h"
#include "gap/feed_modes.h"
#include "interp/path_words.h"

/* Digit behind the point of the code. */
static uint32_t kind(const context *c) { return (uint32_t)c->g[G_ONCE] % 10; }

bool touch_words_take(context *c, const travel_range *t) {
    plan *p = c->p;
    modal *after = &p->after;
    uint32_t column = c->column[G_ONCE];
    if (after->side)
        return fault_at(c->f, FAULT_MODE, column, "G38.%u needs G40", kind(c));
    if (!(c->b->present & AXIS_LETTERS))
        return fault_at(c->f, FAULT_MISSING, column, "G38.%u needs X, Y or Z", kind(c));
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t target;
        if (!path_words_target(c, t, axis, after->offset[axis], &target))
            return false;
        p->move.delta[axis] = target - after->position[axis];
        p->moves = p->moves || p->move.delta[axis] != 0;
        after->position[axis] = target;
    }
    if (!p->moves)
        return fault_at(c->f, FAULT_MISSING, column, "G38.%u needs a way to go", kind(c));
    p->act = ACT_TOUCH;
    p->touch_needed = kind(c) % 2 == 0;
    p->touch_away = kind(c) >= 4;
    after->served = FEED_CONSTANT;
    p->changes_servo = c->before->served != FEED_CONSTANT;
    return true;
}

/* Above the start/stop speed contact would trip the interlock, as the axes could not stop. */
bool touch_words_check(context *c) {
    uint32_t column = c->column[G_ONCE], most = settings_get(SET_START_SPEED_UM_S) * 60;
    if (c->before->machining || c->p->machining_on)
        return fault_at(c->f, FAULT_MODE, column,
                        "G38.%u needs the discharge off (M05) before it", kind(c));
    c->p->speed = c->p->after.feed;
    if (!c->p->speed)
        return fault_at(c->f, FAULT_FEED, column, "G38.%u without a feed F", kind(c));
    return c->p->speed <= most ||
           fault_at(c->f, FAULT_FEED, column,
                    "the feed F of G38.%u must be at most the start/stop speed ($%u), %u mm/min",
                    kind(c), settings_number(SET_START_SPEED_UM_S), most / 1000);
}
