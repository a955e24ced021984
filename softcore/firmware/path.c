// SPDX-License-Identifier: Apache-2.0
#include "path.h"

#include "arc.h"
#include "settings.h"
#include "units.h"

/* Numbers begin here so that the virtual segment has one too; a multiple of the slots. */
#define FIRST_NUMBER HAL_SLOTS

/* Slots kept loaded behind and ahead of the segment in which the machine is: most of them in the
   direction of travel, so that short segments do not bound its speed. */
#define NEAR_SIDE (HAL_SLOTS / 4 - 1)
#define FAR_SIDE (HAL_SLOTS - 1 - NEAR_SIDE)

/* Segments looked at per step when the floor is worked out anew; a line takes its length's root. */
#define SCAN 4

/* Units of a block. A line: delta; rate. An arc: the same, then centre; plane and sense; length, 0
   until it is known. The two highest bits of the last word tell them apart, in both directions. */
typedef struct {
    uint32_t word[4];
} unit;
_Static_assert(sizeof(unit) == PATH_UNIT, "a unit of the ring has no gaps");

enum { LINE, ARC, ARC_REST };
#define KIND(word) ((word) >> 30)
#define VALUE(word) ((word) & ((1u << 30) - 1))
#define SENSE 4u            /* of the word that holds the plane */

/* A segment of the path: piece `piece` of a block. */
typedef struct {
    uint32_t block, piece;
} place;

/* A segment in the window. */
typedef struct {
    place at;
    int32_t start;              /* coordinate where it begins */
    uint32_t length, rate;
    bool tight;                 /* the highest speed is too much for its curve */
    bool corner;                /* the junction at its end is taken at the start/stop speed, */
    bool slows;                 /* or so only forward, because the next feed is lower */
    int32_t from[HAL_AXES], to[HAL_AXES];   /* tangents at start and end of its block, 2**-15 */
} segment;

/* What is known of a segment when it is loaded for the first time, until it is entered. */
typedef struct {
    uint32_t block;
    int32_t start;
    int32_t floor;              /* lowest coordinate that the ceiling allows from this segment on */
} entry;

#define ENTRIES (2 * HAL_SLOTS) /* a power of two */

/* An arc made ready; the two sides of the window work on different ones. */
typedef struct {
    uint32_t block;
    bool ready;
    unsigned known;             /* of the tangents */
    int32_t tangent[2][HAL_AXES];   /* at start and end, 2**-15 */
    uint32_t rate;              /* highest one */
    bool tight;
    arc arc;
} bow;

#define BOWS 2
#define NO_BLOCK UINT32_MAX

static unit ring[PATH_RING];
static segment window[HAL_SLOTS];
static entry entries[ENTRIES];
static bow bows[BOWS];
static unsigned last_bow;
static bool known, virtual_segment;
static uint32_t oldest, next;               /* ring holds the blocks [oldest, next) */
static int32_t oldest_start;
static uint32_t low, high;                  /* window holds the segments [low, high) */
static uint32_t loaded;                     /* segments below have been in the window */
static place fresh;                         /* the segment numbered `loaded` */
static int32_t fresh_start;
static int32_t fresh_height;                /* jump axis there, */
static int32_t fresh_floor;                 /* and the floor of the segment before */
static uint32_t entered;                    /* furthest segment entered */
static int32_t floor_in_force;
static int32_t bounds[BOUNDS];              /* as written */
static uint32_t limit;
static bool ceiling;
static int32_t height;
static struct {
    bool active;
    place at;           /* segments from here on have been looked at */
    int32_t start;      /* coordinate and jump axis there */
    int32_t from;
} scan;

static unit *unit_of(uint32_t number) { return &ring[number % PATH_RING]; }
static segment *in_window(uint32_t number) { return &window[number % HAL_SLOTS]; }
static entry *entry_of(uint32_t number) { return &entries[number % ENTRIES]; }
static bool is_arc(uint32_t block) { return KIND(unit_of(block)->word[3]) == ARC; }
static uint32_t after(uint32_t block) { return block + (is_arc(block) ? 2 : 1); }
static uint32_t before(uint32_t block) {
    return block - (KIND(unit_of(block - 1)->word[3]) == ARC_REST ? 2 : 1);
}

