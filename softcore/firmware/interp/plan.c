// SPDX-License-Identifier: Apache-2.0
#include "interp/plan.h"

#include <stddef.h>

_Static_assert(offsetof(plan, after) == 0, "plan_begin clears what follows the state");

void plan_copy(modal *to, const modal *from) {
    __builtin_memcpy(to, from,
                     to->edition == from->edition ? offsetof(modal, edition) : sizeof *to);
}

void plan_edit(modal *state) {
    static uint32_t editions;
    state->edition = ++editions;
}

void plan_select_system(modal *state, unsigned system) {
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        state->offset[axis] += state->systems[system][axis] - state->systems[state->system][axis];
    state->system = (uint8_t)system;
}

void plan_start(modal *state) {
    plan_edit(state);
    state->inch = state->incremental = false;
    state->mode = MODE_NONE;
    state->plane = PLANE_XY;
    state->side = 0;
    state->wire = PLAN_NO_WIRE;
    plan_select_system(state, 0);
    state->feed = 0;
    state->memory.tape.given = 0;
    state->jump.period = 0;
    state->condition = 0;
    state->servo = state->served = state->machining = false;
}

void plan_begin(plan *p, const modal *state) {
    plan_copy(&p->after, state);
    __builtin_memset((char *)p + sizeof p->after, 0, sizeof *p - sizeof p->after);
    p->s = p->t = p->m[0] = -1;
    p->name = -1;
    p->class_number = GAP_CLASSES;
}
