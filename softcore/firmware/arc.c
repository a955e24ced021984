// SPDX-License-Identifier: Apache-2.0
#include "arc.h"

#include "units.h"

#define TURN ((int64_t)1 << 62)
#define ONE ((int64_t)1 << 62)
#define PULSE_BITS 22               /* of a length */
#define PULSE ((int64_t)1 << PULSE_BITS)
#define FINE_BITS 16
#define TWO_PI 7244019458077122842  /* 2**-60 */
#define PI 3622009729038561421      /* 2**-60 */
#define PER_RADIAN 733972625820500307
#define NO_BORDER UINT32_MAX

/* One copy of what is used in many places: memory is dearer than time here. */
#define SHARED __attribute__((noinline))

/* Radii (pulses) from which 45 degrees are cut in two and in four: below, the speed of the major axis
   taken as running evenly over a piece puts no place off by more than about a quarter pulse. */
#define HALVES 33
#define QUARTERS 256
#define PIECE_BITS 20               /* a piece has at most 2**20 path pulses */
#define LEAST_BITS 4                /* nor is it cut shorter than 2**4 */

/* A border nearer to the start or the end than so many path pulses is left out. */
#define NEAR 2

#define HOPELESS (1 << 20)         /* more than a place may lack */

#define SECTORS 32                  /* of a turn: sines known */
static const int64_t SINE[SECTORS / 4 + 1] = {
    0, 899695310372275547, 1764815834521887442, 2562115475870945497, 3260954456333195553,
    3834476785802888710, 4260642322793532497, 4523073764714963030, ONE,
};

/* A shift to the left, of either sign. */
static int64_t scaled(int64_t value, unsigned bits) { return value * ((int64_t)1 << bits); }

static int64_t magnitude(int64_t value) { return value < 0 ? -value : value; }

/* Product of two factors, towards zero. */
SHARED static int64_t product(int64_t a, int64_t b) {
    uint64_t u = (uint64_t)magnitude(a), v = (uint64_t)magnitude(b);
    uint32_t u0 = (uint32_t)u, u1 = (uint32_t)(u >> 32), v0 = (uint32_t)v, v1 = (uint32_t)(v >> 32);
    uint64_t middle = (uint64_t)u1 * v0 + ((uint64_t)u0 * v0 >> 32);
    uint64_t other = (uint64_t)u0 * v1 + (uint32_t)middle;
    uint64_t high = (uint64_t)u1 * v1 + (middle >> 32) + (other >> 32);
    int64_t result = (int64_t)(high << 2 | (uint32_t)other >> 30);
    return (a < 0) != (b < 0) ? -result : result;
}

/* numerator / denominator as a factor; 0 <= numerator <= denominator < 2**62 + 1. */
SHARED static int64_t ratio(int64_t numerator, int64_t denominator) {
    uint64_t rest = (uint64_t)numerator, quotient = 0, divisor = (uint64_t)denominator;
    for (unsigned i = 0; i <= 62; i++) {
        quotient <<= 1;
        if (rest >= divisor) {
            rest -= divisor;
            quotient |= 1;
        }
        rest <<= 1;
    }
    return (int64_t)quotient;
}

SHARED static arc_divisor divisor_of(int64_t value) {
    arc_divisor d = {0};
    while (value <= ONE / 2) {
        value <<= 1;
        d.shift++;
    }
    d.inverse = ratio(ONE / 2, value);
    return d;
}

/* value / divisor as a factor; value at most the divisor. */
static int64_t fraction(int64_t value, const arc_divisor *d) {
    return product(scaled(value, d->shift), d->inverse) * 2;
}

static int64_t sine_of_sector(unsigned sector) {
    unsigned in = sector % (SECTORS / 2);
    int64_t sine = SINE[in <= SECTORS / 4 ? in : SECTORS / 2 - in];
    return sector % SECTORS < SECTORS / 2 ? sine : -sine;
}

/* The nearest sector's sine and cosine, turned by the rest (at most pi/32), whose series end with the
   seventh power. */
