// SPDX-License-Identifier: Apache-2.0
#include "interp/retraction_words.h"

#include "base/units.h"

bool retraction_words_enter(context *c, bool mdi, uint32_t highest_speed, unsigned jump_axis) {
    uint32_t letters = BLOCK_BIT('R') | BLOCK_BIT('L') | BLOCK_BIT('H') | BLOCK_BIT('E') |
                       BLOCK_BIT('Q') | BLOCK_BIT('Z');
    if (!words_alone(c, letters))
        return false;
    modal *after = &c->p->after;
    retraction_layer *layer = mdi ? &after->memory.mdi : &after->memory.tape;
    uint32_t columns[ITEMS] = {0};
    for (unsigned item = 0; item < ITEMS; item++) {
        char letter = RETRACTION_LETTERS[item];
        const word *w = words_take(c, letter);
        if (!w)
            continue;
        columns[item] = w->column;
        if (item == ITEM_Z && jump_axis >= HAL_AXES)
            return fault_at(c->f, FAULT_REFUSED, w->column,
                            "the ceiling Z is for machines with a jump axis (sinkers)");
        int32_t pulses;
        uint32_t um_per_min;
        if (item == ITEM_L || item == ITEM_Q || item == ITEM_Z) {
            if (!words_distance(c, w, letter, &pulses))
                return false;
            /* The ceiling is programmed in the work frame and stored in the machine frame. */
            layer->value[item] = item == ITEM_Z ? pulses + after->offset[2] : pulses;
        } else {
            if (!words_speed(c, w, letter, &um_per_min))
                return false;
            layer->value[item] = (int32_t)um_per_min;
        }
        layer->given |= (uint8_t)(1u << item);
    }
    /* Data entered by hand may be incomplete; the tape may complete them. */
    return retraction_check(&after->memory, !mdi, highest_speed, columns, c->f);
}

bool retraction_words_defaults(context *c, uint32_t highest_speed) {
    static const uint32_t nowhere[ITEMS];
    if (!words_alone(c, 0))
        return false;
    c->p->after.memory.tape.given = 0;
    return retraction_check(&c->p->after.memory, true, highest_speed, nowhere, c->f);
}

static bool jump_speed(context *c, const word *w, char letter, uint32_t highest, uint32_t *value) {
    if (!w)
        return true;
    if (!words_speed(c, w, letter, value))
        return false;
    if (*value > highest)
        return fault_at(c->f, FAULT_RETRACTION, w->column,
                        "the speed %c is above the machine's %u mm/min", letter, highest / 1000);
    return true;
}

bool retraction_words_jump(context *c, uint32_t highest_speed) {
    if (!words_alone(c, BLOCK_BIT('P') | BLOCK_BIT('L') | BLOCK_BIT('R') | BLOCK_BIT('H')))
        return false;
    retraction_jump *jump = &c->p->after.jump;
    const word *period = words_take(c, 'P'), *limit = words_take(c, 'L');
    const word *up = words_take(c, 'R'), *high = words_take(c, 'H');
    if (!period)
        return fault_at(c->f, FAULT_MISSING, 0, "G38 needs the period P");
    uint64_t clocks;
    if (!units_clocks(period->number, true, &clocks) || clocks > UINT32_MAX)
        return fault_at(c->f, FAULT_OVERFLOW, period->column, "the period P is out of range");
    jump->period = (uint32_t)clocks;
    if (limit && !words_distance(c, limit, 'L', &jump->distance))
        return false;
    if (!jump_speed(c, up, 'R', highest_speed, &jump->speed) ||
        !jump_speed(c, high, 'H', highest_speed, &jump->high))
        return false;
    if (!jump->period)
        return true;
    char missing = jump->distance == 0 ? 'L' : jump->speed == 0 ? 'R' : jump->high == 0 ? 'H' : 0;
    if (missing)
        return fault_at(c->f, FAULT_MISSING, 0, "G38 needs %c, above zero", missing);
    /* The re-advance of a jump needs the retraction data too: it changes to the low speed at Q. */
    if (!retraction_complete(&c->p->after.memory))
        return fault_at(c->f, FAULT_RETRACTION, 0, "G38 needs retraction data (G36) before it");
    return true;
}