static int32_t moved(int32_t coordinate, uint32_t length) {
    return (int32_t)((uint32_t)coordinate + length);
}
static int32_t moved_back(int32_t coordinate, uint32_t length) {
    return (int32_t)((uint32_t)coordinate - length);
}
/* Coordinates wrap: compare by difference. */
static int32_t difference(int32_t a, int32_t b) { return (int32_t)((uint32_t)a - (uint32_t)b); }

static int32_t end_of(uint32_t number) {
    return moved(in_window(number)->start, in_window(number)->length);
}

static void forget(void) {
    oldest = next = low = high = loaded = entered = FIRST_NUMBER;
    oldest_start = fresh_start = fresh_floor = floor_in_force = 0;
    fresh = (place){FIRST_NUMBER, 0};
    scan.active = false;
    for (unsigned i = 0; i < BOWS; i++)
        bows[i].block = NO_BLOCK;
}

void path_init(void) {
    limit = 0;
    ceiling = known = virtual_segment = false;
    forget();
}

uint32_t path_next(void) { return next; }
bool path_floor_is_limit(void) { return virtual_segment; }

static void write_bound(hal_bound bound, int32_t coordinate) {
    if (bounds[bound] != coordinate) {
        bounds[bound] = coordinate;
        hal_bound_write(bound, coordinate);
    }
}

/* Direction of a segment in 2**-15, exact enough (2**-14) after 16 leading bits are kept. */
static void direction_of(const hal_segment *move, int32_t direction[HAL_AXES]) {
    uint32_t length = move->length;
    unsigned shift = 0;
    while (length >> shift >= 1u << 16)
        shift++;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        direction[axis] = (int32_t)((uint32_t)(move->delta[axis] / (1 << shift)) * (1u << 15)) /
                          (int32_t)(length >> shift);
}

/* A junction is tangent if at the highest speed no axis changes its speed by more than the
   start/stop speed, which the machine can take at once. */
static bool is_corner(const int32_t a[HAL_AXES], const int32_t b[HAL_AXES]) {
    uint32_t highest = units_rate(settings_highest_speed());
    uint32_t change = settings_start_rate() / ((highest >> 15) + 1);
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t step = a[axis] - b[axis];
        if ((uint32_t)(step < 0 ? -step : step) > change)
            return true;
    }
    return false;
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

/* The arc of a block, made ready; 0 after a step towards that. */
static bow *bow_of(uint32_t block) {
    unsigned i = last_bow;
    if (bows[i].block != block)
        i = !i;
    if (bows[i].block != block) {
        const unit *u = unit_of(block), *rest = unit_of(block + 1);
        path_move move = {.arc = true, .ccw = rest->word[2] & SENSE,
                          .plane = (move_plane)(rest->word[2] & ~SENSE),
                          .centre = {(int32_t)rest->word[0], (int32_t)rest->word[1]}};
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            move.delta[axis] = (int32_t)u->word[axis];
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
        unit *rest = unit_of(block + 1);
        rest->word[3] = (uint32_t)ARC_REST << 30 | arc_length(&b->arc);
        /* Speed squared over the radius is the acceleration: 2**-64 pulse**2/clock**2 are
           2**-36 pulse/clock**2 times pulse times 2**28. */
        uint32_t radius = arc_radius(&b->arc);
        uint64_t square = (uint64_t)settings_acceleration() * radius;
        uint32_t root = units_root(square << 8);
        uint32_t most = root >= UNITS_RATE_LIMIT >> 10 ? UNITS_RATE_LIMIT : root << 10;
        b->rate = most > settings_start_rate() ? most : settings_start_rate();
        b->tight = b->rate < units_rate(settings_highest_speed());
    }
    return 0;
}