static void sine_cosine(int64_t angle, int64_t *sine, int64_t *cosine) {
    unsigned sector = (unsigned)((angle + TURN / SECTORS / 2) / (TURN / SECTORS));
    int64_t rest = angle - (int64_t)sector * (TURN / SECTORS);
    int64_t r = product(scaled(rest, 4), TWO_PI) >> 2;
    int64_t rr = product(r, r);
    int64_t s = ONE - product(rr, 109802048057794950);          /* 1/42 */
    s = ONE - product(product(rr, s), 230584300921369395);      /* 1/20 */
    s = product(r, ONE - product(product(rr, s), 768614336404564651)); /* 1/6 */
    int64_t c = ONE - product(rr, 82351536043346213);           /* 1/56 */
    c = ONE - product(product(rr, c), 153722867280912930);      /* 1/30 */
    c = ONE - product(product(rr, c), 384307168202282325);      /* 1/12 */
    c = ONE - (product(rr, c) >> 1);
    int64_t s0 = sine_of_sector(sector), c0 = sine_of_sector(sector + SECTORS / 4);
    *sine = product(s0, c) + product(c0, s);
    *cosine = product(c0, c) - product(s0, s);
}

/* Angle of a place, 0 to below TURN: the nearest sector, and the rest from its tangent. */
static int64_t angle_of(int32_t x, int32_t y) {
    static const uint32_t border[4] = {6455, 19880, 35030, 53784}; /* tangents, 2**-16 */
    int64_t u = magnitude(x), v = magnitude(y);
    bool swap = v > u;
    if (swap) {
        int64_t other = u;
        u = v;
        v = other;
    }
    unsigned sector = 0;
    while (sector < 4 && v << 16 > u * border[sector])
        sector++;
    int64_t s = sine_of_sector(sector), c = sine_of_sector(sector + SECTORS / 4);
    int64_t along = product(u << 31, c) + product(v << 31, s);
    int64_t across = product(v << 31, c) - product(u << 31, s);
    int64_t t = ratio(magnitude(across), along);
    int64_t tt = product(t, t);
    int64_t sum = ONE / 11 - product(tt, ONE / 13);
    sum = ONE / 9 - product(tt, sum);
    sum = ONE / 7 - product(tt, sum);
    sum = ONE / 5 - product(tt, sum);
    sum = ONE / 3 - product(tt, sum);
    int64_t rest = product(product(t, ONE - product(tt, sum)), PER_RADIAN);
    int64_t angle = (int64_t)sector * (TURN / SECTORS) + (across < 0 ? -rest : rest);
    if (swap)
        angle = TURN / 4 - angle;
    if (x < 0)
        angle = TURN / 2 - angle;
    if (y < 0)
        angle = -angle;
    return angle < 0 ? angle + TURN : angle < TURN ? angle : angle - TURN;
}

/* Square root to 2**-16. */
static int64_t root_of(int64_t square) {
    int64_t whole = units_root((uint64_t)square);
    return (whole << FINE_BITS) + scaled(square - whole * whole, FINE_BITS - 1) / whole;
}

static int64_t rounded(int64_t value, unsigned bits) {
    return (value + ((int64_t)1 << (bits - 1))) >> bits;
}

SHARED static int64_t square_of(int32_t x, int32_t y) { return (int64_t)x * x + (int64_t)y * y; }

SHARED static int32_t fine_at(const arc *a, unsigned i, int32_t pulses) {
    return a->start[i] + pulses * MOVE_FINE;
}

/* Path length in the plane after `angle` of the sweep, with the radius there. */
static int64_t length_to(const arc *a, int64_t angle, int64_t radius) {
    int64_t length = product(scaled(a->radius[0] + radius, 14), angle);
    length = product(length, PI) >> 12;
    /* A radius that changes makes it longer by half the square of the slope. */
    return length + (length >> 14) * (a->slope * a->slope >> 30) / ((int64_t)1 << 17);
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
        a->end[i] = fine_at(a, i, a->to[i]);
    }
}

