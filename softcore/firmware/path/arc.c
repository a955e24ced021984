// SPDX-License-Identifier: Apache-2.0
#include "path/arc.h"

#include "base/units.h"
#include "base/watch.h"
#include "path/arc_border.h"

/* 45 degrees are cut into two pieces, and from this radius (pulses) on into four. The speed of the
   major axis changes linearly over a piece; this moves a place by at most 1/30 pulse (radius *
   angle**3 / 125), in addition to the effect of the borders' rounding. */
#define QUARTERS 64
#define PIECE_BITS 20               /* a piece has at most 2**20 path pulses */
#define LEAST_BITS 4                /* and at least 2**4, except on the strongest spirals */
#define ROOM 8                      /* borders are moved by at most this many pulses */
#define ROOM_BITS 3                 /* and by at most 2**-3 of a piece */

/* A border closer to the start or the end than this many path pulses is left out. */
#define NEAR 2

/* Square root to 2**-16. */
static int64_t root_of(int64_t square) {
    int64_t whole = units_root((uint64_t)square);
    return (whole << FINE_BITS) + fixed_scaled(square - whole * whole, FINE_BITS - 1) / whole;
}

uint32_t arc_pieces(const arc *a) { return a->pieces; }
uint32_t arc_length(const arc *a) { return a->length; }
uint32_t arc_radius(const arc *a) {
    int64_t least = a->radius[0] < a->radius[1] ? a->radius[0] : a->radius[1];
    return (uint32_t)(least >> PULSE_BITS);
}

void arc_begin(arc *a, const path_move *move) {
    static const uint8_t axes[3][3] = {{0, 1, 2}, {2, 0, 1}, {1, 2, 0}};
    *a = (arc){.move = *move, .memo_of = {NO_BORDER, NO_BORDER}, .half_of = NO_BORDER};
    for (unsigned i = 0; i < 3; i++)
        a->axis[i] = axes[move->plane][i];
    for (unsigned i = 0; i < 2; i++) {
        int32_t sign = i && !move->ccw ? -1 : 1;
        a->to[i] = sign * move->delta[a->axis[i]];
        a->start[i] = -sign * move->centre[i];
        a->end[i] = arc_border_fine_at(a, i, a->to[i]);
    }
}

/* How far the tangent turns outwards where the radius is radius[i]: the arc tangent of the radius'
   growth per radian divided by the radius. */
static int64_t lead_at(const arc *a, unsigned i) {
    int64_t other = a->radius[!i], own = a->radius[i];
    /* slope * mean radius / own radius, 2**-30 */
    int64_t t = a->slope + a->slope * ((other - own) / 2 >> 16) / (own >> 16);
    t -= ((t * t >> 30) * t >> 30) / 3;
    return fixed_product(fixed_scaled(t, 32), FIXED_PER_RADIAN);
}

/* Is the spiral so strong that the places of a piece of this length would leave the curve? The
   limit is six times the first term of k in arc.h, with a margin for borders that lie a little
   off. */
#define EIGHTH 843314857            /* of a turn, radian, 2**-30 */
#define LEANING (PULSE / 13)
static bool leans(const arc *a, int64_t length) {
    int64_t slope = fixed_magnitude(a->slope);
    int64_t grown = (length >> FINE_BITS) * slope >> FINE_BITS;
    return grown * ((EIGHTH >> a->parts) + 2 * slope) >> (60 - 2 * FINE_BITS) > LEANING;
}

/* Decide how finely 45 degrees are cut. The square of the radius changes linearly with the major
   coordinate, so the radius may change by at most a pulse in a piece, and by at most a quarter if
   the piece stays longer than 2**LEAST_BITS. If that is not enough, pieces are cut further, down to
   a few path pulses. */
static void cut(arc *a) {
    int64_t mean = (a->radius[0] + a->radius[1]) / 2;
    int64_t pulses = mean >> PULSE_BITS;
    a->parts = pulses < QUARTERS ? 1 : 2;
    /* FIXED_PI, read in units of 2**-62 and not 2**-60, is a quarter of pi. */
    int64_t eighth = fixed_product(mean << 14, FIXED_PI) >> 14;
    if (a->slope) {
        int64_t even = ((int64_t)1 << (30 + PULSE_BITS)) / fixed_magnitude(a->slope);
        while (eighth >> a->parts > even / 4 && eighth >> (a->parts + LEAST_BITS) > PULSE)
            a->parts++;
        while (eighth >> a->parts > even)
            a->parts++;
        while (leans(a, eighth >> a->parts))
            a->parts++;
    }
    int64_t longest = fixed_product(PULSE << PIECE_BITS, fixed_ratio(a->plane, a->total));
    while (eighth >> a->parts > longest && eighth >> (a->parts + LEAST_BITS + 1) > PULSE)
        a->parts++;
    int64_t room = eighth >> (a->parts + PULSE_BITS + ROOM_BITS);
    a->room = (unsigned)(room < ROOM ? room : ROOM);
}