/* Make the segment at a place; false after a step towards that. `to` is all of `s` but its start. */
static bool make(place at, hal_segment *move, segment *s) {
    const unit *u = unit_of(at.block);
    *s = (segment){.at = at, .rate = VALUE(u->word[3])};
    if (is_arc(at.block)) {
        bow *b = bow_of(at.block);
        if (!b || !arc_piece_ready(&b->arc, at.piece))
            return false;
        (void)arc_piece(&b->arc, at.piece, move);
        s->tight = b->tight;
        s->rate = s->rate < b->rate ? s->rate : b->rate;
        for (unsigned axis = 0; axis < HAL_AXES; axis++) {
            s->from[axis] = b->tangent[0][axis];
            s->to[axis] = b->tangent[1][axis];
        }
    } else {
        *move = (hal_segment){0};
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            move->delta[axis] = (int32_t)u->word[axis];
        move->length = length_of(move->delta);
        direction_of(move, s->from);
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            s->to[axis] = s->from[axis];
    }
    move->rate = s->rate;
    s->length = move->length;
    return true;
}

/* The next place on the path, of a segment that has just been made. */
static place following(place at) {
    if (is_arc(at.block)) {
        const bow *b = bow_of(at.block);
        if (b && at.piece + 1 < arc_pieces(&b->arc))
            return (place){at.block, at.piece + 1};
    }
    return (place){after(at.block), 0};
}

/* The one before; false after a step towards knowing it. */
static bool preceding(place *at) {
    if (at->piece) {
        at->piece--;
        return true;
    }
    place to = {before(at->block), 0};
    if (is_arc(to.block)) {
        const bow *b = bow_of(to.block);
        if (!b)
            return false;
        to.piece = arc_pieces(&b->arc) - 1;
    }
    *at = to;
    return true;
}

/* What the junction between two segments of the window allows. */
static void join(uint32_t number) {
    segment *a = in_window(number);
    const segment *b = in_window(number + 1);
    /* Above the start/stop speed a lower feed, too, has to be reached before the junction. */
    a->slows = b->rate < a->rate && a->rate > settings_start_rate();
    a->corner = a->tight || b->tight || (a->at.block != b->at.block && is_corner(b->from, a->to));
}

/* Has the major axis of a piece made `steps` after `count` pulses? */
static bool major_made(const hal_segment *s, uint32_t steps, uint32_t count) {
    uint64_t whole = (uint64_t)s->length << s->shift;
    int64_t paced = (int64_t)((uint64_t)count * s->start.pace);
    if (count)
        paced += (int64_t)s->change * ((int64_t)count * (count - 1) / 2);
    return 2 * paced >= (int64_t)((2 * (uint64_t)steps - 1) * whole);
}

/* Has the minor axis made `steps` when the major one has made `count`? The error is that of the
   gateware's recurrence, added up. */
static bool minor_made(const hal_segment *s, uint32_t steps, uint32_t count) {
    int64_t n = count, m = (int64_t)steps - 1;
    int64_t across = s->start.across + 2 * MOVE_FINE * m;
    int64_t error = s->start.error + n * (s->start.along + MOVE_FINE * n) +
                    m * ((int64_t)s->start.across + MOVE_FINE * m);
    int64_t middle = error + across / 2 + MOVE_FINE / 4;
    return s->outward ? middle < 0 : middle >= 0;
}

/* The least count up to `most` for which a step has been made. */
static uint32_t least(const hal_segment *s, uint32_t steps, uint32_t most,
                      bool (*made)(const hal_segment *, uint32_t, uint32_t)) {
    uint32_t below = 0;
    while (most - below > 1) {
        uint32_t middle = below + (most - below) / 2;
        if (made(s, steps, middle))
            most = middle;
        else
            below = middle;
    }
    return most;
}

/* Path pulses into `move` after which its jump axis, beginning `drop` above the ceiling, is no
   longer above it: of a line the least k with floor((2 k m + n) / 2n) >= drop. */