/* How far the tangent turns outwards where the radius is radius[i]: the arc tangent of the radius'
   change with the angle over the radius. */
static int64_t lead_at(const arc *a, unsigned i) {
    int64_t other = a->radius[!i], own = a->radius[i];
    /* slope * mean radius / own radius, 2**-30 */
    int64_t t = a->slope + a->slope * ((other - own) / 2 >> 16) / (own >> 16);
    t -= ((t * t >> 30) * t >> 30) / 3;
    return product(scaled(t, 32), PER_RADIAN);
}

static int64_t part_angle(const arc *a) { return TURN / 8 >> a->parts; }

/* How finely 45 degrees are cut. The radius changes by a pulse at most in a piece, and by a quarter
   in a large one: its square is taken as running evenly with the major coordinate. */
static void cut(arc *a) {
    int64_t mean = (a->radius[0] + a->radius[1]) / 2;
    int64_t pulses = mean >> PULSE_BITS;
    a->parts = pulses < HALVES ? 0 : pulses < QUARTERS ? 1 : 2;
    int64_t eighth = product(mean << 14, PI) >> 14; /* PI in 2**-62 is a quarter of it */
    if (a->slope) {
        int64_t even = ((int64_t)1 << (30 + PULSE_BITS)) / magnitude(a->slope);
        while (a->parts < 2 && eighth >> a->parts > even / 4 &&
               eighth >> (a->parts + LEAST_BITS) > PULSE)
            a->parts++;
        while (eighth >> a->parts > even)
            a->parts++;
    }
    int64_t longest = product(PULSE << PIECE_BITS, ratio(a->plane, a->total));
    while (eighth >> a->parts > longest && eighth >> (a->parts + LEAST_BITS + 1) > PULSE)
        a->parts++;
}

/* Path pulses up to a place `plane` along the curve. */
static int64_t path_to(const arc *a, int64_t plane) {
    if (a->total == a->plane)
        return plane;
    plane = plane < 0 ? 0 : plane < a->plane ? plane : a->plane;
    return product(a->total << 10, fraction(plane, &a->by_plane)) >> 10;
}

/* The axis of the plane that is the major one in an eighth of the turn, and how the axes travel. */
static unsigned major_of(unsigned eighth) { return (eighth + 1) & 2 ? 0 : 1; }
static int32_t travel_of(unsigned eighth, unsigned axis) {
    return ((eighth + (axis ? 2 : 4)) & 7) < 4 ? 1 : -1;
}

/* Error of a place: the square of its radius less that of the curve, in units of MOVE_FINE. */
SHARED static int64_t error_at(const arc *a, const int32_t at[2], int64_t square) {
    return (square_of(fine_at(a, 0, at[0]), fine_at(a, 1, at[1])) - square) / MOVE_FINE;
}

/* Is the place the nearer one, or is its neighbour outwards (1) or inwards (-1) on `axis`? Where the
   curve goes through the middle the inner one is. */
static int neighbour(const arc *a, const int32_t at[2], unsigned axis, int64_t square) {
    int64_t error = error_at(a, at, square), from = magnitude(fine_at(a, axis, at[axis]));
    if (error + from + MOVE_FINE / 4 < 0)
        return 1;
    return error - from + MOVE_FINE / 4 >= 0 ? -1 : 0;
}

/* Move a place to the curve along `axis`. */
static void settle(const arc *a, int32_t at[2], unsigned axis, int64_t square) {
    for (unsigned tries = 0; tries < 8; tries++) {
        int off = neighbour(a, at, axis, square);
        if (!off)
            return;
        at[axis] += fine_at(a, axis, at[axis]) < 0 ? -off : off;
    }
}

/* How far a place is from the ideal one, along an axis of the plane. */
static int64_t off_along(const arc *a, const arc_ideal *p, const int32_t at[2], unsigned axis) {
    return scaled(fine_at(a, axis, at[axis]), FINE_BITS) - p->at[axis];
}

