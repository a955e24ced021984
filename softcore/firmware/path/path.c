// SPDX-License-Identifier: Apache-2.0
#include "path/path.h"

#include "base/settings.h"
#include "base/units.h"
#include "base/watch.h"
#include "path/approach.h"
#include "path/coordinate.h"
#include "path/corners.h"
#include "path/crossing.h"
#include "path/history.h"
#include "path/window.h"

/* Numbers begin here so that the virtual segment has one too; a multiple of the slots. */
#define FIRST_NUMBER HAL_SLOTS

/* Slots kept loaded behind and ahead: most lie ahead, for speed on short segments. */
#define NEAR_SIDE (HAL_SLOTS / 4 - 1)
#define FAR_SIDE (HAL_SLOTS - 1 - NEAR_SIDE)

/* Segments examined per step in the search for a new back limit; a line needs a square root. */
#define SCAN 3

/* Segments that get a new rate per step. */
#define PACES 16

/* Data of a segment, kept from its first loading until it is entered. */
typedef struct {
    uint32_t block;
    int32_t start;
    int32_t back_limit;         /* lowest coordinate that the ceiling allows from this segment on */
} entry;

#define ENTRIES (2 * HAL_SLOTS) /* a power of two */

static entry entries[ENTRIES];
static bool known, virtual_segment;
static int32_t oldest_start;                /* of the oldest block remembered */
static uint32_t loaded;                     /* segments below have been in the window */
static path_place fresh;                    /* the segment numbered `loaded` */
static int32_t fresh_start;
static int32_t fresh_height;                /* jump axis there */
static int32_t fresh_back_limit;            /* of the segment before */
static uint32_t entered;                    /* furthest segment entered */
static int32_t back_limit_in_force;
static uint32_t limit, kept;
static bool ceiling;
static int32_t height;
/* The search for a new back limit, back along the path. */
static struct {
    bool active;
    path_place at;      /* segments from here on have been examined */
    int32_t start;      /* coordinate there */
    int32_t from;       /* jump axis there */
} scan;
/* The change to new rates after an override. */
static struct {
    uint32_t next;      /* segments of the window from here on still have their old rates */
    bool active;
} pace;

static entry *entry_of(uint32_t number) { return &entries[number % ENTRIES]; }

static void forget(void) {
    history_forget(FIRST_NUMBER);
    window_low = window_high = loaded = entered = FIRST_NUMBER;
    oldest_start = fresh_start = fresh_back_limit = back_limit_in_force = 0;
    fresh = (path_place){FIRST_NUMBER, 0};
    kept = 0;
    scan.active = pace.active = false;
    corners_forget();
}

void path_init(void) {
    limit = 0;
    ceiling = known = virtual_segment = false;
    approach_init();
    (void)history_override(100, 100);
    forget();
}

uint32_t path_next(void) { return history_next(); }
bool path_has_back_limit(void) { return virtual_segment; }

/* Back limit of a segment from `from` to `to` on the jump axis; `back_limit` is that before it. */
static int32_t back_limit_of(const hal_segment *move, int32_t start, int32_t from, int32_t to,
                             int32_t back_limit) {
    unsigned axis = hal_jump_axis();
    if (!ceiling || axis >= HAL_AXES || (from <= height && to <= height))
        return back_limit;
    if (to > height)
        return moved(start, move->length);
    return moved(start, crossing_of(move, (uint32_t)(from - height), axis));
}

static int32_t jump_travel(const hal_segment *move) {
    unsigned axis = hal_jump_axis();
    return axis < HAL_AXES ? move->delta[axis] : 0;
}

/* Make the virtual segment that leads back from the first point up to the soft limit. */
static void make_virtual(void) {
    unsigned axis = hal_jump_axis();
    int32_t above = axis < HAL_AXES ? settings_travel()->high[axis] - fresh_height : 0;
    virtual_segment = above > 0;
    if (!virtual_segment)
        return;
    window_low = FIRST_NUMBER - 1;
    /* The front never passes it: any valid rate will do. */
    history_prepend(axis, -above, settings_start_rate());
    hal_segment move;
    path_segment *s = window_segment(window_low);
    (void)history_make((path_place){window_low, 0}, &move, s);
    s->start = oldest_start = -above;
    fresh_back_limit = back_limit_of(&move, -above, fresh_height + above, fresh_height, -above);
    hal_slot_write(window_low % HAL_SLOTS, &move);
}

