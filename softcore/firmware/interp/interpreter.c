// SPDX-License-Identifier: Apache-2.0
#include "interp/interpreter.h"

#include "base/settings.h"
#include "base/units.h"
#include "gap/depth_series.h"
#include "gap/feed_modes.h"
#include "interp/arc_words.h"
#include "interp/depth_series_words.h"
#include "interp/gap_words.h"
#include "interp/path_words.h"
#include "interp/place_words.h"
#include "interp/retraction_words.h"
#include "interp/touch_words.h"
#include "interp/words.h"

typedef struct {
    uint16_t tenths;
    uint8_t group;
} g_row;

static const g_row G_ROWS[] = {
    {0, G_MOTION}, {10, G_MOTION}, {20, G_MOTION}, {30, G_MOTION}, {40, G_ONCE}, {100, G_ONCE},
    {170, G_PLANE}, {180, G_PLANE}, {190, G_PLANE}, {200, G_UNITS}, {210, G_UNITS}, {280, G_ONCE},
    {281, G_ONCE}, {300, G_ONCE}, {301, G_ONCE}, {360, G_ONCE}, {370, G_ONCE}, {380, G_ONCE},
    {382, G_ONCE}, {383, G_ONCE}, {384, G_ONCE}, {385, G_ONCE}, {390, G_ONCE}, {400, G_WIRE},
    {410, G_WIRE}, {420, G_WIRE}, {490, G_SILENT}, {500, G_SILENT}, {530, G_FRAME},
    {540, G_SYSTEM}, {550, G_SYSTEM}, {560, G_SYSTEM}, {570, G_SYSTEM}, {580, G_SYSTEM},
    {590, G_SYSTEM}, {610, G_SILENT}, {640, G_SILENT}, {690, G_SILENT}, {800, G_SILENT}, {900, G_DISTANCE},
    {910, G_DISTANCE}, {911, G_SILENT}, {920, G_ONCE}, {921, G_ONCE}, {940, G_FEED}, {950, G_FEED},
    {980, G_SILENT}, {990, G_SILENT},
};

typedef struct {
    uint16_t first, last; /* tenths */
    const char *name;
} refused_row;

/* A block with only these words and no code continues the path and does nothing else. */
#define PATH_LETTERS (AXIS_LETTERS | BLOCK_BIT('F') | BLOCK_BIT('I') | BLOCK_BIT('J') | BLOCK_BIT('K') | \
                      BLOCK_BIT('N') | BLOCK_BIT('R'))

/* Codes of this and other dialects that would change the motion but are not supported. Each has its
   own message, so that nobody looks for a typing error. */
static const refused_row REFUSED[] = {
    {150, 169, "polar coordinates (G15, G16) are not in this version; write X, Y and Z"},
    {411, 419, "G41.1 is not in this version; enter the offset by G10 D R, then G41 D"},
    {421, 429, "G42.1 is not in this version; enter the offset by G10 D R, then G42 D"},
    {430, 439, "tool length offsets (G43) are not in this version; set Z by G10 L20 P1 Z or G92 Z"},
    {510, 529, "scaling and shifts (G51, G52) are not in this version; use G54 to G59, or G92"},
    {541, 549, "more work offsets (G54.1) are not in this version; there are G54 to G59"},
    {591, 599, "more work offsets (G59.1) are not in this version; there are G54 to G59"},
    {650, 669, "macro calls (G65, G66) are not in this version; write the moves out"},
    {680, 689, "turned coordinates (G68) are not in this version; turn the part in the CAM program"},
    {700, 719, "G70 and G71 are G20 and G21 here; a lathe's cycles are not in this version"},
    {730, 769, "canned cycles (G73 to G76) are not in this version; write the moves out"},
    {810, 899, "canned cycles (G81 to G89) are not in this version; write the moves out"},
    {901, 901, "centres from the zero (G90.1) are not in this version; I, J, K count from the start"},
    {922, 923, "G92.2 and G92.3 are not in this version; G92.1 takes back what G92 has set"},
    {930, 930, "inverse time feed (G93) is not in this version; give the feed per minute (G94)"},
    {960, 969, "constant surface speed (G96) is for lathes, and means nothing here"},
    {381, 389, "the touch-off is G38.2 to G38.5; G38 alone is the periodic jump"},
};

