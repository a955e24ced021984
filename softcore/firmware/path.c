// SPDX-License-Identifier: Apache-2.0
#include "path.h"

#include "settings.h"
#include "units.h"

/* Numbers begin here so that the virtual segment has one too; a multiple of the slots. */
#define FIRST_NUMBER HAL_SLOTS

/* Slots kept loaded behind and ahead of the segment in which the machine is. Going back needs more
   behind. Together with that segment they fill the window. */
#define NEAR_SIDE 15
#define FAR_SIDE (HAL_SLOTS - 1 - NEAR_SIDE)

/* Segments looked at per step when the floor is worked out anew: 64 take about a thousand clocks. */
#define SCAN 64

static path_segment ring[PATH_RING];
static bool known, virtual_segment;
static uint32_t oldest, next;               /* ring holds [oldest, next) */
static uint32_t low, high;                  /* window holds [low, high) */
static uint32_t entered;                    /* furthest segment entered */
static int32_t end[HAL_AXES];               /* machine position at the end of the path */
static int32_t end_direction[HAL_AXES];     /* of the last segment, 2**-15 */
static int32_t bounds[BOUNDS];              /* as written */
static uint32_t limit;
static bool ceiling;
static int32_t height;
static struct {
    bool active;
    uint32_t number;    /* segments from here on have been looked at */
    int32_t from;       /* jump axis at the start of that segment */
} scan;

static path_segment *segment(uint32_t number) { return &ring[number % PATH_RING]; }
static int32_t end_of(uint32_t number) {
    return (int32_t)((uint32_t)segment(number)->start + segment(number)->move.length);
}
/* Coordinate of the end of the path. */
static int32_t path_end(void) { return next > FIRST_NUMBER ? end_of(next - 1) : 0; }
/* Coordinates wrap: compare by difference. */
static int32_t difference(int32_t a, int32_t b) { return (int32_t)((uint32_t)a - (uint32_t)b); }

