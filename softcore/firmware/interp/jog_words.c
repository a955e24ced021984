// SPDX-License-Identifier: Apache-2.0
#include "interp/jog_words.h"

#include "gap/feed_modes.h"
#include "interp/path_words.h"

/* Codes of a jog, by the bit that notes them. */
enum { INCHES = 1, MILLIMETRES = 2, ABSOLUTE = 4, INCREMENTAL = 8, MACHINE = 16 };

static bool take_codes(const block *b, unsigned *codes, fault *f) {
    static const struct {
        uint16_t tenths;
        uint8_t code, excluded;
    } ROWS[] = {
        {200, INCHES, MILLIMETRES}, {210, MILLIMETRES, INCHES}, {900, ABSOLUTE, INCREMENTAL},
        {910, INCREMENTAL, ABSOLUTE | MACHINE}, {530, MACHINE, INCREMENTAL},
    };
    for (unsigned i = 0; i < b->g_count; i++) {
        unsigned row = 0;
        while (row < sizeof ROWS / sizeof *ROWS && ROWS[row].tenths != b->g[i].tenths)
            row++;
        if (row == sizeof ROWS / sizeof *ROWS)
            return fault_at(f, FAULT_JOG, b->g[i].column,
                            "a jog has no G codes but G20, G21, G53, G90 and G91");
        if (*codes & ROWS[row].excluded)
            return fault_at(f, FAULT_MODAL, b->g[i].column,
                            "G%u and another G code of the jog exclude each other",
                            (uint32_t)b->g[i].tenths / 10);
        *codes |= ROWS[row].code;
    }
    return !b->m_count || fault_at(f, FAULT_JOG, b->m[0].column, "a jog has no M codes");
}

static bool take_feed(context *c, uint32_t highest_speed) {
    const word *w = words_take(c, 'F');
    if (!w)
        return fault_at(c->f, FAULT_FEED, 0, "a jog needs its feed F in the same line");
    if (!words_speed(c, w, 'F', &c->p->speed))
        return false;
    return (c->p->speed && c->p->speed <= highest_speed) ||
           fault_at(c->f, FAULT_FEED, w->column, "the feed F of a jog must be 0.001 to %u mm/min",
                    highest_speed / 1000);
}

static bool take_target(context *c, const travel_range *t, bool machine) {
    modal *after = &c->p->after;
    if (!(c->b->present & AXIS_LETTERS))
        return fault_at(c->f, FAULT_MISSING, 0, "a jog needs X, Y or Z");
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t target;
        if (!path_words_target(c, t, axis, machine ? 0 : after->offset[axis], &target)) {
            if (c->f->code == FAULT_TRAVEL)
                c->f->code = FAULT_JOG_TRAVEL;
            return false;
        }
        c->p->move.delta[axis] = target - after->position[axis];
        c->p->moves = c->p->moves || c->p->move.delta[axis] != 0;
        after->position[axis] = target;
    }
    return true;
}

bool jog_words_judge(const block *b, const modal *state, uint32_t highest_speed,
                     const travel_range *t, plan *p, fault *f) {
    context c = {.b = b, .f = f, .p = p, .before = state, .free = b->present};
    unsigned codes = 0;
    plan_begin(p, state);
    if (!take_codes(b, &codes, f))
        return false;
    modal *after = &p->after;
    if (codes & (INCHES | MILLIMETRES))
        after->inch = codes & INCHES;
    if (codes & (ABSOLUTE | INCREMENTAL | MACHINE))
        after->incremental = codes & INCREMENTAL;
    words_take(&c, 'N');
    if (!take_feed(&c, highest_speed) || !take_target(&c, t, codes & MACHINE) || !words_used(&c))
        return false;
    after->inch = state->inch;
    after->incremental = state->incremental;
    if (p->moves) {
        after->served = FEED_CONSTANT;
        p->changes_servo = p->acts_before = state->served != FEED_CONSTANT;
    }
    return true;
}
