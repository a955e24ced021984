// SPDX-License-Identifier: Apache-2.0
#include "interp/words.h"

#include "base/settings.h"
#include "base/units.h"

const word *words_take(context *c, char letter) {
    if (!(c->free & BLOCK_BIT(letter)))
        return 0;
    c->free &= ~BLOCK_BIT(letter);
    return BLOCK_WORD(c->b, letter);
}

bool words_distance(context *c, const word *w, char letter, int32_t *pulses) {
    if (!units_distance(w->number, c->p->after.inch, pulses))
        return fault_at(c->f, FAULT_OVERFLOW, w->column, "the distance %c is out of range", letter);
    if (w->negative)
        *pulses = -*pulses;
    return true;
}

bool words_speed(context *c, const word *w, char letter, uint32_t *um_per_min) {
    if (w->negative)
        return fault_at(c->f, FAULT_NUMBER, w->column, "the speed %c takes no sign", letter);
    if (!units_speed(w->number, c->p->after.inch, um_per_min))
        return fault_at(c->f, FAULT_OVERFLOW, w->column, "the speed %c is out of range", letter);
    return true;
}

bool words_whole(context *c, char letter, uint32_t lowest, uint32_t highest, const char *what,
                  uint32_t *value) {
    const word *w = words_take(c, letter);
    if (!w)
        return true;
    if (w->negative || w->number.decimals || w->number.digits < lowest ||
        w->number.digits > highest)
        return fault_at(c->f, FAULT_TABLE, w->column, "%s %c must be a whole number, %u to %u",
                        what, letter, lowest, highest);
    *value = (uint32_t)w->number.digits;
    return true;
}

bool words_alone(context *c, uint32_t allowed) {
    uint32_t column = 0;
    if (c->b->g_count > 1)
        column = c->b->g[c->b->g[0].tenths == (uint16_t)c->g[G_ONCE] ? 1 : 0].column;
    else if (c->b->m_count)
        column = c->b->m[0].column;
    uint32_t others = c->b->present & ~(allowed | BLOCK_BIT('N'));
    for (unsigned i = 0; others && !column; i++)
        if (others & (1u << i))
            column = c->b->words[i].column;
    if (column)
        return fault_at(c->f, FAULT_PLACE, column, "a G%u block carries no other word",
                        (uint32_t)c->g[G_ONCE] / 10);
    return true;
}

bool words_used(context *c) {
    for (unsigned i = 0; c->free; i++)
        if (c->free & (1u << i))
            return fault_at(c->f, FAULT_PLACE, c->b->words[i].column,
                            "the word %c has no meaning in this block", (char)('A' + i));
    return true;
}

bool words_seen(context *c, const condition_row *row, uint32_t column) {
    return conditions_judge(row, column, c->f);
}

bool words_condition(context *c, const word *w, const condition_row **row) {
    uint32_t number = (uint32_t)w->number.digits, level;
    *row = conditions_find(number);
    if (!*row)
        return fault_at(c->f, FAULT_CONDITION, w->column,
                        "the machining condition C%u is not in the table", number);
    if (!conditions_level(*row, &level))
        return fault_at(c->f, FAULT_CONDITION, w->column,
                        "the power supply cannot give the current of the condition C%u", number);
    return words_seen(c, *row, w->column);
}