static uint32_t crossing(const hal_segment *move, uint32_t drop, unsigned axis) {
    if (move->arc && (axis == move->major || axis == move->minor)) {
        int32_t travel = move->delta[move->major];
        uint32_t steps = travel < 0 ? 0u - (uint32_t)travel : (uint32_t)travel;
        if (axis == move->minor)
            drop = least(move, drop, steps, minor_made);
        return least(move, drop, move->length, major_made);
    }
    uint32_t magnitude = 0u - (uint32_t)move->delta[axis];
    uint64_t numerator = (uint64_t)move->length * (2 * drop - 1);
    uint64_t divisor = 2 * (uint64_t)magnitude;
    return (uint32_t)((numerator + divisor - 1) / divisor);
}

/* Floor of a segment that begins at `from` and ends at `to` on the jump axis. */
static int32_t floor_of(const hal_segment *move, int32_t start, int32_t from, int32_t to,
                        int32_t floor) {
    unsigned axis = hal_jump_axis();
    if (!ceiling || axis >= HAL_AXES || (from <= height && to <= height))
        return floor;
    if (to > height)
        return moved(start, move->length);
    return moved(start, crossing(move, (uint32_t)(from - height), axis));
}

static int32_t jump_travel(const hal_segment *move) {
    unsigned axis = hal_jump_axis();
    return axis < HAL_AXES ? move->delta[axis] : 0;
}

/* The segment that leads back from the first point up to the soft limit. */
static void make_virtual(void) {
    unsigned axis = hal_jump_axis();
    int32_t above = axis < HAL_AXES ? settings_soft_limit() - fresh_height : 0;
    virtual_segment = above > 0;
    if (!virtual_segment)
        return;
    oldest = low = FIRST_NUMBER - 1;
    unit *u = unit_of(oldest);
    /* Never machined: any valid rate. */
    *u = (unit){{0, 0, 0, (uint32_t)LINE << 30 | settings_start_rate()}};
    u->word[axis] = 0u - (uint32_t)above;
    hal_segment move;
    segment *s = in_window(low);
    (void)make((place){oldest, 0}, &move, s);
    s->start = oldest_start = -above;
    fresh_floor = floor_of(&move, -above, fresh_height + above, fresh_height, -above);
    hal_slot_write(low % HAL_SLOTS, &move);
}

void path_begin(void) {
    forget();
    known = true;
    unsigned axis = hal_jump_axis();
    fresh_height = axis < HAL_AXES ? hal_axis_command(axis) : 0;
    make_virtual();
    floor_in_force = fresh_floor;
    hal_origin(FIRST_NUMBER % HAL_SLOTS);
    const int32_t values[BOUNDS] = {
        [BOUND_AHEAD] = 0, [BOUND_FAST_AHEAD] = 0,
        [BOUND_BEHIND] = oldest_start, [BOUND_FAST_BEHIND] = oldest_start,
        [BOUND_FLOOR] = fresh_floor,
    };
    for (unsigned bound = 0; bound < BOUNDS; bound++) {
        bounds[bound] = values[bound];
        hal_bound_write((hal_bound)bound, values[bound]);
    }
}

/* The block in which the front is, or the one that it enters next. */
static uint32_t front_block(void) {
    return entered < loaded ? entry_of(entered)->block : fresh.block;
}

path_room path_has_room(void) {
    if (!known)
        return PATH_ROOM;
    if (next - front_block() > PATH_LEAD)
        return PATH_WAIT;
    if (next - oldest <= PATH_RING - 2)
        return PATH_ROOM;
    /* The oldest block goes. What then remains must cover a retraction from the front on. */
    hal_segment line = {0};
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        line.delta[axis] = (int32_t)unit_of(oldest)->word[axis];
    uint32_t length = is_arc(oldest) ? VALUE(unit_of(oldest + 1)->word[3]) : length_of(line.delta);
    int32_t start = moved(oldest_start, length);
    int32_t front = hal_front();
    uint32_t needed = limit + settings_get(SET_GAIN_PULSES);
    bool covered = difference(front, start) >= 0 && (uint32_t)difference(front, start) >= needed;
    if (!covered && difference(floor_in_force, start) < 0)
        return path_at_front() ? PATH_UNCOVERED : PATH_WAIT;
    if (low == high || in_window(low)->at.block == oldest)
        return PATH_WAIT;
    oldest = after(oldest);
    oldest_start = start;
    return next - oldest <= PATH_RING - 2 ? PATH_ROOM : PATH_WAIT;
}