/* Keep a border. `other` is the other end of the piece that it is made for, and is not
   overwritten. */
static void remember(arc *a, uint32_t index, uint32_t other, const arc_border *b) {
    unsigned i = a->memo_of[0] == other;
    a->memo[i] = *b;
    a->memo_of[i] = index;
}

static const arc_border *border(arc *a, uint32_t index, uint32_t other) {
    for (;;) {
        for (unsigned i = 0; i < 2; i++)
            if (a->memo_of[i] == index)
                return &a->memo[i];
        arc_border b;
        if (arc_border_step(a, index, &b))
            remember(a, index, other, &b);
    }
}

#define SMALLEST (6 * MOVE_FINE << 8) /* radius, 2**-8 of a fine pulse */

/* The growth over the angle whose tangent is across / along, exact to 0.005 radian. */
static int64_t grown_in(int64_t growth, int32_t across, int32_t along) {
    bool steep = across > along;
    int64_t a = steep ? along : across, b = steep ? across : along;
    int64_t grown = growth ? growth * a * b / (b * b + a * a * 9 / 32) : 0;
    return steep ? growth * 355 / 226 - grown : grown;
}

/* Choose the next step of a chain: of the places ahead, the one nearest to the curve. A call tries
   only PLACES_A_CALL of them, as each needs a root and two divisions. */
#define PLACES_A_CALL 2

static enum { STEP_SOUGHT, STEP_CHOSEN, STEP_LAST } choose_step(arc *a) {
    int32_t x = arc_border_fine_at(a, 0, a->place[0]), y = arc_border_fine_at(a, 1, a->place[1]);
    int32_t slope = (int32_t)(a->slope >> 14);
    int32_t along[2] = {-y * (1 << 16) + slope * x, x * (1 << 16) + slope * y};
    unsigned major = fixed_magnitude(along[0]) >= fixed_magnitude(along[1]) ? 0 : 1;
    int32_t ahead[2] = {a->to[0] - a->place[0], a->to[1] - a->place[1]};
    int64_t remainder = a->sweep - a->done;
    int64_t left = fixed_product(fixed_product(a->radius[1] << 14, remainder), FIXED_PI) >> 11;
    a->pieces += !a->tried;
    int8_t *step = a->steps[a->pieces - 1];
    bool last = a->pieces == ARC_CHAIN ||
                (fixed_magnitude(ahead[0]) <= 1 && fixed_magnitude(ahead[1]) <= 1 &&
                 left < 9 * PULSE / 4);
    a->off = a->tried ? a->off : INT64_MAX;
    int64_t radius = (a->radius[0] + fixed_product(a->radius[1] - a->radius[0],
                                             fixed_fraction(a->done, &a->by_turn))) >> 8;
    int64_t most = fixed_magnitude(along[major]);
    int64_t growth = (a->slope >> 14) * ((a->radius[0] + a->radius[1]) >> 9) / (1 << 16);
    unsigned looked = 0;
    for (; !last && a->tried < 9; a->tried++) {
        if (looked == PLACES_A_CALL)
            return STEP_SOUGHT;
        int32_t to[2] = {(int32_t)a->tried / 3 - 1, (int32_t)a->tried % 3 - 1};
        int64_t way = (int64_t)along[0] * to[0] + (int64_t)along[1] * to[1];
        /* Only on a circle hardly larger than a pulse, a step may go along the minor axis alone. */
        if (way <= most / 4 || (!to[major] && radius >= SMALLEST))
            continue;
        looked++;
        /* The radius of the curve after the step, by the angle that the step turns. */
        int32_t sine = x * to[1] - y * to[0];
        int32_t cosine = (x * x + y * y) / MOVE_FINE + x * to[0] + y * to[1];
        int64_t wanted = radius + grown_in(growth, sine, cosine);
        uint64_t square = (uint64_t)arc_border_square_of(x + to[0] * MOVE_FINE, y + to[1] * MOVE_FINE);
        int64_t off = fixed_magnitude((int64_t)units_root(square << 16) - wanted);
        if (off < a->off) {
            a->off = off;
            step[0] = (int8_t)to[0];
            step[1] = (int8_t)to[1];
        }
    }
    if (last) {
        step[0] = (int8_t)ahead[0];
        step[1] = (int8_t)ahead[1];
    }
    a->tried = 0;
    return last ? STEP_LAST : STEP_CHOSEN;
}

