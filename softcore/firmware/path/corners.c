// SPDX-License-Identifier: Apache-2.0
#include "path/corners.h"

#include "base/settings.h"
#include "base/units.h"
#include "path/window.h"

/* Corners behind the next one that are looked at: their zones may begin before it. */
#define NEAR 8

/* The range in which the machine may be fast. */
static struct {
    bool known;
    uint32_t at;        /* the machine's segment when the range was found */
    uint32_t low, high; /* the window at that time */
    uint32_t from, to;  /* first and last segment of the range */
    bool leaves;        /* the machine is just behind a corner: look again */
} fast;

void corners_forget(void) { fast.known = false; }

bool corners_known_in(unsigned slot) {
    return fast.known && !fast.leaves && slot == fast.at % HAL_SLOTS;
}

/* The rate at which drives round a junction by no more than the setting; 0 if it is not below the
   highest. The rounding grows with the sine of the angle up to 90 degrees, and no more behind. */
__attribute__((noinline)) static uint32_t turn_rate(const int32_t a[HAL_AXES],
                                                    const int32_t b[HAL_AXES]) {
    uint64_t square = 0; /* of the chord between the directions, 2**-30; then of the sine */
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int64_t step = a[axis] - b[axis];
        square += (uint64_t)(step * step);
    }
    uint32_t upright = settings_corner_rate(), least = settings_corner_sine();
    if (square >= 2u << 30)
        return least < 1u << 15 ? upright : 0;
    square -= square * square >> 32;
    if (square <= (uint64_t)least * least)
        return 0;
    return (uint32_t)units_quotient((uint64_t)upright << 15, units_root(square));
}

/* Above the start/stop speed, a lower feed must be reached before the junction. */
void corners_join_rates(uint32_t number) {
    path_segment *a = window_segment(number);
    a->slows = window_segment(number + 1)->rate < a->rate && a->rate > settings_start_rate();
}

/* A junction is a corner, and not tangent, if at the highest speed an axis would change its speed
   by more than the start/stop speed, which the machine can do at once, or if the lag of the drives
   would round it by more than the setting. Within an arc the highest speed is the same. */
void corners_join(uint32_t number) {
    path_segment *a = window_segment(number);
    const path_segment *b = window_segment(number + 1);
    corners_join_rates(number);
    a->turn = 0;
    a->corner = false;
    if (a->at.block == b->at.block)
        return;
    uint32_t sum = 0, most = 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t step = b->from[axis] - a->to[axis];
        uint32_t size = (uint32_t)(step < 0 ? -step : step);
        sum += size;
        most = size > most ? size : most;
    }
    /* The chord, and the sine, are at most the sum. */
    if (sum > settings_corner_sine())
        a->turn = turn_rate(b->from, a->to);
    a->corner = a->turn || a->tight || b->tight || most > settings_tangent_step();
}

/* Extend the fast range as far as the junctions allow. */
static void spread(void) {
    if (fast.to >= window_high)
        fast.to = window_high - 1;
    if (fast.from < window_low)
        fast.from = window_low;
    while (fast.to + 1 < window_high && !window_segment(fast.to)->corner &&
           !window_segment(fast.to)->slows)
        fast.to++;
    while (fast.from > window_low && !window_segment(fast.from - 1)->corner)
        fast.from--;
}

/* A place where the machine must be slow, and the bound of its rate from there on, 0 for none. */
typedef struct {
    int32_t at;
    uint32_t rate;
} slow_place;

/* Pulses at the rate of a corner in a time. */
static uint32_t way_of(uint32_t rate, uint32_t clocks) {
    uint32_t start = settings_start_rate();
    return (uint32_t)((uint64_t)clocks * (rate < start ? rate : start) >> 32);
}

static void slower(slow_place *place, int32_t at, uint32_t rate, bool sooner) {
    if (sooner)
        place->at = at;
    if (!place->rate || rate < place->rate)
        place->rate = rate;
}

