// SPDX-License-Identifier: Apache-2.0
#include "app/touch.h"

#include "base/settings.h"
#include "base/units.h"
#include "link/output.h"
#include "path/path.h"

/* A first pulse may leave before the guard looks: the segment before it led away. */
#define START_PULSES 1

/* Ss is as old as the last look until it has seen all pulses of its window anew. Some more, as the
   sensing pulses begin a little later than the motion. */
#define WINDOWS 2

static touch_phase phase;
static bool opens;                  /* looks for the end of contact */
static int32_t start;               /* path coordinate */
static uint32_t moved;              /* clock in which the motion was seen; 0 before */
static uint32_t fresh;              /* clocks from there until Ss is that of this motion */
static int32_t place[HAL_AXES];     /* found, or where the last touch-off ended */
static bool found;                  /* the last touch-off has found it */

void touch_init(void) {
    phase = TOUCH_NONE;
    found = false;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        place[axis] = 0;
}

void touch_begin(bool away) {
    phase = TOUCH_LOOKS;
    opens = away;
    start = hal_position();
    moved = 0;
    fresh = units_clocks_of_us(WINDOWS * settings_get(SET_SHORT_WINDOW) *
                               (settings_get(SET_SENSE_ON_NS) + settings_get(SET_SENSE_OFF_NS)) / 1000);
}

void touch_end(void) { phase = TOUCH_NONE; }
touch_phase touch_now(void) { return phase; }

touch_phase touch_look(void) {
    if (phase != TOUCH_LOOKS || !opens)
        return phase;
    uint32_t now = hal_cycle_low();
    if (!moved) {
        if (hal_motion_read().moving || hal_position() != start)
            moved = now | 1;
    } else if (now - moved > fresh) {
        if (!hal_shorted()) {
            phase = fresh ? TOUCH_AT_START : TOUCH_FOUND;
            for (unsigned axis = 0; axis < HAL_AXES; axis++)
                place[axis] = hal_axis_position(axis);
        }
        fresh = 0;
    }
    return phase;
}

bool touch_takes(const hal_event *halt) {
    /* On a way out of contact: a halt only by a new contact, after the gap was open. */
    if (phase != TOUCH_LOOKS || halt->detail != EVENT_HALT_CONTACT || (opens && fresh))
        return false;
    if (!opens)
        path_note_touch();
    bool gone = opens || (uint32_t)halt->path - (uint32_t)start > START_PULSES;
    phase = gone ? TOUCH_FOUND : TOUCH_AT_START;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        place[axis] = halt->encoder[axis];
    return true;
}

void touch_tell(void) {
    found = phase == TOUCH_FOUND;
    for (unsigned axis = 0; !found && axis < HAL_AXES; axis++)
        place[axis] = hal_axis_position(axis);
    touch_tell_last();
}

void touch_tell_last(void) {
    output_line("[PRB:%p,%p,%p:%u]", place[0], place[1], place[2], (uint32_t)found);
}