/* How much further along the curve it passes the place's coordinate of the major axis. */
static int32_t passes(const arc *a, const arc_ideal *p, const int32_t at[2], unsigned major) {
    int32_t off = (int32_t)off_along(a, p, at, major);
    return off * (1 << 6) / (int32_t)(p->tangent[major] >> 21) * (1 << 3);
}

/* The square of the radius there. */
static int64_t square_at(const arc *a, const arc_ideal *p, const int32_t at[2], unsigned major) {
    if (!a->slope)
        return p->square;
    int64_t grown = (p->radius >> FINE_BITS) * (a->slope * passes(a, p, at, major) >> 30);
    return p->square + rounded(grown, FINE_BITS - 1 + 6) * MOVE_FINE;
}

static int64_t foot_of(const arc *a, const arc_ideal *p, const int32_t at[2]) {
    return (off_along(a, p, at, 0) * p->tangent[0] + off_along(a, p, at, 1) * p->tangent[1]) >> 30;
}

/* Make the place the nearer one along an axis by changing the square of the radius a little; returns
   by how much, in units of the error. */
static int64_t yield(const arc *a, const int32_t at[2], unsigned axis, int64_t *square) {
    int off = neighbour(a, at, axis, *square);
    int64_t error = error_at(a, at, *square), from = magnitude(fine_at(a, axis, at[axis]));
    int64_t much = off > 0   ? error + from + MOVE_FINE / 4
                   : off < 0 ? error - from + MOVE_FINE / 4 + 1
                             : 0;
    *square += much * MOVE_FINE;
    return magnitude(much);
}

/* On the way from a place along the diagonal, `way` 1 forward, -1 back, the minor axis must not have
   to make two steps for one of the major axis. Change the square a little where it would; behind the
   third step the curve is flat enough. Returns by how much, in units of the error. Where the radius
   changes, a piece follows it to about 1/50 pulse there, which is kept off, too. */
static int64_t flatten(const arc *a, const arc_ideal *p, const int32_t from[2],
                       const int32_t travel[2], unsigned major, int32_t way, int64_t *square) {
    unsigned minor = !major;
    int32_t at[2] = {from[0], from[1]};
    int64_t base = square_at(a, p, from, major), changed = 0;
    for (unsigned step = 0; step < 3; step++) {
        for (unsigned axis = 0; axis < 2; axis++)
            at[axis] += way * travel[axis];
        int32_t place = fine_at(a, minor, at[minor]);
        int64_t error = error_at(a, at, square_at(a, p, at, major) + (*square - base));
        int64_t half = magnitude(place), margin = a->slope ? half / 24 : 0;
        bool outwards = (place < 0) == (way * travel[minor] < 0);
        error += MOVE_FINE / 4;
        int64_t spare = (outwards ? error + half : half - error - 1) - margin;
        if (spare < 0) {
            /* More than it lacks: the change is taken back from here on, by whole units per step. */
            spare += spare / 4 - 4;
            *square += (outwards ? spare : -spare) * MOVE_FINE;
            changed -= spare;
        }
    }
    return changed;
}

/* Along a diagonal the error runs by less than DRIFT in three steps from where the axes change their
   roles. Is a place so much nearer than its neighbours, both ways? */
#define DRIFT 2500
static bool comfortable(const arc *a, const arc_border *b) {
    int64_t x = magnitude(fine_at(a, 0, b->at[0])), y = magnitude(fine_at(a, 1, b->at[1]));
    int64_t error = magnitude(error_at(a, b->at, b->square[0]));
    int64_t other = magnitude(error_at(a, b->at, b->square[1]));
    int64_t least = x < y ? x : y;
    return (error > other ? error : other) + DRIFT + least / 12 < least;
}

/* Where the axes change their roles, before `eighth`, the place must be the nearer one along both, and
   no step be left out. Of three places one is taken whose path length is nearly a whole number. If
   there is none, because the curve goes through the middle between places again and again, one is
   taken that lacks little: about a pulse over the radius. */
