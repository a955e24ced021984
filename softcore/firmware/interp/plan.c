// SPDX-License-Identifier: Apache-2.0
#include "interp/plan.h"

#include "base/settings.h"
#include "base/units.h"
#include "gap/law.h"
#include "gap/series.h"
#include "interp/plan_words.h"

#include <stddef.h>

_Static_assert(offsetof(plan, after) == 0, "plan_block clears what follows the state");

typedef struct {
    uint16_t tenths;
    uint8_t group;
} g_row;

static const g_row G_ROWS[] = {
    {0, G_MOTION}, {10, G_MOTION}, {20, G_MOTION}, {30, G_MOTION}, {40, G_ONCE}, {100, G_ONCE},
    {170, G_PLANE}, {180, G_PLANE}, {190, G_PLANE}, {200, G_UNITS}, {210, G_UNITS}, {360, G_ONCE},
    {370, G_ONCE}, {380, G_ONCE}, {390, G_ONCE}, {400, G_WIRE}, {410, G_WIRE}, {420, G_WIRE},
    {540, G_SYSTEM}, {550, G_SYSTEM}, {560, G_SYSTEM}, {570, G_SYSTEM}, {580, G_SYSTEM},
    {590, G_SYSTEM}, {900, G_DISTANCE}, {910, G_DISTANCE}, {920, G_ONCE}, {940, G_FEED},
    {950, G_FEED},
};

typedef struct {
    uint16_t first, last; /* tenths */
    const char *name;
} refused_row;

/* A block of these words and no code goes on along the path, and does nothing else. */
#define PATH_LETTERS (AXIS_LETTERS | BLOCK_BIT('F') | BLOCK_BIT('I') | BLOCK_BIT('J') | BLOCK_BIT('K') | \
                      BLOCK_BIT('N') | BLOCK_BIT('R'))

/* Codes of the dialect that this version does not carry out: named, so that nobody looks for a
   typing error. */
static const refused_row REFUSED[] = {
    {381, 389, "probing (G38.x) is not in this version; G38 alone is the periodic jump"},
};

void plan_start(modal *state) {
    plan_edit(state);
    state->inch = state->incremental = false;
    state->mode = MODE_NONE;
    state->plane = PLANE_XY;
    state->side = 0;
    state->wire = PLAN_NO_WIRE;
    select_system(state, 0);
    state->feed = 0;
    state->memory.tape.given = 0;
    state->jump.period = 0;
    state->condition = 0;
    state->servo = state->served = state->machining = false;
}

/* Use a letter of the block, if it is there. */
const word *take(context *c, char letter) {
    if (!block_has(c->b, letter))
        return 0;
    c->free &= ~BLOCK_BIT(letter);
    return BLOCK_WORD(c->b, letter);
}

static bool find_groups(context *c) {
    for (unsigned group = 0; group < G_GROUPS; group++)
        c->g[group] = -1;
    for (unsigned i = 0; i < c->b->g_count; i++) {
        code_word code = c->b->g[i];
        for (unsigned k = 0; k < sizeof REFUSED / sizeof *REFUSED; k++)
            if (code.tenths >= REFUSED[k].first && code.tenths <= REFUSED[k].last)
                return fault_at(c->f, FAULT_REFUSED, code.column, "%s", REFUSED[k].name);
        const g_row *row = G_ROWS;
        const g_row *end = G_ROWS + sizeof G_ROWS / sizeof *G_ROWS;
        while (row < end && row->tenths != code.tenths)
            row++;
        if (row == end)
            return fault_at(c->f, FAULT_UNKNOWN, code.column, "the code G%u%s is unknown",
                            (uint32_t)code.tenths / 10, code.tenths % 10 ? " with a decimal" : "");
        if (c->g[row->group] >= 0)
            return fault_at(c->f, FAULT_CONFLICT, code.column, "G%u and G%u exclude each other",
                            (uint32_t)c->g[row->group] / 10, (uint32_t)code.tenths / 10);
        c->g[row->group] = (int16_t)code.tenths;
        c->column[row->group] = code.column;
    }
    return true;
}

bool distance(context *c, const word *w, char letter, int32_t *pulses) {
    if (!units_distance(w->number, c->p->after.inch, pulses))
        return fault_at(c->f, FAULT_OVERFLOW, w->column, "the distance %c is out of range", letter);
    if (w->negative)
        *pulses = -*pulses;
    return true;
}