/* The corner at the end of a segment, and those behind it whose zones begin before it. */
__attribute__((noinline)) static slow_place slow_ahead(uint32_t to) {
    int32_t border = window_end(to);
    slow_place place = {border, 0};
    for (uint32_t number = to; number + 1 < window_high && number < to + NEAR; number++) {
        uint32_t rate = window_segment(number)->turn;
        if (!rate)
            continue;
        int32_t at = moved_back(window_end(number), way_of(rate, settings_corner_before()));
        if (number == to || difference(at, border) < 0)
            slower(&place, at, rate, difference(at, place.at) < 0);
    }
    return place;
}

/* The same for the way back from the start of a segment. */
__attribute__((noinline)) static slow_place slow_behind(uint32_t from) {
    int32_t border = window_segment(from)->start;
    slow_place place = {border, 0};
    for (uint32_t number = from; number > window_low && number + NEAR > from; number--) {
        uint32_t rate = window_segment(number - 1)->turn;
        if (!rate)
            continue;
        int32_t at = moved(window_segment(number)->start, way_of(rate, settings_corner_before()));
        if (number == from || difference(at, border) > 0)
            slower(&place, at, rate, difference(at, place.at) > 0);
    }
    return place;
}

/* In the unit of the bound, where 0 is none. */
static int32_t bound_of(uint32_t rate) { return (int32_t)(rate ? (rate >> 4) + !(rate >> 4) : 0); }

/* The machine has just passed the corner at `corner`, either way (`behind`: its distance from it),
   and must still be slow there. `next` is the place before the next one. */
__attribute__((noinline)) static bool leaves(slow_place *next, int32_t corner, uint32_t rate,
                                             int32_t behind, bool forward) {
    int32_t way = (int32_t)way_of(rate, settings_corner_behind());
    if (behind >= way)
        return false;
    int32_t until = forward ? moved(corner, (uint32_t)way) : moved_back(corner, (uint32_t)way);
    int32_t apart = forward ? difference(next->at, until) : difference(until, next->at);
    if (apart > 0)
        next->rate = 0;
    slower(next, corner, rate, true);
    return true;
}

static bool leaves_corner(uint32_t at, slow_place *ahead, slow_place *behind) {
    const path_segment *s = window_segment(at);
    int32_t begin = s->start, end = window_end(at), position = hal_position();
    uint32_t entry = at > window_low ? window_segment(at - 1)->turn : 0;
    bool slow = false;
    /* At the front of the first point the machine begins from rest. */
    if (entry && (begin || hal_motion_read().state != MOTION_FRONT))
        slow = leaves(ahead, begin, entry, difference(position, begin), true);
    if (at + 1 < window_high && s->turn)
        slow |= leaves(behind, end, s->turn, difference(end, position), false);
    return slow;
}

/* The range found before is extended: a search of the whole window after each segment would take
   longer than to make the segment. */
void corners_update(uint32_t at) {
    if (!fast.known || fast.at != at || fast.low != window_low || fast.high != window_high ||
        fast.leaves) {
        if (fast.known)
            spread();
        if (!fast.known || at < fast.from || at > fast.to) {
            fast.from = fast.to = at;
            spread();
        }
        /* After a move back, lower feeds ahead may lie inside the range. */
        for (uint32_t number = at; fast.known && number < fast.at && number < fast.to; number++)
            if (window_segment(number)->slows)
                fast.to = number;
        fast.known = true;
        fast.at = at;
        fast.low = window_low;
        fast.high = window_high;
        /* At the ends of the window there are no corners, as on long straight paths. */
        slow_place ahead = {window_end(fast.to), 0}, behind = {window_segment(fast.from)->start, 0};
        if (fast.to + 1 < window_high)
            ahead = slow_ahead(fast.to);
        if (fast.from > window_low)
            behind = slow_behind(fast.from);
        fast.leaves = leaves_corner(at, &ahead, &behind);
        window_bound(BOUND_FAST_AHEAD, ahead.at);
        window_bound(BOUND_FAST_BEHIND, behind.at);
        window_bound(BOUND_FAST_AHEAD_RATE, bound_of(ahead.rate));
        window_bound(BOUND_FAST_BEHIND_RATE, bound_of(behind.rate));
    }
    hal_fast_slot(at % HAL_SLOTS);
}