static int64_t change_over(const arc *a, arc_border *b, const arc_ideal *p, unsigned eighth) {
    static const int8_t tries[3] = {0, 1, -1};
    unsigned major = major_of(eighth);
    int32_t travel[2] = {travel_of(eighth, 0), travel_of(eighth, 1)};
    int64_t best = INT64_MAX, enough = PULSE / 8, length = path_to(a, p->plane);
    arc_border begin = *b;
    for (unsigned i = 0; i < 3 && best > enough; i++) {
        arc_border c = begin;
        for (unsigned axis = 0; axis < 2; axis++)
            c.at[axis] += tries[i] * travel[axis];
        c.square[0] = square_at(a, p, c.at, 0);
        settle(a, c.at, 1, c.square[0]);
        c.square[1] = square_at(a, p, c.at, 1);
        int64_t lacks = 0;
        if (!comfortable(a, &c)) {
            lacks = yield(a, c.at, 0, &c.square[1]);
            lacks += flatten(a, p, c.at, travel, !major, -1, &c.square[!major]);
            lacks += flatten(a, p, c.at, travel, major, 1, &c.square[major]);
            if (lacks && (neighbour(a, c.at, 1, c.square[0]) || neighbour(a, c.at, 0, c.square[1])))
                lacks += HOPELESS;
            enough = PULSE; /* It has taken long. */
        }
        int64_t foot = path_to(a, p->plane + foot_of(a, p, c.at));
        int64_t off = magnitude(scaled(rounded(foot, PULSE_BITS), PULSE_BITS) - foot) +
                      lacks * PULSE;
        if (off < best) {
            best = off;
            length = foot;
            *b = c;
        }
    }
    return length;
}

/* The curve at border number `index`, from 0, the start, to the number of pieces, the end. */
static arc_border curve_at(const arc *a, uint32_t index, arc_ideal *ideal) {
    arc_border b = {0};
    bool ends = index == a->pieces;
    uint32_t multiple = a->first + index - 1;
    int64_t turned = 0, part = ONE;
    if (ends) {
        turned = a->turn;
    } else if (index) {
        turned = (int64_t)((uint64_t)multiple * (uint64_t)part_angle(a) - (uint64_t)a->bend);
        part = fraction(turned, &a->by_turn);
    } else {
        part = 0;
    }
    int64_t swept = turned + product(a->lead[1] - a->lead[0], part), sine, cosine;
    int64_t angle = (int64_t)(((uint64_t)a->angle + (uint64_t)swept) % (uint64_t)TURN);
    sine_cosine(angle, &sine, &cosine);
    int64_t slope = scaled(a->slope, 32);
    arc_ideal p = {.tangent = {(-sine + product(slope, cosine)) >> 32,
                           (cosine + product(slope, sine)) >> 32}};
    for (unsigned i = 0; i < 2; i++) {
        int64_t size = magnitude(p.tangent[i]);
        b.tangent[i] = (int32_t)(size < 1 << 30 ? size : 1 << 30);
    }
    if (!index || ends) {
        b.square[0] = b.square[1] = a->square[ends];
        b.at[0] = ends ? a->to[0] : 0;
        b.at[1] = ends ? a->to[1] : 0;
        b.length = ends ? a->length : 0;
        return b;
    }
    int64_t change = a->radius[1] - a->radius[0];
    p.radius = a->radius[0] + product(change, part);
    p.plane = length_to(a, swept, p.radius);
    /* The square is that of an even radius; what it leaves over 64 is the same as at the start. */
    int64_t bow = (change >> 8) * (change >> 8) >> 16;
    int64_t grown = product(a->square[1] - a->square[0], part) -
                    product(product(bow << 2, part), ONE - part) / 4;
    p.square = a->square[0] + rounded(grown, 6) * MOVE_FINE;
    p.at[0] = product(p.radius, cosine);
    p.at[1] = product(p.radius, sine);
    for (unsigned i = 0; i < 2; i++)
        b.at[i] = (int32_t)rounded(p.at[i] - scaled(a->start[i], FINE_BITS), PULSE_BITS);
    *ideal = p;
    return b;
}