/* Make the step: find its end and how far it goes along the curve. */
static void make_step(arc *a) {
    const int8_t *step = a->steps[a->pieces - 1];
    for (unsigned i = 0; i < 2; i++)
        a->place[i] = (int16_t)(a->place[i] + step[i]);
    int64_t reached = fixed_angle_of(arc_border_fine_at(a, 0, a->place[0]),
                                     arc_border_fine_at(a, 1, a->place[1]));
    int64_t turned = reached - a->reached;
    a->done += turned < -FIXED_TURN / 2  ? turned + FIXED_TURN
               : turned > FIXED_TURN / 2 ? turned - FIXED_TURN
                                         : turned;
    a->reached = reached;
}

static uint32_t third_of(const arc *a) {
    return (uint32_t)fixed_magnitude(a->move.delta[a->axis[2]]);
}

static void measure(arc *a) {
    int64_t third = (int64_t)third_of(a) << PULSE_BITS;
    a->total = a->plane;
    if (third) {
        unsigned shift = 0;
        while ((third | a->plane) >> shift >= (int64_t)1 << 31)
            shift++;
        int64_t plane = a->plane >> shift;
        third >>= shift;
        a->total = (int64_t)units_root((uint64_t)(plane * plane + third * third)) << shift;
        if (a->total < a->plane)
            a->total = a->plane;
    }
    a->length = (uint32_t)fixed_rounded(a->total, PULSE_BITS);
    if (a->length < third_of(a))
        a->length = third_of(a);
}

/* Radii at both ends. */
static arc_phase prepare_radii(arc *a) {
    a->square[0] = arc_border_square_of(a->start[0], a->start[1]);
    a->square[1] = arc_border_square_of(a->end[0], a->end[1]);
    a->radius[0] = root_of(a->square[0]);
    a->radius[1] = root_of(a->square[1]);
    a->chain = arc_radius(a) < ARC_LEAST_RADIUS;
    return ARC_START_ANGLE;
}

static arc_phase prepare_start_angle(arc *a) {
    a->angle = a->reached = fixed_angle_of(a->start[0], a->start[1]);
    return ARC_SWEEP;
}

/* The angle to the end, and the length of the curve. The slope of the radius makes it a little
   longer. */
static arc_phase prepare_sweep(arc *a) {
    a->sweep = fixed_angle_of(a->end[0], a->end[1]) - a->angle;
    if (a->sweep <= 0)
        a->sweep += FIXED_TURN;
    a->plane = arc_border_length_to(a, a->sweep, a->radius[1]);
    a->slope = (a->radius[1] - a->radius[0]) * ((int64_t)1 << 30) / a->plane;
    a->plane = arc_border_length_to(a, a->sweep, a->radius[1]);
    return ARC_TANGENTS;
}

static arc_phase prepare_tangents(arc *a) {
    if (a->slope) {
        a->lead[0] = lead_at(a, 0);
        a->lead[1] = lead_at(a, 1);
    }
    a->bend = a->angle - a->lead[0];
    a->bend += a->bend < 0 ? FIXED_TURN : 0;
    a->turn = a->sweep - (a->lead[1] - a->lead[0]);
    measure(a);
    return ARC_DIVISOR;
}

static arc_phase prepare_divisor(arc *a) {
    a->by_turn = fixed_divisor_of(a->chain ? a->sweep : a->turn);
    return a->chain ? ARC_CHOOSE_STEP : ARC_PLANE_DIVISOR;
}

/* A small arc becomes a chain of single steps. */
static arc_phase prepare_step(arc *a) {
    switch (choose_step(a)) {
    case STEP_SOUGHT: return ARC_CHOOSE_STEP;
    case STEP_CHOSEN: return ARC_MAKE_STEP;
    default: return ARC_CHAIN_LENGTH;
    }
}

/* Any other arc is cut where the tangent has turned by a multiple of a part of 45 degrees. */
static arc_phase prepare_pieces(arc *a) {
    cut(a);
    a->first = (uint32_t)(a->bend / arc_border_part_angle(a)) + 1;
    a->pieces = (uint32_t)(((uint64_t)a->bend + (uint64_t)a->turn) /
                           (uint64_t)arc_border_part_angle(a)) - a->first + 2;
    return ARC_NEAR_START;
}

