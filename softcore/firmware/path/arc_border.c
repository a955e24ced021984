// SPDX-License-Identifier: Apache-2.0
#include "path/arc_border.h"

#define HOPELESS (1 << 20)         /* `lacks` of a place that cannot be used */

SHARED int64_t arc_border_square_of(int32_t x, int32_t y) { return (int64_t)x * x + (int64_t)y * y; }

SHARED int32_t arc_border_fine_at(const arc *a, unsigned i, int32_t pulses) {
    return a->start[i] + pulses * MOVE_FINE;
}

int64_t arc_border_length_to(const arc *a, int64_t angle, int64_t radius) {
    int64_t length = fixed_product(fixed_scaled(a->radius[0] + radius, 14), angle);
    length = fixed_product(length, FIXED_PI) >> 12;
    /* A changing radius makes the curve longer by half the square of the slope. */
    return length + (length >> 14) * (a->slope * a->slope >> 30) / ((int64_t)1 << 17);
}

int64_t arc_border_part_angle(const arc *a) { return FIXED_TURN / 8 >> a->parts; }

/* Path length up to a place at the length `plane` in the plane. */
static int64_t path_to(const arc *a, int64_t plane) {
    if (a->total == a->plane)
        return plane;
    plane = plane < 0 ? 0 : plane < a->plane ? plane : a->plane;
    return fixed_product(a->total << 10, fixed_fraction(plane, &a->by_plane)) >> 10;
}

unsigned arc_border_major_of(unsigned eighth) { return (eighth + 1) & 2 ? 0 : 1; }
int32_t arc_border_travel_of(unsigned eighth, unsigned axis) {
    return ((eighth + (axis ? 2 : 4)) & 7) < 4 ? 1 : -1;
}

SHARED int64_t arc_border_error_at(const arc *a, const int32_t at[2], int64_t square) {
    int32_t x = arc_border_fine_at(a, 0, at[0]), y = arc_border_fine_at(a, 1, at[1]);
    return (arc_border_square_of(x, y) - square) / MOVE_FINE;
}

int arc_border_neighbour(const arc *a, const int32_t at[2], unsigned axis, int64_t square) {
    int64_t error = arc_border_error_at(a, at, square);
    int64_t from = fixed_magnitude(arc_border_fine_at(a, axis, at[axis]));
    if (error + from + MOVE_FINE / 4 < 0)
        return 1;
    return error - from + MOVE_FINE / 4 >= 0 ? -1 : 0;
}

/* Move a place along `axis` to the one nearest to the curve. */
static void settle(const arc *a, int32_t at[2], unsigned axis, int64_t square) {
    for (unsigned tries = 0; tries < 8; tries++) {
        int off = arc_border_neighbour(a, at, axis, square);
        if (!off)
            return;
        at[axis] += arc_border_fine_at(a, axis, at[axis]) < 0 ? -off : off;
    }
}

static int32_t magnitude_of(int64_t tangent) {
    int64_t size = fixed_magnitude(tangent);
    return (int32_t)(size < 1 << 30 ? size : 1 << 30);
}

/* Set the tangent of a border whose place is `along` further along the curve than the ideal one. */
static void turn_on(const arc *a, int64_t along, arc_border *b) {
    const arc_ideal *p = &a->ideal;
    int64_t angle = (int32_t)along / (int32_t)(p->radius >> PULSE_BITS);
    int64_t turned[2] = {-angle * p->tangent[1], angle * p->tangent[0]};
    for (unsigned i = 0; i < 2; i++)
        b->tangent[i] = magnitude_of(p->tangent[i] + (turned[i] >> PULSE_BITS));
}

/* Distance of a place from the ideal one, along an axis of the plane. */
static int64_t off_along(const arc *a, const arc_ideal *p, const int32_t at[2], unsigned axis) {
    return fixed_scaled(arc_border_fine_at(a, axis, at[axis]), FINE_BITS) - p->at[axis];
}

/* How much further along the curve than the ideal place the curve passes this major coordinate. */
static int32_t passes(const arc *a, const arc_ideal *p, const int32_t at[2], unsigned major) {
    int32_t slant = (1 << 29) / (int32_t)(p->tangent[major] >> 16);
    return (int32_t)(off_along(a, p, at, major) * slant >> 15);
}

/* The square of the radius at a place. Along the curve it grows with the product of radius and
   slope. This product is the same everywhere; the slope is the one at the mean radius. */