void path_forget(void) {
    forget();
    known = false;
    hal_bound_write(BOUND_AHEAD, 0);
    hal_origin(FIRST_NUMBER % HAL_SLOTS);
}

void path_begin(void) {
    forget();
    known = true;
    unsigned axis = hal_jump_axis();
    fresh_height = axis < HAL_AXES ? history_end(axis) : 0;
    make_virtual();
    back_limit_in_force = fresh_back_limit;
    const int32_t values[BOUNDS] = {
        [BOUND_AHEAD] = 0, [BOUND_FAST_AHEAD] = 0,
        [BOUND_BEHIND] = oldest_start, [BOUND_FAST_BEHIND] = oldest_start,
        [BOUND_BACK_LIMIT] = fresh_back_limit,
    };
    for (unsigned bound = 0; bound < BOUNDS; bound++) {
        window_bounds[bound] = values[bound];
        hal_bound_write((hal_bound)bound, values[bound]);
    }
    /* Last, after the bounds: with old bounds the machine could enter a slot not yet written. */
    hal_origin(FIRST_NUMBER % HAL_SLOTS);
}

/* The block of the front, or the block that the front enters next. */
static uint32_t front_block(void) {
    return entered < loaded ? entry_of(entered)->block : fresh.block;
}

path_room path_has_room(void) {
    if (!known)
        return PATH_ROOM;
    if (history_next() - front_block() > PATH_LEAD)
        return PATH_WAIT;
    if (history_has_room())
        return PATH_ROOM;
    /* Drop the oldest block, if the others still cover a retraction from the front. */
    int32_t start = moved(oldest_start, history_oldest_length());
    int32_t front = hal_front();
    uint32_t needed = (kept > limit ? kept : limit) + settings_get(SET_GAIN_PULSES);
    bool covered = difference(front, start) >= 0 && (uint32_t)difference(front, start) >= needed;
    if (!covered && difference(back_limit_in_force, start) < 0)
        return path_at_front() ? PATH_UNCOVERED : PATH_WAIT;
    if (window_low == window_high || window_segment(window_low)->at.block == history_oldest())
        return PATH_WAIT;
    history_drop();
    oldest_start = start;
    return history_has_room() ? PATH_ROOM : PATH_WAIT;
}

uint32_t path_append(const path_move *move, uint32_t rate, bool rapid, bool discharge) {
    return history_append(move, rate, rapid, !discharge && approach_leads_away(move));
}

uint32_t path_remembered(void) {
    int32_t from = window_bounds[BOUND_BACK_LIMIT];
    if (difference(oldest_start, from) > 0)
        from = oldest_start;
    int32_t length = known ? difference(hal_front(), from) : 0;
    return length > 0 ? (uint32_t)length : 0;
}

void path_keep(uint32_t distance) { kept = distance; }

void path_override(uint32_t feed, uint32_t rapid) {
    if (!history_override(feed, rapid))
        return;
    pace.next = window_low;
    pace.active = true;
}

/* Give loaded segments their new rate. Segments that are loaded meanwhile already have it. */
__attribute__((noinline)) static void renew_rates(void) {
    if (pace.next < window_low)
        pace.next = window_low;
    for (unsigned count = 0; count < PACES && pace.next < window_high; count++, pace.next++) {
        path_segment *s = window_segment(pace.next);
        uint32_t rate = history_rate(s->at.block);
        hal_slot_pace(pace.next % HAL_SLOTS, s->length, rate);
        s->rate = s->bound && rate > s->bound ? s->bound : rate;
        if (pace.next > window_low)
            corners_join_rates(pace.next - 1);
    }
    pace.active = pace.next < window_high;
    /* The new rates change where the machine must slow down: find the fast range again. */
    if (!pace.active)
        corners_forget();
}

static void finish_scan(int32_t back_limit) {
    scan.active = false;
    fresh_back_limit = back_limit_in_force = back_limit;
    if (loaded > FIRST_NUMBER)
        entry_of(loaded - 1)->back_limit = back_limit;
    window_bound(BOUND_BACK_LIMIT, back_limit);
}

