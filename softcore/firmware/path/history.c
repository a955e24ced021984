// SPDX-License-Identifier: Apache-2.0
#include "path/history.h"

#include "base/settings.h"
#include "base/units.h"
#include "base/watch.h"
#include "path/arc.h"

/* Units of a block. A line has one unit: delta (three words) and rate. An arc has the same unit,
   and a second one: centre (two words); plane and sense; length, 0 until it is known. The two
   highest bits of the last word give the kind of a unit, so that blocks can be read in both
   directions. The highest bit of the first word marks a rapid; it is free because a delta is
   shorter than 2**30 pulses. */
typedef struct {
    uint32_t word[4];
} unit;
_Static_assert(sizeof(unit) == PATH_UNIT, "a unit of the ring has no gaps");

enum { LINE, ARC, ARC_SECOND, LINE_AWAY };  /* LINE_AWAY leads away from the work */
#define KIND(word) ((word) >> 30)
#define VALUE(word) ((word) & ((1u << 30) - 1))
#define SENSE 4u            /* bit for counter-clockwise, in the word with the plane */
#define RAPID (1u << 31)
#define DELTA(word) ((int32_t)((word) << 1) >> 1)

#define FACTOR 30           /* fraction bits of an override's factor */

/* An arc that is or becomes ready. There are two, as the two sides of the window need different
   ones. */
typedef struct {
    uint32_t block;
    bool ready;
    unsigned known;             /* 1: the arc is prepared; then one more for each tangent */
    int32_t tangent[2][HAL_AXES];   /* at start and end, 2**-15 */
    uint32_t highest;           /* rate */
    bool tight;
    arc arc;
} bow;

/* Clocks needed to make a piece of an arc, including the other work of the main loop in that time:
   for a piece of a curve, and for a single step of the chain that a small arc is made of. */
#define PIECE_CLOCKS 22000
#define STEP_CLOCKS 5000

#define BOWS 2
#define NO_BLOCK UINT32_MAX

/* Units of the ring, a power of two; the build sets it to what fits into the memory. It does so for
   this source alone. */
#ifndef PATH_RING
#define PATH_RING 8192
#endif

/* A reset does not clear it (link.ld): that would take most of the start, and a unit is written
   before it is read. */
#ifdef __riscv
__attribute__((section(".bss.uncleared")))
#endif
static unit ring[PATH_RING];
static uint32_t oldest, next;   /* ring holds the blocks [oldest, next) */
static int32_t end[HAL_AXES];   /* end point of the last block */
static bow bows[BOWS];
static unsigned last_bow;
static uint32_t feed_percent, rapid_percent;
static uint32_t feed_factor, rapid_factor;

static unit *unit_of(uint32_t number) { return &ring[number % PATH_RING]; }
static bool is_arc(uint32_t block) { return KIND(unit_of(block)->word[3]) == ARC; }
static uint32_t after(uint32_t block) { return block + (is_arc(block) ? 2 : 1); }
static uint32_t before(uint32_t block) {
    return block - (KIND(unit_of(block - 1)->word[3]) == ARC_SECOND ? 2 : 1);
}

void history_forget(uint32_t first) {
    oldest = next = first;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        end[axis] = hal_axis_command(axis);
    for (unsigned i = 0; i < BOWS; i++)
        bows[i].block = NO_BLOCK;
}

uint32_t history_oldest(void) { return oldest; }
uint32_t history_next(void) { return next; }
bool history_empty(void) { return oldest == next; }
bool history_has_room(void) { return next - oldest <= PATH_RING - 2; }

uint32_t history_append(const path_move *move, uint32_t rate, bool rapid, bool away) {
    uint32_t block = next, kind = move->arc ? ARC : away ? LINE_AWAY : LINE;
    unit *u = unit_of(next++);
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        u->word[axis] = (uint32_t)move->delta[axis] & ~RAPID;
        end[axis] += move->delta[axis];
    }
    u->word[0] |= rapid ? RAPID : 0;
    u->word[3] = kind << 30 | rate;
    if (move->arc)
        *unit_of(next++) = (unit){{(uint32_t)move->centre[0], (uint32_t)move->centre[1],
                                   (uint32_t)move->plane | (move->ccw ? SENSE : 0),
                                   (uint32_t)ARC_SECOND << 30}};
    return block;
}