static int64_t square_at(const arc *a, const arc_ideal *p, const int32_t at[2], unsigned major) {
    if (!a->slope)
        return p->square;
    int64_t mean = (a->radius[0] + a->radius[1]) >> (FINE_BITS + 1);
    int64_t grown = mean * (a->slope * passes(a, p, at, major) >> 30);
    return p->square + fixed_rounded(grown, FINE_BITS - 1 + 6) * MOVE_FINE;
}

static int64_t foot_of(const arc *a, const arc_ideal *p, const int32_t at[2]) {
    return (off_along(a, p, at, 0) * p->tangent[0] + off_along(a, p, at, 1) * p->tangent[1]) >> 30;
}

/* Change the square of the radius a little so that the place becomes the nearest one along an axis.
   Returns the change in units of the error. */
static int64_t yield(const arc *a, const int32_t at[2], unsigned axis, int64_t *square) {
    int off = arc_border_neighbour(a, at, axis, *square);
    int64_t error = arc_border_error_at(a, at, *square);
    int64_t from = fixed_magnitude(arc_border_fine_at(a, axis, at[axis]));
    int64_t much = off > 0   ? error + from + MOVE_FINE / 4
                   : off < 0 ? error - from + MOVE_FINE / 4 + 1
                             : 0;
    *square += much * MOVE_FINE;
    return fixed_magnitude(much);
}

/* From a place on the diagonal, forward (`way` 1) or back (-1), the minor axis must not need two
   steps for one of the major axis. Change the square of the radius a little where it would. After
   the third step the curve is flat enough. Returns the change in units of the error. Where the
   radius changes, a piece follows it to about 1/50 pulse; a margin allows for this. */
static int64_t flatten(const arc *a, const arc_ideal *p, const int32_t from[2],
                       const int32_t travel[2], unsigned major, int32_t way, int64_t *square) {
    unsigned minor = !major;
    int32_t at[2] = {from[0], from[1]};
    int64_t base = square_at(a, p, from, major), changed = 0;
    for (unsigned step = 0; step < 3; step++) {
        for (unsigned axis = 0; axis < 2; axis++)
            at[axis] += way * travel[axis];
        int32_t place = arc_border_fine_at(a, minor, at[minor]);
        int64_t error = arc_border_error_at(a, at, square_at(a, p, at, major) + (*square - base));
        int64_t half = fixed_magnitude(place), margin = a->slope ? half / 24 : 0;
        bool outwards = (place < 0) == (way * travel[minor] < 0);
        error += MOVE_FINE / 4;
        int64_t spare = (outwards ? error + half : half - error - 1) - margin;
        if (spare < 0) {
            /* Change by a little more: from here on the change is reduced by whole units per
               step. */
            spare += spare / 4 - 4;
            *square += (outwards ? spare : -spare) * MOVE_FINE;
            changed -= spare;
        }
    }
    return changed;
}

/* Is a place so much nearer to the curve than its neighbours that weigh() has nothing to change? In
   three steps along a diagonal, from where the axes exchange their roles, the error changes by less
   than DRIFT. */
#define DRIFT 3300
static bool comfortable(const arc *a, const arc_border *b) {
    int64_t x = fixed_magnitude(arc_border_fine_at(a, 0, b->at[0]));
    int64_t y = fixed_magnitude(arc_border_fine_at(a, 1, b->at[1]));
    int64_t error = fixed_magnitude(arc_border_error_at(a, b->at, b->square[0]));
    int64_t other = fixed_magnitude(arc_border_error_at(a, b->at, b->square[1]));
    int64_t least = x < y ? x : y;
    return (error > other ? error : other) + DRIFT + least / 12 < least;
}

/* Distance of a path length from a whole number of pulses. */
static int32_t off_whole(int64_t path) {
    return (int32_t)fixed_magnitude(path - fixed_scaled(fixed_rounded(path, PULSE_BITS), PULSE_BITS));
}

/* Where the axes exchange their roles, before `eighth`, the border's place must be the nearest one
   along both axes, and no step may be left out. Places along the diagonal are tried, first those
   whose path length is nearly a whole number: one of five is within 1/8. The curve may pass
   half-way between places again and again, so that none of the tried ones is right. Then one is
   taken that lacks little: about a pulse divided by the radius. */
#define DIAGONAL 2
#define TRIES 5
#define ENOUGH (PULSE / 7)          /* allowed distance of the path length from a whole number */
/* Weight of a unit of `lacks` against the path length. With two or more pieces between the points
   where axes reverse, a place that lacks something stays far from half a pulse off, so even speed
   matters more. */
#define LACKING(a) ((a)->parts < 2 ? PULSE / 32 : PULSE / 1024)