/* The place on a border between start and end that lies next to the curve. */
static void place_at(const arc *a, uint32_t index, const arc_ideal *p, arc_border *b) {
    uint32_t multiple = a->first + index - 1;
    unsigned eighth = multiple >> a->parts;
    int64_t path;
    if (eighth & 1 && multiple == eighth << a->parts) {
        path = change_over(a, b, p, eighth);
    } else {
        unsigned major = major_of(eighth);
        b->square[major] = square_at(a, p, b->at, major);
        settle(a, b->at, !major, b->square[major]);
        path = path_to(a, p->plane + passes(a, p, b->at, major));
    }
    b->length = (uint32_t)rounded(path, PULSE_BITS);
}

/* A border, in two steps of some thousand clocks: true if it is there. */
static bool border_step(arc *a, uint32_t index, arc_border *b) {
    if (a->half_of != index) {
        a->half = curve_at(a, index, &a->ideal);
        a->half_of = index;
        return false;
    }
    a->half_of = NO_BORDER;
    *b = a->half;
    if (index && index != a->pieces)
        place_at(a, index, &a->ideal, b);
    return true;
}

static void remember(arc *a, uint32_t index, const arc_border *b) {
    unsigned i = a->memo_next;
    a->memo_next = !i;
    a->memo[i] = *b;
    a->memo_of[i] = index;
}

static const arc_border *border(arc *a, uint32_t index) {
    for (;;) {
        for (unsigned i = 0; i < 2; i++)
            if (a->memo_of[i] == index)
                return &a->memo[i];
        arc_border b;
        if (border_step(a, index, &b))
            remember(a, index, &b);
    }
}

#define SMALLEST (4 * MOVE_FINE << 8) /* radius, 2**-8 of a fine pulse */

/* Choose the next step of a chain: of the places ahead the one nearest to the curve. True at the end. */
static bool choose_step(arc *a) {
    int32_t x = fine_at(a, 0, a->place[0]), y = fine_at(a, 1, a->place[1]);
    int32_t slope = (int32_t)(a->slope >> 14);
    int32_t along[2] = {-y * (1 << 16) + slope * x, x * (1 << 16) + slope * y};
    unsigned major = magnitude(along[0]) >= magnitude(along[1]) ? 0 : 1;
    int32_t ahead[2] = {a->to[0] - a->place[0], a->to[1] - a->place[1]};
    int64_t rest = a->sweep - a->done;
    int64_t left = product(product(a->radius[1] << 14, rest), PI) >> 11;
    int8_t *step = a->steps[a->pieces++];
    bool last = a->pieces == ARC_CHAIN ||
                (magnitude(ahead[0]) <= 1 && magnitude(ahead[1]) <= 1 && left < 9 * PULSE / 4);
    int64_t best = INT64_MAX;
    int64_t radius = (a->radius[0] + product(a->radius[1] - a->radius[0],
                                             fraction(a->done, &a->by_turn))) >> 8;
    int64_t most = magnitude(along[major]);
    for (int i = 0; !last && i < 9; i++) {
        int32_t to[2] = {i / 3 - 1, i % 3 - 1};
        int64_t way = (int64_t)along[0] * to[0] + (int64_t)along[1] * to[1];
        /* On a circle that is hardly larger than a pulse, along the minor axis alone, too. */
        if (way <= most / 4 || (!to[major] && radius >= SMALLEST))
            continue;
        /* The radius after the step, as far as it leads along the curve. */
        int64_t gain = a->slope * (way >> 8) / (radius >> 8) / (1 << 24);
        int64_t wanted = radius + gain;
        uint64_t square = (uint64_t)square_of(x + to[0] * MOVE_FINE, y + to[1] * MOVE_FINE);
        int64_t off = magnitude((int64_t)units_root(square << 16) - wanted);
        if (off < best) {
            best = off;
            step[0] = (int8_t)to[0];
            step[1] = (int8_t)to[1];
        }
    }
    if (last) {
        step[0] = (int8_t)ahead[0];
        step[1] = (int8_t)ahead[1];
    }
    return last;
}