void path_init(void) {
    limit = 0;
    ceiling = known = virtual_segment = scan.active = false;
    oldest = next = low = high = entered = FIRST_NUMBER;
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

/* Path pulses into `move` after which its jump axis, beginning `drop` above the ceiling, is no
   longer above it: the least k with floor((2 k m + n) / 2n) >= drop. */
static uint32_t crossing(const hal_segment *move, uint32_t drop, unsigned axis) {
    uint32_t magnitude = 0u - (uint32_t)move->delta[axis];
    uint64_t numerator = (uint64_t)move->length * (2 * drop - 1);
    uint64_t divisor = 2 * (uint64_t)magnitude;
    return (uint32_t)((numerator + divisor - 1) / divisor);
}

/* Floor of a segment that begins at `from` and ends at `to` on the jump axis. */
static int32_t floor_of(const path_segment *s, int32_t from, int32_t to, int32_t before) {
    unsigned axis = hal_jump_axis();
    if (!ceiling || axis >= HAL_AXES || (from <= height && to <= height))
        return before;
    if (to > height)
        return (int32_t)((uint32_t)s->start + s->move.length);
    return (int32_t)((uint32_t)s->start + crossing(&s->move, (uint32_t)(from - height), axis));
}

/* The segment that leads back from the first point up to the soft limit. */
static void make_virtual(void) {
    unsigned axis = hal_jump_axis();
    int32_t above = axis < HAL_AXES ? settings_soft_limit() - end[axis] : 0;
    virtual_segment = above > 0;
    if (!virtual_segment)
        return;
    oldest = low = FIRST_NUMBER - 1;
    path_segment *s = segment(oldest);
    *s = (path_segment){.start = -above, .move = {.length = (uint32_t)above}};
    s->move.rate = settings_start_rate(); /* never machined: any valid rate */
    s->move.delta[axis] = -above;
    s->floor = floor_of(s, end[axis] + above, end[axis], s->start);
    direction_of(&s->move, end_direction);
    hal_slot_write(oldest % HAL_SLOTS, &s->move);
}

void path_begin(void) {
    oldest = next = low = high = entered = FIRST_NUMBER;
    scan.active = false;
    known = true;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        end[axis] = hal_axis_command(axis);
    make_virtual();
    hal_origin(FIRST_NUMBER % HAL_SLOTS);
    int32_t start = virtual_segment ? segment(oldest)->start : 0;
    const int32_t values[BOUNDS] = {
        [BOUND_AHEAD] = 0, [BOUND_FAST_AHEAD] = 0,
        [BOUND_BEHIND] = start, [BOUND_FAST_BEHIND] = start,
        [BOUND_FLOOR] = virtual_segment ? segment(oldest)->floor : 0,
    };
    for (unsigned bound = 0; bound < BOUNDS; bound++) {
        bounds[bound] = values[bound];
        hal_bound_write((hal_bound)bound, values[bound]);
    }
}

path_room path_has_room(void) {
    if (!known)
        return PATH_ROOM;
    if (next - entered > PATH_LEAD)
        return PATH_WAIT;
    if (next - oldest < PATH_RING)
        return PATH_ROOM;
    /* The oldest segment goes. What then remains must cover a retraction from the front on. */
    int32_t start = segment(oldest + 1)->start;
    int32_t front = hal_front();
    uint32_t needed = limit + settings_get(SET_GAIN_PULSES);
    bool covered = difference(front, start) >= 0 && (uint32_t)difference(front, start) >= needed;
    if (covered || difference(segment(entered)->floor, start) >= 0)
        return low > oldest ? PATH_ROOM : PATH_WAIT;
    return path_at_front() ? PATH_UNCOVERED : PATH_WAIT;
}

uint32_t path_append(const int32_t delta[HAL_AXES], uint32_t rate) {
    if (next - oldest == PATH_RING)
        oldest++;
    unsigned axis = hal_jump_axis();
    path_segment *before = next > oldest ? segment(next - 1) : 0;
    path_segment *s = segment(next);
    *s = (path_segment){.start = path_end()};
    for (unsigned i = 0; i < HAL_AXES; i++)
        s->move.delta[i] = delta[i];
    s->move.length = length_of(delta);
    s->move.rate = rate;
    int32_t from = axis < HAL_AXES ? end[axis] : 0;
    for (unsigned i = 0; i < HAL_AXES; i++)
        end[i] += delta[i];
    s->floor = floor_of(s, from, axis < HAL_AXES ? end[axis] : 0, before ? before->floor : 0);
    int32_t direction[HAL_AXES];
    direction_of(&s->move, direction);
    if (before) {
        /* Above the start/stop speed a lower feed, too, has to be reached before the junction. */
        before->slows = rate < before->move.rate && before->move.rate > settings_start_rate();
        before->corner = is_corner(direction, end_direction);
    }
    for (unsigned i = 0; i < HAL_AXES; i++)
        end_direction[i] = direction[i];
    return next++;
}

static void finish_scan(int32_t floor) {
    scan.active = false;
    if (next > oldest)
        segment(next - 1)->floor = floor;
    write_bound(BOUND_FLOOR, floor);
}

void path_set_bounds(uint32_t new_limit, bool new_ceiling, int32_t new_height) {
    limit = new_limit;
    ceiling = new_ceiling;
    height = new_height;
    if (!known)
        return;
    if (!ceiling || oldest == next) {
        finish_scan(oldest == next ? 0 : segment(oldest)->start);
        return;
    }
    scan.active = true;
    scan.number = next;
    scan.from = end[hal_jump_axis() % HAL_AXES];
}

bool path_bounds_step(void) {
    unsigned axis = hal_jump_axis() % HAL_AXES;
    int32_t front = path_end();
    for (unsigned count = 0; scan.active && count < SCAN; count++) {
        path_segment *s = segment(--scan.number);
        int32_t to = scan.from;
        scan.from -= s->move.delta[axis];
        /* Back to the last point at the ceiling; beyond the limit no retraction goes. */
        if (scan.from > height || to > height)
            finish_scan(floor_of(s, scan.from, to, s->start));
        else if (scan.number == oldest || (uint32_t)difference(front, s->start) > limit)
            finish_scan(s->start);
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
    int32_t was = bounds[BOUND_BEHIND], now = segment(low + 1)->start;
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
    int32_t was = bounds[BOUND_AHEAD], now = segment(high - 1)->start;
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

static bool move_window(uint32_t at, bool backward) {
    uint32_t behind = backward ? FAR_SIDE : NEAR_SIDE, ahead = backward ? NEAR_SIDE : FAR_SIDE;
    bool wants_high = high < next && high <= at + ahead;
    bool wants_low = low > oldest && low + behind > at;
    if (wants_high) {
        if (high - low < HAL_SLOTS || (low + behind < at && drop_low())) {
            hal_slot_write(high % HAL_SLOTS, &segment(high)->move);
            high++;
            write_bound(BOUND_AHEAD, end_of(high - 1));
            return true;
        }
    }
    if (wants_low) {
        if (high - low < HAL_SLOTS || (high > at + ahead + 1 && drop_high())) {
            low--;
            hal_slot_write(low % HAL_SLOTS, &segment(low)->move);
            write_bound(BOUND_BEHIND, segment(low)->start);
            return true;
        }
    }
    return false;
}

static void update_corners(uint32_t at) {
    uint32_t number = at;
    while (number + 1 < high && !segment(number)->corner && !segment(number)->slows)
        number++;
    write_bound(BOUND_FAST_AHEAD, end_of(number));
    for (number = at; number > low && !segment(number - 1)->corner;)
        number--;
    write_bound(BOUND_FAST_BEHIND, segment(number)->start);
    hal_fast_slot(at % HAL_SLOTS);
}

bool path_step(void) {
    if (!known || oldest == next)
        return false;
    hal_motion_state state = hal_motion_read().state;
    bool moved = move_window(current(), state != MOTION_FRONT && state < MOTION_HIGH);
    update_corners(current());
    return moved;
}

uint32_t path_entered_slot(unsigned slot) {
    uint32_t number = entered + (slot - entered) % HAL_SLOTS;
    /* A segment is entered in its turn; anything else is an event of a path that was forgotten. */
    if (!known || number >= next)
        return entered;
    entered = number;
    write_bound(BOUND_FLOOR, segment(number)->floor);
    return number;
}

uint32_t path_reached(void) {
    uint32_t number = entered;
    int32_t front = known ? hal_front() : 0;
    while (known && number < next && difference(front, segment(number)->start) > 0)
        number++;
    return known ? number : next;
}

bool path_at_front(void) {
    if (!known)
        return true;
    hal_motion motion = hal_motion_read();
    return motion.state == MOTION_FRONT && !motion.moving && high == next &&
           hal_position() == path_end();
}