static const g_row *find_code(uint32_t tenths) {
    for (unsigned k = 0; k < sizeof G_ROWS / sizeof *G_ROWS; k++)
        if (G_ROWS[k].tenths == tenths)
            return &G_ROWS[k];
    return 0;
}

static bool refuse_code(fault *f, code_word code) {
    for (unsigned k = 0; k < sizeof REFUSED / sizeof *REFUSED; k++)
        if (code.tenths >= REFUSED[k].first && code.tenths <= REFUSED[k].last)
            return fault_at(f, FAULT_REFUSED, code.column, "%s", REFUSED[k].name);
    return fault_at(f, FAULT_UNKNOWN, code.column, "the code G%u%s is unknown",
                    (uint32_t)code.tenths / 10, code.tenths % 10 ? " with a decimal" : "");
}

void interpreter_unread(const block *b, fault *f) {
    for (unsigned i = 0; i < b->g_count; i++)
        if (!find_code(b->g[i].tenths)) {
            f->code = FAULT_NONE;
            (void)refuse_code(f, b->g[i]);
            return;
        }
}

static bool find_groups(context *c) {
    for (unsigned group = 0; group < G_GROUPS; group++)
        c->g[group] = -1;
    for (unsigned i = 0; i < c->b->g_count; i++) {
        code_word code = c->b->g[i];
        const g_row *row = find_code(code.tenths);
        if (!row)
            return refuse_code(c->f, code);
        if (row->group == G_SILENT) {
            /* In other dialects G50 X Y Z sets the position; here the words would be a motion. */
            if (code.tenths == 500 && c->b->present & AXIS_LETTERS)
                return fault_at(c->f, FAULT_REFUSED, code.column,
                                "G50 with X, Y or Z is not in this version; set a place by G92");
            c->blending = c->blending || code.tenths == 640;
            c->p->after.mode = code.tenths == 800 ? MODE_NONE : c->p->after.mode;
            continue;
        }
        if (c->g[row->group] >= 0)
            return fault_at(c->f, FAULT_MODAL, code.column, "G%u and G%u exclude each other",
                            (uint32_t)c->g[row->group] / 10, (uint32_t)code.tenths / 10);
        c->g[row->group] = (int16_t)code.tenths;
        c->column[row->group] = code.column;
    }
    return true;
}

static bool judge_feed(context *c, uint32_t highest_speed) {
    const word *w = words_take(c, 'F');
    if (!w)
        return true;
    if (!words_speed(c, w, 'F', &c->p->after.feed))
        return false;
    if (c->p->after.feed == 0)
        return fault_at(c->f, FAULT_FEED, w->column, "the feed F must be 0.001 mm/min or more");
    if (c->p->after.feed > highest_speed)
        return fault_at(c->f, FAULT_FEED, w->column, "the feed F is above the machine's %u mm/min",
                        highest_speed / 1000);
    return true;
}

static bool judge_dwell(context *c) {
    const word *ms = words_take(c, 'P'), *seconds = words_take(c, 'X');
    if (!ms == !seconds)
        return fault_at(c->f, ms ? FAULT_CONFLICT : FAULT_MISSING, ms ? ms->column : 0,
                        "G04 needs its time, as P (ms) or X (s)");
    /* A P with decimals is probably meant in seconds, as grbl and LinuxCNC have it. */
    if (ms && ms->number.decimals)
        return fault_at(c->f, FAULT_NUMBER, ms->column,
                        "P of G04 counts whole ms; seconds are written X");
    const word *w = ms ? ms : seconds;
    if (w->negative || !units_clocks(w->number, ms != 0, &c->p->dwell))
        return fault_at(c->f, FAULT_OVERFLOW, w->column, "the time of G04 is out of range");
    return true;
}

static bool judge_condition(context *c) {
    const word *w = words_take(c, 'C');
    c->p->changes_condition = w;
    return !w || words_condition(c, w, &c->p->after.condition);
}