void path_set_bounds(uint32_t new_limit, bool new_ceiling, int32_t new_height) {
    limit = new_limit;
    ceiling = new_ceiling;
    height = new_height;
    if (!known)
        return;
    if (!ceiling || history_empty()) {
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
        path_place at = scan.at;
        path_segment s;
        hal_segment move;
        if (!history_preceding(&at) || !history_make(at, &move, &s))
            return false;
        int32_t to = scan.from;
        scan.at = at;
        scan.from -= jump_travel(&move);
        scan.start = moved_back(scan.start, move.length);
        /* End at the last point below the ceiling, or where no retraction can reach. */
        if (scan.from > height || to > height)
            finish_scan(back_limit_of(&move, scan.start, scan.from, to, scan.start));
        else if ((at.block == history_oldest() && at.piece == 0) ||
                 (uint32_t)difference(fresh_start, scan.start) > limit)
            finish_scan(scan.start);
        if (move.arc)
            break;
    }
    return !scan.active;
}

/* Number of the machine's segment, by the gateware's slot. It may be empty at the end. */
static uint32_t current(void) {
    uint32_t number = window_low + (hal_slot() - window_low) % HAL_SLOTS;
    return number < window_high ? number : window_high - 1;
}

void path_note_work(bool touched) {
    if (!known || window_low == window_high)
        return;
    uint32_t number = current();
    bool stands = hal_position() == window_segment(number)->start;
    if (stands && !touched && number > window_low)
        number--;
    if (!window_segment(number)->away && !(stands && touched))
        approach_note(window_segment(number)->way);
}

void path_note_touch(void) {
    if (known && window_low != window_high && hal_position() != window_segment(current())->start)
        approach_note(window_segment(current())->way);
}

/* Drop a segment, unless the machine is beyond the new bound: it must not reach a free slot. */
static bool drop_low(void) {
    int32_t was = window_bounds[BOUND_BEHIND], now = window_segment(window_low + 1)->start;
    if (difference(window_bounds[BOUND_FAST_BEHIND], now) < 0)
        window_bound(BOUND_FAST_BEHIND, now);
    window_bound(BOUND_BEHIND, now);
    if (difference(hal_command(), now) >= 0 && difference(hal_position(), now) >= 0) {
        window_low++;
        return true;
    }
    window_bound(BOUND_BEHIND, was);
    return false;
}

static bool drop_high(void) {
    int32_t was = window_bounds[BOUND_AHEAD], now = window_segment(window_high - 1)->start;
    if (difference(window_bounds[BOUND_FAST_AHEAD], now) > 0)
        window_bound(BOUND_FAST_AHEAD, now);
    window_bound(BOUND_AHEAD, now);
    if (difference(hal_command(), now) <= 0 && difference(hal_position(), now) <= 0) {
        window_high--;
        return true;
    }
    window_bound(BOUND_AHEAD, was);
    return false;
}

/* Note a segment that is loaded for the first time. */
static void begin_entry(const hal_segment *move) {
    int32_t to = fresh_height + jump_travel(move);
    fresh_back_limit = back_limit_of(move, fresh_start, fresh_height, to, fresh_back_limit);
    *entry_of(loaded++) = (entry){fresh.block, fresh_start, fresh_back_limit};
    fresh_height = to;
    fresh_start = moved(fresh_start, move->length);
    fresh = history_following(fresh);
}

static bool load_high(void) {
    path_segment made;
    hal_segment move;
    path_place at = fresh;
    if (window_high != loaded) {
        at = window_segment(window_high - 1)->at;
        if (!history_ready(at))
            return true;
        at = history_following(at);
    }
    if (!history_make(at, &move, &made))
        return true;
    if (move.arc)
        watch_between();
    made.start = window_high == loaded ? fresh_start : window_end(window_high - 1);
    if (window_high - window_low == HAL_SLOTS && !drop_low())
        return false;
    *window_segment(window_high) = made;
    if (window_high > window_low)
        corners_join(window_high - 1);
    hal_slot_write(window_high % HAL_SLOTS, &move);
    if (window_high == loaded)
        begin_entry(&move);
    window_high++;
    window_bound(BOUND_AHEAD, window_end(window_high - 1));
    return true;
}