uint32_t path_append(const path_move *move, uint32_t rate) {
    uint32_t block = next;
    unit *u = unit_of(next++);
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        u->word[axis] = (uint32_t)move->delta[axis];
    u->word[3] = (uint32_t)(move->arc ? ARC : LINE) << 30 | rate;
    if (move->arc)
        *unit_of(next++) = (unit){{(uint32_t)move->centre[0], (uint32_t)move->centre[1],
                                   (uint32_t)move->plane | (move->ccw ? SENSE : 0),
                                   (uint32_t)ARC_REST << 30}};
    return block;
}

static void finish_scan(int32_t floor) {
    scan.active = false;
    fresh_floor = floor_in_force = floor;
    if (loaded > FIRST_NUMBER)
        entry_of(loaded - 1)->floor = floor;
    write_bound(BOUND_FLOOR, floor);
}

void path_set_bounds(uint32_t new_limit, bool new_ceiling, int32_t new_height) {
    limit = new_limit;
    ceiling = new_ceiling;
    height = new_height;
    if (!known)
        return;
    if (!ceiling || oldest == next) {
        finish_scan(oldest_start);
        return;
    }
    scan.active = true;
    scan.at = fresh;
    scan.start = fresh_start;
    scan.from = fresh_height;
}

bool path_bounds_step(void) {
    for (unsigned count = 0; scan.active && count < SCAN; count++) {
        place at = scan.at;
        segment s;
        hal_segment move;
        if (!preceding(&at) || !make(at, &move, &s))
            return false;
        int32_t to = scan.from;
        scan.at = at;
        scan.from -= jump_travel(&move);
        scan.start = moved_back(scan.start, move.length);
        /* Back to the last point at the ceiling; beyond the limit no retraction goes. */
        if (scan.from > height || to > height)
            finish_scan(floor_of(&move, scan.start, scan.from, to, scan.start));
        else if ((at.block == oldest && at.piece == 0) ||
                 (uint32_t)difference(fresh_start, scan.start) > limit)
            finish_scan(scan.start);
        if (move.arc)
            break;
    }
    return !scan.active;
}

/* Number of the segment in which the machine is: the one of the window with the gateware's slot. At
   the end of what is loaded it may stand in a slot that is still empty. */
static uint32_t current(void) {
    uint32_t number = low + (hal_slot() - low) % HAL_SLOTS;
    return number < high ? number : high - 1;
}

/* Shrink the window by a segment, unless the machine is already beyond the new bound: what is
   overwritten must be out of its reach. */
static bool drop_low(void) {
    int32_t was = bounds[BOUND_BEHIND], now = in_window(low + 1)->start;
    if (difference(bounds[BOUND_FAST_BEHIND], now) < 0)
        write_bound(BOUND_FAST_BEHIND, now);
    write_bound(BOUND_BEHIND, now);
    if (difference(hal_command(), now) >= 0 && difference(hal_position(), now) >= 0) {
        low++;
        return true;
    }
    write_bound(BOUND_BEHIND, was);
    return false;
}

static bool drop_high(void) {
    int32_t was = bounds[BOUND_AHEAD], now = in_window(high - 1)->start;
    if (difference(bounds[BOUND_FAST_AHEAD], now) > 0)
        write_bound(BOUND_FAST_AHEAD, now);
    write_bound(BOUND_AHEAD, now);
    if (difference(hal_command(), now) <= 0 && difference(hal_position(), now) <= 0) {
        high--;
        return true;
    }
    write_bound(BOUND_AHEAD, was);
    return false;
}