/* Make the step: where it leads, and how far along the curve. */
static void make_step(arc *a) {
    const int8_t *step = a->steps[a->pieces - 1];
    for (unsigned i = 0; i < 2; i++)
        a->place[i] = (int16_t)(a->place[i] + step[i]);
    int64_t reached = angle_of(fine_at(a, 0, a->place[0]), fine_at(a, 1, a->place[1]));
    int64_t turned = reached - a->reached;
    a->done += turned < -TURN / 2 ? turned + TURN : turned > TURN / 2 ? turned - TURN : turned;
    a->reached = reached;
}

static uint32_t third_of(const arc *a) { return (uint32_t)magnitude(a->move.delta[a->axis[2]]); }

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
    a->length = (uint32_t)rounded(a->total, PULSE_BITS);
    if (a->length < third_of(a))
        a->length = third_of(a);
}

bool arc_prepare(arc *a) {
    switch (a->phase++) {
    case 0:
        a->square[0] = square_of(a->start[0], a->start[1]);
        a->square[1] = square_of(a->end[0], a->end[1]);
        a->radius[0] = root_of(a->square[0]);
        a->radius[1] = root_of(a->square[1]);
        a->chain = arc_radius(a) < ARC_LEAST_RADIUS;
        return false;
    case 1:
        a->angle = a->reached = angle_of(a->start[0], a->start[1]);
        return false;
    case 2:
        a->sweep = angle_of(a->end[0], a->end[1]) - a->angle;
        if (a->sweep <= 0)
            a->sweep += TURN;
        a->plane = length_to(a, a->sweep, a->radius[1]);
        a->slope = (a->radius[1] - a->radius[0]) * ((int64_t)1 << 30) / a->plane;
        a->plane = length_to(a, a->sweep, a->radius[1]);
        return false;
    case 3:
        if (a->slope) {
            a->lead[0] = lead_at(a, 0);
            a->lead[1] = lead_at(a, 1);
        }
        a->bend = a->angle - a->lead[0];
        a->bend += a->bend < 0 ? TURN : 0;
        a->turn = a->sweep - (a->lead[1] - a->lead[0]);
        measure(a);
        return false;
    case 4:
        a->by_turn = divisor_of(a->chain ? a->sweep : a->turn);
        return false;
    case 5:
        if (!a->chain) {
            a->by_plane = divisor_of(a->plane);
        } else if (a->chosen) {
            make_step(a);
            a->chosen = false;
            a->phase--;
        } else {
            /* The phases end with the chain. */
            a->chosen = !choose_step(a);
            a->phase -= a->chosen;
        }
        return false;
    case 6:
        if (a->chain) {
            a->length = a->length < a->pieces ? a->pieces : a->length;
            return true;
        }
        cut(a);
        a->first = (uint32_t)(a->bend / part_angle(a)) + 1;
        a->pieces = (uint32_t)(((uint64_t)a->bend + (uint64_t)a->turn) /
                               (uint64_t)part_angle(a)) - a->first + 2;
        return false;
    case 7:
        /* Leave out what is too near to the start, */
        if (a->pieces > 1) {
            arc_border b;
            if (!border_step(a, 1, &b)) {
                a->phase--;
            } else if (b.length < NEAR) {
                a->first++;
                a->pieces--;
                a->phase--;
            }
        }
        return false;
    case 8:
        /* and to the end. */
        if (a->pieces > 1) {
            arc_border b;
            if (!border_step(a, a->pieces - 1, &b)) {
                a->phase--;
            } else if (b.length + NEAR > a->length) {
                a->pieces--;
                a->phase--;
            }
        }
        return false;
    default:
        if (a->pieces == 1) /* the roles of the axes are those of its middle */
            a->first = (uint32_t)(((uint64_t)a->bend + (uint64_t)a->turn / 2) /
                                  (uint64_t)part_angle(a)) + 1;
        return true;
    }
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

/* Pace of the major axis: it makes `steps` in the piece, faster or slower towards its end as the
   tangent turns. */
static void set_pace(const arc *a, hal_segment *piece, uint32_t steps, int32_t turns) {
    uint32_t n = piece->length;
    while (piece->shift < 15 && n << (piece->shift + 1) < 1u << 30)
        piece->shift++;
    if (a->total != a->plane)
        turns = (int32_t)(turns * (a->plane >> 22) / (a->total >> 22));
    int32_t change = turns / (1 << (30 - piece->shift));
    /* Between standing and a step with every pulse. */
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
            if (border_step(a, index + i, &b))
                remember(a, index + i, &b);
            return false;
        }
    }
    return true;
}