int32_t history_end(unsigned axis) { return end[axis]; }

void history_prepend(unsigned axis, int32_t travel, uint32_t rate) {
    unit *u = unit_of(--oldest);
    *u = (unit){{0, 0, 0, (uint32_t)LINE << 30 | rate}};
    u->word[axis] = (uint32_t)travel & ~RAPID;
}

static uint32_t factor_of(uint32_t percent) {
    return percent == 100 ? 1u << FACTOR : (uint32_t)units_quotient((uint64_t)percent << FACTOR, 100);
}

bool history_override(uint32_t feed, uint32_t rapid) {
    if (feed == feed_percent && rapid == rapid_percent)
        return false;
    feed_percent = feed;
    rapid_percent = rapid;
    feed_factor = factor_of(feed);
    rapid_factor = factor_of(rapid);
    return true;
}

__attribute__((noinline)) static uint32_t scaled(uint32_t rate, uint32_t factor) {
    uint32_t most = settings_highest_rate();
    uint64_t wanted = (uint64_t)rate * factor >> FACTOR;
    return !wanted ? 1 : wanted < most ? (uint32_t)wanted : most;
}

uint32_t history_rate(uint32_t block) {
    const unit *u = unit_of(block);
    uint32_t rate = VALUE(u->word[3]), factor = u->word[0] & RAPID ? rapid_factor : feed_factor;
    return factor == 1u << FACTOR ? rate : scaled(rate, factor);
}

void history_drop(void) { oldest = after(oldest); }

/* Direction of a segment in 2**-15. Keeping 16 bits of the length makes it exact to 2**-14. */
static void direction_of(const hal_segment *move, int32_t direction[HAL_AXES]) {
    uint32_t length = move->length;
    unsigned shift = 0;
    while (length >> shift >= 1u << 16)
        shift++;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        direction[axis] = (int32_t)((uint32_t)(move->delta[axis] / (1 << shift)) * (1u << 15)) /
                          (int32_t)(length >> shift);
}

static uint32_t length_of(const int32_t delta[HAL_AXES]) {
    uint64_t squares = 0;
    unsigned moving = 0;
    uint32_t magnitude = 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        uint32_t part = delta[axis] < 0 ? 0u - (uint32_t)delta[axis] : (uint32_t)delta[axis];
        squares += (uint64_t)part * part;
        magnitude |= part;
        moving += part != 0;
    }
    return moving == 1 ? magnitude : units_root(squares);
}

uint32_t history_oldest_length(void) {
    if (is_arc(oldest))
        return VALUE(unit_of(oldest + 1)->word[3]);
    hal_segment line = {0};
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        line.delta[axis] = DELTA(unit_of(oldest)->word[axis]);
    return length_of(line.delta);
}

/* The highest rate of a line on which no axis exceeds its own; 0 for no bound below the highest. */
static uint32_t line_bound(const hal_segment *line) {
    uint32_t most = settings_highest_rate(), bound = 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t travel = line->delta[axis];
        uint32_t part = travel < 0 ? 0u - (uint32_t)travel : (uint32_t)travel;
        uint64_t room = (uint64_t)settings_axis_rate(axis) * line->length;
        if (room && (uint64_t)part * most > room) {
            most = (uint32_t)units_quotient(room, part);
            bound = most = most ? most : 1;
        }
    }
    return bound;
}

/* That of an arc: the lowest of the axes that it moves, and at most `most`. */
static uint32_t arc_bound(uint32_t block, uint32_t most) {
    move_plane plane = (move_plane)(unit_of(block + 1)->word[2] & ~SENSE);
    unsigned normal = plane == PLANE_XY ? 2 : plane == PLANE_ZX ? 1 : 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        uint32_t own = settings_axis_rate(axis);
        if (own && own < most && (axis != normal || DELTA(unit_of(block)->word[axis])))
            most = own;
    }
    return most;
}