/* A segment is loaded for the first time. */
static void begin_entry(const hal_segment *move) {
    int32_t to = fresh_height + jump_travel(move);
    fresh_floor = floor_of(move, fresh_start, fresh_height, to, fresh_floor);
    *entry_of(loaded++) = (entry){fresh.block, fresh_start, fresh_floor};
    fresh_height = to;
    fresh_start = moved(fresh_start, move->length);
    fresh = following(fresh);
}

static bool load_high(void) {
    segment made;
    hal_segment move;
    place at = fresh;
    if (high != loaded) {
        at = in_window(high - 1)->at;
        if (is_arc(at.block) && !bow_of(at.block))
            return true;
        at = following(at);
    }
    if (!make(at, &move, &made))
        return true;
    made.start = high == loaded ? fresh_start : end_of(high - 1);
    if (high - low == HAL_SLOTS && !drop_low())
        return false;
    *in_window(high) = made;
    if (high > low)
        join(high - 1);
    hal_slot_write(high % HAL_SLOTS, &move);
    if (high == loaded)
        begin_entry(&move);
    high++;
    write_bound(BOUND_AHEAD, end_of(high - 1));
    return true;
}

static bool load_low(void) {
    segment made;
    hal_segment move;
    place at = in_window(low)->at;
    if (!preceding(&at) || !make(at, &move, &made))
        return true;
    made.start = moved_back(in_window(low)->start, made.length);
    if (high - low == HAL_SLOTS && !drop_high())
        return false;
    low--;
    *in_window(low) = made;
    join(low);
    hal_slot_write(low % HAL_SLOTS, &move);
    write_bound(BOUND_BEHIND, made.start);
    return true;
}

static bool move_window(uint32_t at, bool backward) {
    uint32_t behind = backward ? FAR_SIDE : NEAR_SIDE, ahead = backward ? NEAR_SIDE : FAR_SIDE;
    bool full = high - low == HAL_SLOTS;
    bool more_high = high != loaded || fresh.block != next;
    bool more_low = low < high && (in_window(low)->at.block != oldest || in_window(low)->at.piece);
    if (more_high && high <= at + ahead && (!full || low + behind < at) && load_high())
        return true;
    return more_low && low + behind > at && (!full || high > at + ahead + 1) && load_low();
}

static void update_corners(uint32_t at) {
    uint32_t number = at;
    while (number + 1 < high && !in_window(number)->corner && !in_window(number)->slows)
        number++;
    write_bound(BOUND_FAST_AHEAD, end_of(number));
    for (number = at; number > low && !in_window(number - 1)->corner;)
        number--;
    write_bound(BOUND_FAST_BEHIND, in_window(number)->start);
    hal_fast_slot(at % HAL_SLOTS);
}

bool path_step(void) {
    if (!known || oldest == next)
        return false;
    if (low == high)
        return move_window(low, false);
    hal_motion_state state = hal_motion_read().state;
    bool moving = move_window(current(), state != MOTION_FRONT && state < MOTION_HIGH);
    update_corners(current());
    return moving;
}

uint32_t path_entered_slot(unsigned slot) {
    uint32_t number = entered + (slot - entered) % HAL_SLOTS;
    /* A segment is entered in its turn; anything else is an event of a path that was forgotten. */
    if (!known || number >= loaded)
        return front_block();
    entered = number;
    floor_in_force = entry_of(number)->floor;
    write_bound(BOUND_FLOOR, floor_in_force);
    return entry_of(number)->block;
}

uint32_t path_reached(void) {
    if (!known)
        return next;
    uint32_t number = entered, reached = front_block();
    int32_t front = hal_front();
    for (; number < loaded && difference(front, entry_of(number)->start) > 0; number++)
        reached = entry_of(number)->block + 1;
    return reached;
}

bool path_at_front(void) {
    if (!known)
        return true;
    hal_motion motion = hal_motion_read();
    return motion.state == MOTION_FRONT && !motion.moving && fresh.block == next &&
           high == loaded && hal_position() == fresh_start;
}