bool speed(context *c, const word *w, char letter, uint32_t *um_per_min) {
    if (w->negative)
        return fault_at(c->f, FAULT_NUMBER, w->column, "the speed %c takes no sign", letter);
    if (!units_speed(w->number, c->p->after.inch, um_per_min))
        return fault_at(c->f, FAULT_OVERFLOW, w->column, "the speed %c is out of range", letter);
    return true;
}

static bool plan_feed(context *c, uint32_t highest_speed) {
    const word *w = take(c, 'F');
    if (!w)
        return true;
    if (!speed(c, w, 'F', &c->p->after.feed))
        return false;
    if (c->p->after.feed == 0)
        return fault_at(c->f, FAULT_FEED, w->column, "the feed F must be 0.001 mm/min or more");
    if (c->p->after.feed > highest_speed)
        return fault_at(c->f, FAULT_FEED, w->column, "the feed F is above the machine's %u mm/min",
                        highest_speed / 1000);
    return true;
}

/* G36 and G38 carry no motion and no other word. */
bool alone(context *c, uint32_t allowed) {
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

static bool plan_dwell(context *c) {
    const word *ms = take(c, 'P'), *seconds = take(c, 'X');
    if (!ms == !seconds)
        return fault_at(c->f, ms ? FAULT_CONFLICT : FAULT_MISSING, ms ? ms->column : 0,
                        "G04 needs its time, as P (ms) or X (s)");
    const word *w = ms ? ms : seconds;
    if (w->negative || !units_clocks(w->number, ms != 0, &c->p->dwell))
        return fault_at(c->f, FAULT_OVERFLOW, w->column, "the time of G04 is out of range");
    return true;
}

bool seen_condition(context *c, const technology_row *row, uint32_t column) {
    return technology_seen(row) ||
           fault_at(c->f, FAULT_CONDITION, column,
                    "a pulse of C%u takes %u us, and the gap is looked at after %u ns only "
                    "($%u, $%u)", row->number, (uint32_t)row->on_us,
                    settings_get(SET_BLANKING_NS) + settings_get(SET_SETTLE_NS),
                    (uint32_t)SET_BLANKING_NS, (uint32_t)SET_SETTLE_NS);
}

bool find_condition(context *c, const word *w, const technology_row **row) {
    uint32_t number = (uint32_t)w->number.digits, level;
    *row = technology_find(number);
    if (!*row)
        return fault_at(c->f, FAULT_CONDITION, w->column,
                        "the machining condition C%u is not in the table", number);
    if (!technology_level(*row, &level))
        return fault_at(c->f, FAULT_CONDITION, w->column,
                        "the power supply cannot give the current of the condition C%u", number);
    return seen_condition(c, *row, w->column);
}

static bool plan_condition(context *c) {
    const word *w = take(c, 'C');
    c->p->changes_condition = w;
    return !w || find_condition(c, w, &c->p->after.condition);
}

static bool plan_auxiliary(context *c) {
    plan *p = c->p;
    const word *s = take(c, 'S'), *t = take(c, 'T');
    p->s = s ? (int32_t)block_name(c->b, 'S') : -1;
    p->t = t ? (int32_t)block_name(c->b, 'T') : -1;
    if (p->s > UINT16_MAX || p->t > UINT16_MAX)
        return fault_at(c->f, FAULT_OVERFLOW, p->s > UINT16_MAX ? s->column : t->column,
                        "the code of S or T is above 65535");
    unsigned passed = 0, fluid = 0;
    uint32_t machining_column = 0;
    for (unsigned i = 0; i < c->b->m_count; i++) {
        code_word code = c->b->m[i];
        uint32_t m = code.tenths / 10;
        bool clash = false;
        if (code.tenths % 10)
            return fault_at(c->f, FAULT_NUMBER, code.column, "the word M takes no decimal point");
        if (m <= 2 || m == 30) {
            clash = p->stop != STOP_NONE;
            p->stop = m == 0 ? STOP_PROGRAM : m == 1 ? STOP_OPTIONAL : STOP_END;
        } else if (m == 3 || m == 5) {
            clash = p->machining_on || p->machining_off;
            machining_column = code.column;
            p->machining_on = m == 3;
            p->machining_off = m == 5;
        } else if (m == 9) {
            clash = fluid++;
            p->fluid_off = true;
        } else {
            clash = m == 8 ? fluid++ : 0;
            p->m[passed++] = (int32_t)m;
        }
        if (clash)
            return fault_at(c->f, FAULT_CONFLICT, code.column,
                            "M%u and another M code exclude each other", m);
    }
    if (passed < BLOCK_CODES)
        p->m[passed] = -1;
    p->after.machining = p->machining_on || (p->after.machining && !p->machining_off);
    if (!p->machining_on)
        return true;
    if (!p->after.condition)
        return fault_at(c->f, FAULT_CONDITION, machining_column,
                        "M03 without a machining condition (C) before it");
    /* The settings may have changed since the C, and what is in force may be none of the table. */
    const technology_row *unseen = p->changes_condition ? 0 : series_unseen();
    if (!seen_condition(c, unseen ? unseen : p->after.condition, machining_column))
        return false;
    return p->changes_condition || gap_current_kept() ||
           fault_at(c->f, FAULT_CONDITION, machining_column,
                    "M03 needs a C anew: the step of the power supply ($%u) has changed since",
                    (uint32_t)SET_CURRENT_STEP_MA);
}

/* A whole number of a word, up to a limit; `what` says what it is. */
bool whole(context *c, char letter, uint32_t lowest, uint32_t highest, const char *what,
                  uint32_t *value) {
    const word *w = take(c, letter);
    if (!w)
        return true;
    if (w->negative || w->number.decimals || w->number.digits < lowest ||
        w->number.digits > highest)
        return fault_at(c->f, FAULT_TABLE, w->column, "%s %c must be a whole number, %u to %u",
                        what, letter, lowest, highest);
    *value = (uint32_t)w->number.digits;
    return true;
}

static bool presets(context *c, uint32_t values[3]) {
    return whole(c, 'X', 0, 255, "the preset of arcs and shorts", &values[0]) &&
           whole(c, 'Y', 0, 255, "the preset of open pulses", &values[1]) &&
           whole(c, 'Z', 0, 255, "the preset of good pulses", &values[2]);
}

/* In IP, as near as the power supply has it. */
static bool current(context *c, technology_row *row) {
    const word *w = take(c, 'I');
    uint32_t milli_ip, level, step_ma = settings_get(SET_CURRENT_STEP_MA);
    if (!w)
        return true;
    if (w->negative || !units_speed(w->number, false, &milli_ip) || milli_ip > UINT16_MAX)
        return fault_at(c->f, FAULT_TABLE, w->column, "the current I is out of range");
    row->milli_ip = (uint16_t)milli_ip;
    if (!technology_level(row, &level))
        return fault_at(c->f, FAULT_TABLE, w->column,
                        "the current I must be 0 to %u steps of the power supply, %u mA each (1 IP is "
                        "%u mA)", hal_level_limit(), step_ma, (uint32_t)TECHNOLOGY_IP_MA);
    row->milli_ip = (uint16_t)(level * step_ma * 1000 / TECHNOLOGY_IP_MA);
    return true;
}

/* G10 C: a condition. What is left out stays as the row of that number has it. */
static bool plan_row(context *c, bool mdi) {
    if (!alone(c, AXIS_LETTERS | BLOCK_BIT('C') | BLOCK_BIT('I') | BLOCK_BIT('P') |
                      BLOCK_BIT('Q') | BLOCK_BIT('R') | BLOCK_BIT('E') | BLOCK_BIT('H') |
                      BLOCK_BIT('K') | BLOCK_BIT('L') | BLOCK_BIT('U') | BLOCK_BIT('V')))
        return false;
    const word *name = take(c, 'C'), *sign = take(c, 'K'), *step = take(c, 'L');
    technology_row row = technology_draft(block_name(c->b, 'C'));
    uint32_t on = row.on_us, off = row.off_us, rest = row.rest_us, open = row.open_v,
             percent = row.open_percent, counts[3] = {row.dame, row.open, row.ok};
    if (!current(c, &row) || !whole(c, 'P', 1, 2000, "the on-time", &on) ||
        !whole(c, 'Q', 1, 20000, "the off-time", &off) ||
        !whole(c, 'R', 0, 20000, "the rest after an arc", &rest) ||
        !whole(c, 'E', 20, 300, "the open voltage", &open) ||
        !whole(c, 'H', 1, 99, "the open level", &percent) || !presets(c, counts))
        return false;
    if (sign && (sign->number.decimals || sign->number.digits != 1))
        return fault_at(c->f, FAULT_TABLE, sign->column, "the polarity K must be 1 or -1");
    int32_t pulses = row.step;
    if (step && (!distance(c, step, 'L', &pulses) || pulses < 1 || pulses > UINT16_MAX))
        return fault_at(c->f, FAULT_TABLE, step->column, "the servo step L is out of range");
    if (!on || !off)
        return fault_at(c->f, FAULT_MISSING, 0, "a new condition needs its times P and Q");
    if (open % GAP_SUPPLY_STEP_V)
        return fault_at(c->f, FAULT_TABLE, BLOCK_WORD(c->b, 'E')->column,
                        "the open voltage E must be a multiple of %u V", (uint32_t)GAP_SUPPLY_STEP_V);
    /* Whatever the fluid leaves of it. */
    if (open * percent * GAP_SHARE_PERCENT <= row.arc_v * 10000u)
        return fault_at(c->f, FAULT_TABLE, name->column,
                        "the open level (%u %% of %u V) must be above twice the arc level of %u V",
                        percent, open, (uint32_t)row.arc_v);
    row.on_us = (uint16_t)on;
    row.off_us = (uint16_t)off;
    row.rest_us = (uint16_t)rest;
    row.open_v = (uint16_t)open;
    row.open_percent = (uint8_t)percent;
    row.negative = sign ? sign->negative : row.negative;
    row.step = (uint16_t)pulses;
    row.dame = (uint8_t)counts[0];
    row.open = (uint8_t)counts[1];
    row.ok = (uint8_t)counts[2];
    if (!law_references(take(c, 'V'), take(c, 'U'), &row, c->f))
        return false;
    if (!technology_enter(&row, mdi))
        return fault_at(c->f, FAULT_TABLE, name->column, "no more than %u conditions can be entered",
                        (uint32_t)TECHNOLOGY_ENTERED);
    return true;
}

/* G10 L: a class of the fluid. */
static bool plan_class(context *c) {
    if (!alone(c, AXIS_LETTERS | BLOCK_BIT('L') | BLOCK_BIT('H')))
        return false;
    uint32_t number = 0;
    if (!whole(c, 'L', 0, GAP_CLASSES - 1, "the fluid's class", &number))
        return false;
    gap_class row = gap_class_row(number);
    uint32_t share = row.share_percent, counts[3] = {row.dame, row.open, row.ok};
    if (!presets(c, counts) || !whole(c, 'H', GAP_SHARE_PERCENT, 100, "the share of the open voltage", &share))
        return false;
    c->p->class_number = number;
    c->p->class_row = (gap_class){(uint8_t)counts[0], (uint8_t)counts[1], (uint8_t)counts[2],
                                  (uint8_t)share};
    return true;
}

static bool plan_table(context *c, bool mdi) {
    if (block_has(c->b, 'C'))
        return plan_row(c, mdi);
    if (block_has(c->b, 'L'))
        return plan_class(c);
    if (block_has(c->b, 'D'))
        return enter_wire(c);
    if (block_has(c->b, 'P'))
        return enter_system(c);
    return fault_at(c->f, FAULT_MISSING, 0,
                    "G10 needs a condition C, a class of the fluid L, a wire offset D or a work offset P");
}

/* G94, or G95 with its law. */
static bool plan_feed_mode(context *c) {
    if (c->g[G_FEED] < 0)
        return true;
    bool servo = c->g[G_FEED] == 950;
    c->p->after.servo = LAW_CONSTANT;
    if (c->g[G_ONCE] >= 0 && servo)
        return fault_at(c->f, FAULT_CONFLICT, c->column[G_FEED], "G95 and G%u exclude each other",
                        (uint32_t)c->g[G_ONCE] / 10);
    return !servo || law_word(take(c, 'P'), c->column[G_FEED], &c->p->after.servo, c->f);
}

/* What the law needs of the condition, as soon as both are said. */
static bool plan_law(context *c) {
    bool told = c->g[G_FEED] >= 0;
    uint32_t column = told ? c->column[G_FEED] : BLOCK_WORD(c->b, 'C')->column;
    if (!told && !c->p->changes_condition)
        return true;
    return law_check(c->p->after.servo, c->p->after.condition, column, c->f) &&
           (c->p->changes_condition || series_law(c->p->after.servo, column, c->f));
}

static bool plan_once(context *c, bool mdi, uint32_t highest_speed, unsigned jump_axis) {
    if (c->g[G_ONCE] >= 100 && c->g[G_ONCE] <= 380)
        plan_edit(&c->p->after);
    switch (c->g[G_ONCE]) {
    case 40: c->p->act = ACT_DWELL; return plan_dwell(c);
    case 100: c->p->act = ACT_TABLE; return plan_table(c, mdi);
    case 360: c->p->act = ACT_RETRACTION; return plan_retraction(c, mdi, highest_speed, jump_axis);
    case 370: c->p->act = ACT_DEFAULTS; return plan_defaults(c, highest_speed);
    case 380: c->p->act = ACT_JUMP; return plan_jump(c, highest_speed);
    case 390: c->p->act = ACT_SERIES; return plan_series(c, jump_axis);
    case 920: c->p->act = ACT_SET_POSITION; return plan_set_position(c);
    default: return true;
    }
}

/* Every word must have meant something. */
static bool nothing_left(context *c) {
    for (unsigned i = 0; c->free; i++)
        if (c->free & (1u << i))
            return fault_at(c->f, FAULT_PLACE, c->b->words[i].column,
                            "the word %c has no meaning in this block", (char)('A' + i));
    return true;
}

bool plan_block(const block *b, const modal *state, bool mdi, uint32_t highest_speed,
                const travel_range *t, unsigned jump_axis, plan *p, fault *f) {
    context c = {.b = b, .f = f, .p = p, .before = state, .free = b->present};
    plan_copy(&p->after, state);
    /* All but the state is as good as nothing. */
    __builtin_memset((char *)p + sizeof p->after, 0, sizeof *p - sizeof p->after);
    p->s = p->t = p->m[0] = -1;
    p->name = -1;
    p->class_number = GAP_CLASSES;
    f->block = block_has(b, 'N') ? block_name(b, 'N') : 0;
    take(&c, 'N');
    if (take(&c, 'O'))
        p->name = block_name(b, 'O');
    if (!find_groups(&c))
        return false;
    if (c.g[G_UNITS] >= 0)
        p->after.inch = c.g[G_UNITS] == 200;
    if (c.g[G_DISTANCE] >= 0)
        p->after.incremental = c.g[G_DISTANCE] == 910;
    if (c.g[G_MOTION] >= 0)
        p->after.mode = (motion_mode)(MODE_RAPID + c.g[G_MOTION] / 10);
    if (c.g[G_SYSTEM] >= 0)
        select_system(&p->after, (unsigned)c.g[G_SYSTEM] / 10 - 54);
    if (c.g[G_ONCE] >= 0 && c.g[G_MOTION] >= 0)
        return fault_at(f, FAULT_CONFLICT, c.column[G_ONCE], "G%u and G%u exclude each other",
                        (uint32_t)c.g[G_MOTION] / 10, (uint32_t)c.g[G_ONCE] / 10);
    bool coded = b->g_count || b->m_count || b->present & ~PATH_LETTERS;
    if ((coded && (!plan_plane(&c) || !plan_wire(&c, mdi) ||
                   !plan_once(&c, mdi, highest_speed, jump_axis) || !plan_feed_mode(&c))) ||
        !plan_feed(&c, highest_speed) ||
        (coded && ((p->act < ACT_TABLE && (!plan_condition(&c) || !plan_law(&c))) ||
                   !plan_auxiliary(&c))) ||
        (c.g[G_ONCE] < 0 && !plan_move(&c, highest_speed, t)) ||
        !nothing_left(&c))
        return false;
    p->move.plane = p->after.plane;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        p->changes_frame = p->changes_frame || p->after.offset[axis] != state->offset[axis];
    p->acts_before = p->act != ACT_NONE || p->changes_condition || p->changes_servo ||
                     p->changes_frame || p->machining_on || p->s >= 0 || p->t >= 0 || p->m[0] >= 0;
    p->acts_after = p->machining_off || p->fluid_off || p->stop != STOP_NONE;
    return true;
}