static bool judge_auxiliary(context *c) {
    plan *p = c->p;
    const word *s = words_take(c, 'S'), *t = words_take(c, 'T');
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
        if ((m >= 70 && m <= 73) || m == 98 || m == 99)
            return fault_at(c->f, FAULT_REFUSED, code.column,
                            m < 98 ? "M%u keeps or brings back modal state, which is not in this version"
                                   : "M%u belongs to a subprogram; the controller takes the moves "
                                     "written out", m);
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
            return fault_at(c->f, FAULT_MODAL, code.column,
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
    /* Check again: settings may have changed since the C, and a step of a depth series may be in
       force. */
    const condition_row *unseen = p->changes_condition ? 0 : depth_series_unseen();
    if (!words_seen(c, unseen ? unseen : p->after.condition, machining_column))
        return false;
    return p->changes_condition || in_force_current_kept() ||
           fault_at(c->f, FAULT_CONDITION, machining_column,
                    "M03 needs a C anew: the step of the power supply ($%u) has changed since",
                    settings_number(SET_CURRENT_STEP_MA));
}

static bool judge_table(context *c, bool mdi) {
    if (block_has(c->b, 'C'))
        return gap_words_condition(c, mdi);
    if (block_has(c->b, 'W'))
        return gap_words_class(c);
    if (block_has(c->b, 'D'))
        return path_words_enter_wire(c);
    if (block_has(c->b, 'L') || block_has(c->b, 'P'))
        return path_words_enter_system(c);
    return fault_at(c->f, FAULT_MISSING, 0,
                    "G10 needs a condition C, a class of the fluid W, a wire offset D or a work offset P");
}

/* G94, or G95 with its feed mode. */
static bool judge_feed_mode(context *c) {
    if (c->g[G_FEED] < 0)
        return true;
    bool servo = c->g[G_FEED] == 950;
    c->p->after.servo = FEED_CONSTANT;
    if (c->g[G_ONCE] >= 0 && servo)
        return fault_at(c->f, FAULT_CONFLICT, c->column[G_FEED], "G95 and G%u exclude each other",
                        (uint32_t)c->g[G_ONCE] / 10);
    return !servo || gap_words_feed_mode(words_take(c, 'P'), c->column[G_FEED],
                                         &c->p->after.servo, c->f);
}

/* The feed mode needs references from the condition; check once both are known. */
static bool judge_references(context *c) {
    bool told = c->g[G_FEED] >= 0;
    uint32_t column = told ? c->column[G_FEED] : BLOCK_WORD(c->b, 'C')->column;
    if (!told && !c->p->changes_condition)
        return true;
    return feed_modes_check(c->p->after.servo, c->p->after.condition, column, c->f) &&
           (c->p->changes_condition || depth_series_check_mode(c->p->after.servo, column, c->f));
}

static bool judge_once(context *c, bool mdi, uint32_t highest_speed, const travel_range *t,
                       unsigned jump_axis) {
    if (c->g[G_ONCE] >= 100 && c->g[G_ONCE] <= 380)
        plan_edit(&c->p->after);
    switch (c->g[G_ONCE]) {
    case 40: c->p->act = ACT_DWELL; return judge_dwell(c);
    case 100: c->p->act = ACT_TABLE; return judge_table(c, mdi);
    case 280: return place_words_go(c, 0, highest_speed, t);
    case 300: return place_words_go(c, 1, highest_speed, t);
    case 281: place_words_store(c, 0); return true;
    case 301: place_words_store(c, 1); return true;
    case 360: c->p->act = ACT_RETRACTION; return retraction_words_enter(c, mdi, highest_speed, jump_axis);
    case 370: c->p->act = ACT_DEFAULTS; return retraction_words_defaults(c, highest_speed);
    case 380: c->p->act = ACT_JUMP; return retraction_words_jump(c, highest_speed);
    case 382:
    case 383:
    case 384:
    case 385: return touch_words_take(c, t);
    case 390: c->p->act = ACT_DEPTH_SERIES; return depth_series_words_take(c, jump_axis);
    case 920: c->p->act = ACT_SET_POSITION; return path_words_set_position(c);
    case 921: c->p->act = ACT_SET_POSITION; path_words_forget_position(c); return true;
    default: return true;
    }
}

/* A and B belong to the conditions of G10. Elsewhere they would be axes that the machine does not
   have. */
static bool no_other_axis(context *c) {
    static const char OTHERS[2] = {'A', 'B'};
    if (c->g[G_ONCE] == 100 && block_has(c->b, 'C'))
        return true;
    for (unsigned i = 0; i < sizeof OTHERS; i++)
        if (block_has(c->b, OTHERS[i]))
            return fault_at(c->f, FAULT_UNKNOWN, BLOCK_WORD(c->b, OTHERS[i])->column,
                            "the word %c is unknown", OTHERS[i]);
    return true;
}

bool interpreter_block(const block *b, const modal *state, bool mdi, uint32_t highest_speed,
                const travel_range *t, unsigned jump_axis, plan *p, fault *f) {
    context c = {.b = b, .f = f, .p = p, .before = state, .free = b->present};
    plan_begin(p, state);
    f->block = block_has(b, 'N') ? block_name(b, 'N') : 0;
    words_take(&c, 'N');
    if (words_take(&c, 'O'))
        p->name = block_name(b, 'O');
    if (!find_groups(&c) || !no_other_axis(&c))
        return false;
    if (c.g[G_UNITS] >= 0)
        p->after.inch = c.g[G_UNITS] == 200;
    if (c.g[G_DISTANCE] >= 0)
        p->after.incremental = c.g[G_DISTANCE] == 910;
    if (c.g[G_MOTION] >= 0)
        p->after.mode = (motion_mode)(MODE_RAPID + c.g[G_MOTION] / 10);
    if (c.g[G_SYSTEM] >= 0)
        plan_select_system(&p->after, (unsigned)c.g[G_SYSTEM] / 10 - 54);
    if (c.g[G_ONCE] >= 0 && c.g[G_MOTION] >= 0)
        return fault_at(f, FAULT_CONFLICT, c.column[G_ONCE], "G%u and G%u exclude each other",
                        (uint32_t)c.g[G_MOTION] / 10, (uint32_t)c.g[G_ONCE] / 10);
    if (c.g[G_ONCE] >= 0 && c.g[G_FRAME] >= 0)
        return fault_at(f, FAULT_CONFLICT, c.column[G_ONCE], "G53 and G%u exclude each other",
                        (uint32_t)c.g[G_ONCE] / 10);
    if (c.blending && c.g[G_ONCE] < 0 && c.g[G_FEED] != 950) {
        words_take(&c, 'P'); /* P and Q allow a deviation at corners, which this path never makes */
        words_take(&c, 'Q');
    }
    bool coded = b->g_count || b->m_count || b->present & ~PATH_LETTERS;
    if ((coded && (!path_words_plane(&c) || !path_words_wire(&c, mdi) ||
                   !judge_once(&c, mdi, highest_speed, t, jump_axis) || !judge_feed_mode(&c))) ||
        !judge_feed(&c, highest_speed) ||
        (coded && ((p->act < ACT_TABLE && (!judge_condition(&c) || !judge_references(&c))) ||
                   !judge_auxiliary(&c))) ||
        (c.g[G_ONCE] < 0 && !path_words_move(&c, highest_speed, t)) ||
        (p->act == ACT_TOUCH && !touch_words_check(&c)) ||
        !words_used(&c))
        return false;
    p->move.plane = p->after.plane;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        p->changes_frame = p->changes_frame || p->after.offset[axis] != state->offset[axis];
    p->acts_before = p->act != ACT_NONE || p->changes_condition || p->changes_servo ||
                     p->changes_frame || p->machining_on || p->s >= 0 || p->t >= 0 || p->m[0] >= 0;
    p->acts_after = p->machining_off || p->fluid_off || p->stop != STOP_NONE;
    return true;
}

plan_result interpreter_arc_step(plan *p, const travel_range *t, fault *f) {
    return arc_words_step(p, t, f);
}