/* Leave out the borders that are too close to the start. */
static arc_phase prepare_near_start(arc *a) {
    arc_border b;
    if (a->pieces <= 1)
        return ARC_NEAR_END;
    if (!arc_border_step(a, 1, &b))
        return ARC_NEAR_START;
    if (b.length >= NEAR)
        return ARC_NEAR_END;
    a->first++;
    a->pieces--;
    return ARC_NEAR_START;
}

/* Leave out the borders that are too close to the end. */
static arc_phase prepare_near_end(arc *a) {
    arc_border b;
    if (a->pieces <= 1)
        return ARC_ROLES;
    if (!arc_border_step(a, a->pieces - 1, &b))
        return ARC_NEAR_END;
    if (b.length + NEAR <= a->length)
        return ARC_ROLES;
    a->pieces--;
    return ARC_NEAR_END;
}

bool arc_prepare(arc *a) {
    switch (a->phase) {
    case ARC_RADII: a->phase = prepare_radii(a); break;
    case ARC_START_ANGLE: a->phase = prepare_start_angle(a); break;
    case ARC_SWEEP: a->phase = prepare_sweep(a); break;
    case ARC_TANGENTS: a->phase = prepare_tangents(a); break;
    case ARC_DIVISOR: a->phase = prepare_divisor(a); break;
    case ARC_CHOOSE_STEP: a->phase = prepare_step(a); break;
    case ARC_MAKE_STEP:
        make_step(a);
        a->phase = ARC_CHOOSE_STEP;
        break;
    case ARC_PLANE_DIVISOR:
        a->by_plane = fixed_divisor_of(a->plane);
        a->phase = ARC_PIECES;
        break;
    case ARC_PIECES: a->phase = prepare_pieces(a); break;
    case ARC_NEAR_START: a->phase = prepare_near_start(a); break;
    case ARC_NEAR_END: a->phase = prepare_near_end(a); break;
    case ARC_CHAIN_LENGTH:
        a->length = a->length < a->pieces ? a->pieces : a->length;
        return true;
    case ARC_ROLES:
        if (a->pieces == 1) /* its middle decides the roles of the axes */
            a->first = (uint32_t)(((uint64_t)a->bend + (uint64_t)a->turn / 2) /
                                  (uint64_t)arc_border_part_angle(a)) + 1;
        return true;
    }
    return false;
}

/* a * b / c to the nearest; b at most c. */
SHARED static uint32_t share(uint32_t a, uint32_t b, uint32_t c) {
    return (uint32_t)((2 * (uint64_t)a * b + c) / (2 * (uint64_t)c));
}

static void share_third(const arc *a, uint32_t from, hal_segment *piece) {
    uint32_t third = third_of(a);
    if (!third)
        return;
    int32_t steps = (int32_t)(share(third, from + piece->length, a->length) -
                              share(third, from, a->length));
    piece->delta[a->axis[2]] = a->move.delta[a->axis[2]] < 0 ? -steps : steps;
}

static int32_t outer_sign(const arc *a, unsigned axis) { return axis && !a->move.ccw ? -1 : 1; }

static uint32_t chain_piece(const arc *a, uint32_t index, hal_segment *piece) {
    uint32_t from = share(a->length, index, a->pieces);
    piece->length = share(a->length, index + 1, a->pieces) - from;
    for (unsigned i = 0; i < 2; i++)
        piece->delta[a->axis[i]] = outer_sign(a, i) * a->steps[index][i];
    share_third(a, from, piece);
    return from;
}

/* Set the pace of the major axis: it makes `steps` in the piece, and becomes faster or slower as
   the tangent turns. */
static void set_pace(const arc *a, hal_segment *piece, uint32_t steps, int32_t turns) {
    uint32_t n = piece->length;
    while (piece->shift < 15 && n << (piece->shift + 1) < 1u << 30)
        piece->shift++;
    if (a->total != a->plane)
        turns = (int32_t)(turns * (a->plane >> 22) / (a->total >> 22));
    int32_t change = turns / (1 << (30 - piece->shift));
    /* The pace stays between standstill and a step with every pulse. */
    uint32_t room = (steps < n - steps ? steps : n - steps) << piece->shift;
    int32_t most = (int32_t)(2 * room / (n + 1));
    change = change > most ? most : change < -most ? -most : change;
    if (change & 1 && !(n & 1))
        change += change < 0 ? 1 : -1;
    piece->change = change;
    int32_t half = change & 1 ? change * (int32_t)((n - 1) / 2) : change / 2 * (int32_t)(n - 1);
    piece->start.pace = (steps << piece->shift) - (uint32_t)half;
    piece->end.pace = piece->start.pace + (uint32_t)change * n;
}