/* Choose the place along the diagonal to be tried next; returns its distance in diagonal steps. */
static int32_t next_try(arc *a) {
    const arc_ideal *p = &a->ideal;
    int64_t foot = p->plane + foot_of(a, p, a->half.at);
    int64_t path = path_to(a, foot);
    int64_t step = path_to(a, foot + ((fixed_magnitude(p->tangent[0]) +
                                       fixed_magnitude(p->tangent[1])) >> (30 - PULSE_BITS))) - path;
    int32_t best = 0, least = INT32_MAX;
    int32_t room = a->room ? DIAGONAL : 1;
    for (int32_t i = -room; i <= room; i++) {
        int32_t off = off_whole(path + i * step);
        if (!(a->tried >> (DIAGONAL + i) & 1) && off < least) {
            least = off;
            best = i;
        }
    }
    a->tried |= 1u << (DIAGONAL + best);
    return best;
}

/* Find the candidate for the next try. */
static void seek(arc *a, unsigned eighth) {
    const arc_ideal *p = &a->ideal;
    if (!a->tried)
        settle(a, a->half.at, 1, square_at(a, p, a->half.at, 0));
    arc_border c = a->half;
    int32_t way = next_try(a);
    for (unsigned axis = 0; axis < 2; axis++)
        c.at[axis] += way * arc_border_travel_of(eighth, axis);
    c.square[0] = square_at(a, p, c.at, 0);
    int32_t before = c.at[1];
    settle(a, c.at, 1, c.square[0]);
    a->half.at[1] += c.at[1] - before; /* continue on the diagonal that is nearer to the curve */
    c.square[1] = square_at(a, p, c.at, 1);
    a->candidate = c;
}

/* Find what the candidate lacks. */
static void weigh(arc *a, unsigned eighth) {
    const arc_ideal *p = &a->ideal;
    unsigned major = arc_border_major_of(eighth);
    int32_t travel[2] = {arc_border_travel_of(eighth, 0), arc_border_travel_of(eighth, 1)};
    arc_border *c = &a->candidate;
    a->lacks = 0;
    if (comfortable(a, c))
        return;
    a->lacks = yield(a, c->at, 0, &c->square[1]);
    a->lacks += flatten(a, p, c->at, travel, !major, -1, &c->square[!major]);
    a->lacks += flatten(a, p, c->at, travel, major, 1, &c->square[major]);
    if (a->lacks && (arc_border_neighbour(a, c->at, 1, c->square[0]) ||
                     arc_border_neighbour(a, c->at, 0, c->square[1])))
        a->lacks += HOPELESS;
}

/* Keep the candidate if it is the best so far. True if no further try is needed. */
static bool judge(arc *a) {
    const arc_ideal *p = &a->ideal;
    arc_border c = a->candidate;
    int64_t along = foot_of(a, p, c.at), foot = path_to(a, p->plane + along);
    int64_t off = off_whole(foot) + a->lacks * LACKING(a);
    if (off < a->off) {
        a->off = off;
        a->path = foot;
        turn_on(a, along, &c);
        a->best = c;
    }
    return ++a->tries == TRIES || a->off <= ENOUGH;
}

/* A border at which no axis reverses and the axes keep their roles may be moved by a few pulses, to
   where its path length is nearly a whole number. */
#define CLOSE (PULSE / 16)
static void make_whole(const arc *a, arc_border *b, unsigned eighth) {
    const arc_ideal *p = &a->ideal;
    unsigned major = arc_border_major_of(eighth), minor = !major;
    int32_t travel = arc_border_travel_of(eighth, major);
    int32_t to_end = (int32_t)((a->plane - p->plane) >> PULSE_BITS);
    int32_t to_start = (int32_t)(p->plane >> PULSE_BITS);
    int32_t room = (to_end < to_start ? to_end : to_start) / 2;
    room = room < (int32_t)a->room ? room : (int32_t)a->room;
    int32_t next[2] = {b->at[0], b->at[1]};
    next[major] += travel;
    int64_t path = path_to(a, p->plane + passes(a, p, b->at, major));
    int64_t step = path_to(a, p->plane + passes(a, p, next, major)) - path;
    int32_t least = off_whole(path), best = 0;
    for (int32_t i = 1; i <= room && least > CLOSE; i++) {
        for (int32_t way = -i; way <= i; way += 2 * i) {
            int32_t off = off_whole(path + way * step);
            if (off < least) {
                least = off;
                best = way;
            }
        }
    }
    int32_t across = (int32_t)(p->tangent[minor] >> 15) * best * travel;
    b->at[major] += best * travel;
    b->at[minor] += across / (int32_t)(p->tangent[major] >> 15);
}