uint32_t arc_piece(arc *a, uint32_t index, hal_segment *piece) {
    *piece = (hal_segment){0};
    if (a->chain)
        return chain_piece(a, index, piece);
    arc_border from = *border(a, index);
    const arc_border *to = border(a, index + 1);
    unsigned eighth = (a->first + index - 1) >> a->parts & 7;
    unsigned major = major_of(eighth), minor = !major;
    int32_t along = travel_of(eighth, major), across = travel_of(eighth, minor);
    int32_t x = fine_at(a, major, from.at[major]), y = fine_at(a, minor, from.at[minor]);
    int32_t steps = (to->at[major] - from.at[major]) * along;
    piece->arc = true;
    piece->length = to->length - from.length;
    piece->major = (uint8_t)a->axis[major];
    piece->minor = (uint8_t)a->axis[minor];
    for (unsigned i = 0; i < 2; i++)
        piece->delta[a->axis[i]] = outer_sign(a, i) * (to->at[i] - from.at[i]);
    share_third(a, from.length, piece);
    set_pace(a, piece, (uint32_t)steps, to->tangent[major] - from.tangent[major]);

    /* The square of the radius runs by whole units per step, so that it is met at one end only: where
       the axes change their roles. At the other it must be on the same side of the middles around the
       place as the true one. */
    bool ends_exact = !(eighth & 1);
    int64_t grown = (to->square[major] - from.square[major]) / MOVE_FINE;
    int32_t half = (grown < 0 ? -steps : steps) / 2;
    int32_t grows = steps ? (int32_t)((grown + half) / steps) : 0;
    int64_t first = from.square[major], last = first;
    for (unsigned tries = 0; grown && steps && tries < 4; tries++) {
        int64_t run = (int64_t)grows * steps * MOVE_FINE;
        first = ends_exact ? to->square[major] - run : from.square[major];
        last = first + run;
        int off = ends_exact ? -neighbour(a, from.at, minor, first)
                             : neighbour(a, to->at, minor, last);
        if (!off)
            break;
        grows -= off;
    }
    piece->start.error = (int32_t)error_at(a, from.at, first);
    piece->end.error = (int32_t)error_at(a, to->at, last);
    piece->start.along = 2 * along * x - grows;
    piece->start.across = 2 * across * y;
    piece->outward = piece->start.across > 0;
    piece->end.along = piece->start.along + 2 * steps * MOVE_FINE;
    piece->end.across = 2 * across * fine_at(a, minor, to->at[minor]);
    return from.length;
}

void arc_direction(const arc *a, bool end, int32_t direction[HAL_AXES]) {
    int64_t sine, cosine, plane = 1 << 15, third = 0;
    sine_cosine((int64_t)(((uint64_t)a->bend + (uint64_t)(end ? a->turn : 0)) % (uint64_t)TURN),
                &sine, &cosine);
    if (a->total != a->plane) {
        plane = ((a->plane >> 16) << 15) / (a->total >> 16);
        third = scaled(a->move.delta[a->axis[2]], 21) / (a->total >> 16);
    }
    direction[a->axis[0]] = (int32_t)(-plane * (sine >> 32) >> 30);
    direction[a->axis[1]] = (int32_t)(outer_sign(a, 1) * (plane * (cosine >> 32) >> 30));
    direction[a->axis[2]] = (int32_t)third;
}