bool arc_piece_ready(arc *a, uint32_t index) {
    for (unsigned i = 0; i < 2 && !a->chain; i++) {
        if (a->memo_of[0] != index + i && a->memo_of[1] != index + i) {
            arc_border b;
            if (arc_border_step(a, index + i, &b))
                remember(a, index + i, index + !i, &b);
            return false;
        }
    }
    return true;
}

uint32_t arc_piece(arc *a, uint32_t index, hal_segment *piece) {
    *piece = (hal_segment){0};
    if (a->chain)
        return chain_piece(a, index, piece);
    arc_border from = *border(a, index, index + 1);
    const arc_border *to = border(a, index + 1, index);
    unsigned eighth = (a->first + index - 1) >> a->parts & 7;
    unsigned major = arc_border_major_of(eighth), minor = !major;
    int32_t along = arc_border_travel_of(eighth, major), across = arc_border_travel_of(eighth, minor);
    int32_t x = arc_border_fine_at(a, major, from.at[major]);
    int32_t y = arc_border_fine_at(a, minor, from.at[minor]);
    int32_t steps = (to->at[major] - from.at[major]) * along;
    piece->arc = true;
    piece->length = to->length - from.length;
    piece->major = (uint8_t)a->axis[major];
    piece->minor = (uint8_t)a->axis[minor];
    for (unsigned i = 0; i < 2; i++)
        piece->delta[a->axis[i]] = outer_sign(a, i) * (to->at[i] - from.at[i]);
    share_third(a, from.length, piece);
    set_pace(a, piece, (uint32_t)steps, to->tangent[major] - from.tangent[major]);

    /* The square of the radius changes by whole units in each step, so it is exact at one end only.
       On a spiral this is the end nearer to where an axis reverses, because there a place may be
       half a pulse off, and only 0.35 where the axes exchange their roles. On a circle it is the
       other end. At the end that is not exact, the place must still be the nearest one to the
       curve. */
    bool ends_exact = !(eighth & 1) != !!a->slope;
    int64_t grown = (to->square[major] - from.square[major]) / MOVE_FINE;
    int32_t half = (grown < 0 ? -steps : steps) / 2;
    int32_t grows = steps ? (int32_t)((grown + half) / steps) : 0;
    int64_t first = from.square[major], last = first;
    for (unsigned tries = 0; grown && steps && tries < 4; tries++) {
        int64_t run = (int64_t)grows * steps * MOVE_FINE;
        first = ends_exact ? to->square[major] - run : from.square[major];
        last = first + run;
        int off = ends_exact ? -arc_border_neighbour(a, from.at, minor, first)
                             : arc_border_neighbour(a, to->at, minor, last);
        if (!off)
            break;
        grows -= off;
        watch_between();
    }
    piece->start.error = (int32_t)arc_border_error_at(a, from.at, first);
    piece->end.error = (int32_t)arc_border_error_at(a, to->at, last);
    piece->start.along = 2 * along * x - grows;
    piece->start.across = 2 * across * y;
    piece->outward = piece->start.across > 0;
    piece->end.along = piece->start.along + 2 * steps * MOVE_FINE;
    piece->end.across = 2 * across * arc_border_fine_at(a, minor, to->at[minor]);
    return from.length;
}

void arc_direction(const arc *a, bool end, int32_t direction[HAL_AXES]) {
    int64_t sine, cosine, plane = 1 << 15, third = 0;
    uint64_t tangent = (uint64_t)a->bend + (uint64_t)(end ? a->turn : 0);
    fixed_sine_cosine((int64_t)(tangent % (uint64_t)FIXED_TURN), &sine, &cosine);
    if (a->total != a->plane) {
        /* Keep as many bits as fit: the length of a short helix has only its 22 fraction bits. */
        unsigned shift = 0;
        while (a->total >> shift >= (int64_t)1 << 31)
            shift++;
        int64_t total = a->total >> shift;
        plane = ((a->plane >> shift) << 15) / total;
        third = (fixed_scaled(a->move.delta[a->axis[2]], PULSE_BITS) >> shift) * (1 << 15) / total;
    }
    direction[a->axis[0]] = (int32_t)(-plane * (sine >> 32) >> 30);
    direction[a->axis[1]] = (int32_t)(outer_sign(a, 1) * (plane * (cosine >> 32) >> 30));
    direction[a->axis[2]] = (int32_t)third;
}