/* The curve at border number `index`: 0 is the start, the number of pieces is the end. */
static arc_border curve_at(const arc *a, uint32_t index, arc_ideal *ideal) {
    arc_border b = {0};
    bool ends = index == a->pieces;
    uint32_t multiple = a->first + index - 1;
    int64_t turned = 0, part = FIXED_ONE;
    if (ends) {
        turned = a->turn;
    } else if (index) {
        turned = (int64_t)((uint64_t)multiple * (uint64_t)arc_border_part_angle(a) - (uint64_t)a->bend);
        part = fixed_fraction(turned, &a->by_turn);
    } else {
        part = 0;
    }
    int64_t swept = turned + fixed_product(a->lead[1] - a->lead[0], part), sine, cosine;
    int64_t angle = (int64_t)(((uint64_t)a->angle + (uint64_t)swept) % (uint64_t)FIXED_TURN);
    fixed_sine_cosine(angle, &sine, &cosine);
    int64_t slope = fixed_scaled(a->slope, 32);
    arc_ideal p = {.tangent = {(-sine + fixed_product(slope, cosine)) >> 32,
                               (cosine + fixed_product(slope, sine)) >> 32}};
    for (unsigned i = 0; i < 2; i++)
        b.tangent[i] = magnitude_of(p.tangent[i]);
    if (!index || ends) {
        b.square[0] = b.square[1] = a->square[ends];
        b.at[0] = ends ? a->to[0] : 0;
        b.at[1] = ends ? a->to[1] : 0;
        b.length = ends ? a->length : 0;
        return b;
    }
    int64_t change = a->radius[1] - a->radius[0];
    p.radius = a->radius[0] + fixed_product(change, part);
    p.plane = arc_border_length_to(a, swept, p.radius);
    /* The square of a linearly changing radius; its remainder by MOVE_FINE stays that of the
       start. */
    int64_t bow = (change >> 8) * (change >> 8) >> 16;
    int64_t grown = fixed_product(a->square[1] - a->square[0], part) -
                    fixed_product(fixed_product(bow << 2, part), FIXED_ONE - part) / 4;
    p.square = a->square[0] + fixed_rounded(grown, 6) * MOVE_FINE;
    p.at[0] = fixed_product(p.radius, cosine);
    p.at[1] = fixed_product(p.radius, sine);
    for (unsigned i = 0; i < 2; i++)
        b.at[i] = (int32_t)fixed_rounded(p.at[i] - fixed_scaled(a->start[i], FINE_BITS),
                                         PULSE_BITS);
    *ideal = p;
    return b;
}

/* Find the place next to the curve for a border between start and end; true when it is found. Each
   call is one step: seek a place, weigh it (where the axes exchange their roles), or judge it. */
static bool place_at(arc *a, uint32_t index, arc_border *b) {
    const arc_ideal *p = &a->ideal;
    uint32_t multiple = a->first + index - 1;
    unsigned eighth = multiple >> a->parts;
    bool turns = multiple == eighth << a->parts, changes = turns && eighth & 1;
    int64_t path;
    switch (a->steps_done++) {
    case 0:
        if (changes)
            seek(a, eighth);
        else if (!turns)
            make_whole(a, &a->half, eighth);
        return false;
    case 1:
        if (changes) {
            weigh(a, eighth);
            return false;
        }
        break;
    default:
        break;
    }
    a->steps_done = 0;
    if (changes) {
        if (!judge(a))
            return false;
        *b = a->best;
        path = a->path;
    } else {
        unsigned major = arc_border_major_of(eighth);
        *b = a->half;
        b->square[major] = square_at(a, p, b->at, major);
        settle(a, b->at, !major, b->square[major]);
        int32_t along = passes(a, p, b->at, major);
        turn_on(a, along, b);
        path = path_to(a, p->plane + along);
    }
    b->length = (uint32_t)fixed_rounded(path, PULSE_BITS);
    return true;
}

bool arc_border_step(arc *a, uint32_t index, arc_border *b) {
    if (a->half_of != index) {
        a->half = curve_at(a, index, &a->ideal);
        a->half_of = index;
        a->tried = a->tries = 0;
        a->steps_done = 0;
        a->off = INT64_MAX;
        return false;
    }
    *b = a->half;
    if (index && index != a->pieces && !place_at(a, index, b))
        return false;
    a->half_of = NO_BORDER;
    return true;
}