/* The highest rate on an arc. It is limited to the rate at which pieces can be made: the machine
   moves slower and evenly, and need not stop to wait for a piece. */
static uint32_t highest_rate(const arc *a) {
    uint64_t clocks = (uint64_t)arc_pieces(a) * (a->chain ? STEP_CLOCKS : PIECE_CLOCKS);
    uint64_t made = ((uint64_t)arc_length(a) << 32) / clocks;
    uint32_t bent = settings_curve_rate(arc_radius(a));
    return made < bent ? (uint32_t)made : bent;
}

/* The arc of a block if it is ready; 0 after one more step of making it ready. */
static bow *bow_of(uint32_t block) {
    unsigned i = last_bow;
    if (bows[i].block != block)
        i = !i;
    if (bows[i].block != block) {
        const unit *u = unit_of(block), *second = unit_of(block + 1);
        path_move move = {.arc = true, .ccw = second->word[2] & SENSE,
                          .plane = (move_plane)(second->word[2] & ~SENSE),
                          .centre = {(int32_t)second->word[0], (int32_t)second->word[1]}};
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            move.delta[axis] = DELTA(u->word[axis]);
        bows[i].block = block;
        bows[i].ready = false;
        bows[i].known = 0;
        arc_begin(&bows[i].arc, &move);
    }
    last_bow = i;
    bow *b = &bows[i];
    if (b->ready)
        return b;
    if (b->known) {
        arc_direction(&b->arc, b->known - 1, b->tangent[b->known - 1]);
        b->ready = b->known++ == 2;
        return 0;
    }
    if (arc_prepare(&b->arc)) {
        b->known = 1;
        unit *second = unit_of(block + 1);
        second->word[3] = (uint32_t)ARC_SECOND << 30 | arc_length(&b->arc);
        b->highest = arc_bound(block, highest_rate(&b->arc));
        b->tight = b->highest < settings_highest_rate();
    }
    return 0;
}

bool history_ready(path_place at) { return !is_arc(at.block) || bow_of(at.block); }

bool history_make(path_place at, hal_segment *move, path_segment *s) {
    const unit *u = unit_of(at.block);
    *s = (path_segment){.at = at, .rate = history_rate(at.block)};
    if (is_arc(at.block)) {
        bow *b = bow_of(at.block);
        if (!b || !arc_piece_ready(&b->arc, at.piece))
            return false;
        (void)arc_piece(&b->arc, at.piece, move);
        watch_between();
        move->highest = b->highest;
        s->tight = b->tight;
        for (unsigned axis = 0; axis < HAL_AXES; axis++) {
            s->from[axis] = b->tangent[0][axis];
            s->to[axis] = b->tangent[1][axis];
        }
    } else {
        *move = (hal_segment){0};
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            move->delta[axis] = DELTA(u->word[axis]);
        move->length = length_of(move->delta);
        move->highest = line_bound(move);
        s->tight = move->highest != 0;
        move->away = s->away = KIND(u->word[3]) == LINE_AWAY;
    }
    int32_t way[HAL_AXES];
    direction_of(move, way);
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        s->way[axis] = (int8_t)(way[axis] / (1 << 9));
        if (!is_arc(at.block))
            s->from[axis] = s->to[axis] = way[axis];
    }
    move->rate = s->rate;
    s->bound = move->highest;
    if (s->bound && s->rate > s->bound)
        s->rate = s->bound;
    s->length = move->length;
    return true;
}

path_place history_following(path_place at) {
    if (is_arc(at.block)) {
        const bow *b = bow_of(at.block);
        if (b && at.piece + 1 < arc_pieces(&b->arc))
            return (path_place){at.block, at.piece + 1};
    }
    return (path_place){after(at.block), 0};
}

bool history_preceding(path_place *at) {
    if (at->piece) {
        at->piece--;
        return true;
    }
    path_place to = {before(at->block), 0};
    if (is_arc(to.block)) {
        const bow *b = bow_of(to.block);
        if (!b)
            return false;
        to.piece = arc_pieces(&b->arc) - 1;
    }
    *at = to;
    return true;
}