static bool load_low(void) {
    path_segment made;
    hal_segment move;
    path_place at = window_segment(window_low)->at;
    if (!history_preceding(&at) || !history_make(at, &move, &made))
        return true;
    if (move.arc)
        watch_between();
    made.start = moved_back(window_segment(window_low)->start, made.length);
    if (window_high - window_low == HAL_SLOTS && !drop_high())
        return false;
    window_low--;
    *window_segment(window_low) = made;
    corners_join(window_low);
    hal_slot_write(window_low % HAL_SLOTS, &move);
    window_bound(BOUND_BEHIND, made.start);
    return true;
}

static bool move_window(uint32_t at, bool backward) {
    uint32_t behind = backward ? FAR_SIDE : NEAR_SIDE, ahead = backward ? NEAR_SIDE : FAR_SIDE;
    bool full = window_high - window_low == HAL_SLOTS;
    bool more_high = window_high != loaded || fresh.block != history_next();
    bool more_low = window_low < window_high &&
                    (window_segment(window_low)->at.block != history_oldest() ||
                     window_segment(window_low)->at.piece);
    if (more_high && window_high <= at + ahead && (!full || window_low + behind < at) &&
        load_high())
        return true;
    return more_low && window_low + behind > at && (!full || window_high > at + ahead + 1) &&
           load_low();
}

bool path_step(void) {
    if (!known || history_empty())
        return false;
    if (window_low == window_high)
        return move_window(window_low, false);
    if (pace.active) {
        renew_rates();
        return true;
    }
    hal_motion_state state = hal_motion_read().state;
    bool moving = move_window(current(), state != MOTION_FRONT && state < MOTION_HIGH);
    corners_update(current());
    return moving;
}

uint32_t path_entered_slot(unsigned slot) {
    uint32_t number = entered + (slot - entered) % HAL_SLOTS;
    /* Segments are entered in order; any other event belongs to a forgotten path. */
    if (!known || number >= loaded)
        return front_block();
    entered = number;
    back_limit_in_force = entry_of(number)->back_limit;
    window_bound(BOUND_BACK_LIMIT, back_limit_in_force);
    return entry_of(number)->block;
}

uint32_t path_reached(void) {
    if (!known)
        return history_next();
    uint32_t number = entered, reached = front_block();
    int32_t front = hal_front();
    for (; number < loaded && difference(front, entry_of(number)->start) > 0; number++)
        reached = entry_of(number)->block + 1;
    return reached;
}

uint32_t path_within(void) {
    if (!known || entered >= loaded)
        return 0;
    uint32_t block = entry_of(entered)->block, first = entered;
    while (first > FIRST_NUMBER && loaded - first < ENTRIES && entry_of(first - 1)->block == block)
        first--;
    int32_t from = entry_of(first)->start, at = hal_position();
    int32_t to = entered + 1 < loaded ? entry_of(entered + 1)->start : fresh_start;
    return difference(at, from) < 0 || difference(to, at) < 0 ? 0 : block;
}

bool path_at_front(void) {
    hal_motion motion = hal_motion_read();
    return !known || (motion.state == MOTION_FRONT && !motion.moving && window_high == loaded &&
                      fresh.block == history_next() && hal_position() == fresh_start);
}

static bool goes_on(void) {
    return known && window_low != window_high && hal_position() != window_bounds[BOUND_AHEAD];
}

uint32_t path_free(void) {
    /* The machine's own block counts as free: the machine is leaving it, or nothing follows it. */
    uint32_t used = known ? history_next() - front_block() : 0;
    return used <= 1 ? PATH_LEAD : used <= PATH_LEAD ? PATH_LEAD + 1 - used : 0;
}

bool path_goes_on(void) {
    return goes_on() && !pace.active && corners_known_in(hal_slot());
}

bool path_goes_further(void) {
    return hal_position() != window_bounds[BOUND_AHEAD] && corners_known_in(hal_slot());
}

uint32_t path_pace(void) { return goes_on() ? window_segment(current())->rate : 0; }
