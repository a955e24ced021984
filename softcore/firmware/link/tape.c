// SPDX-License-Identifier: Apache-2.0
#include "link/tape.h"

#include "base/units.h"
#include "hal/hal.h"

#define ROOM 512            /* bytes; a power of two */

/* A sender may stop at the program's end, or send the trailer of the tape. This is the time to wait
   for the trailer. */
#define TRAILER_US 300000

static uint8_t bytes[ROOM];
static uint32_t head, tail;     /* free-running */
static enum { NONE, OPEN, RUNNING, OVER } state;
static uint32_t over_since;     /* clock of the program's end, in state OVER */
static bool ended;              /* no more bytes will come */

void tape_init(void) {
    tape_drop();
    ended = false;
}

void tape_drop(void) {
    state = NONE;
    head = tail = 0;
}

bool tape_begin(void) {
    if (state == RUNNING)
        return false;
    state = OPEN;
    head = tail = 0;
    ended = false;
    return true;
}

uint32_t tape_room(void) { return ROOM - (head - tail); }

void tape_put(const uint8_t *from, uint32_t count) {
    if (state != OPEN && state != RUNNING)
        return;
    uint32_t place = head % ROOM, first = ROOM - place;
    first = first < count ? first : count;
    __builtin_memcpy(bytes + place, from, first);
    __builtin_memcpy(bytes, from + first, count - first);
    head += count;
}

void tape_end(void) { ended = true; }
bool tape_due(void) { return state != NONE && !ended; }

bool tape_waits(void) { return state == OPEN && (head != tail || ended); }
void tape_run(void) { state = RUNNING; }
bool tape_runs(void) { return state == RUNNING; }
int tape_byte(void) { return head == tail ? -1 : bytes[tail++ % ROOM]; }
bool tape_is_over(void) { return head == tail && ended; }

void tape_finish(void) {
    state = OVER;
    over_since = hal_cycle_low();
}

void tape_step(void) {
    if (state == OVER && (ended || hal_cycle_low() - over_since > units_clocks_of_us(TRAILER_US)))
        state = NONE;
}
