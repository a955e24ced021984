// SPDX-License-Identifier: Apache-2.0
#include "app/touch.h"

#include "link/output.h"
#include "path/path.h"

/* A first pulse may leave before the guard looks: the segment before it led away. */
#define START_PULSES 1

static touch_phase phase;
static int32_t start;               /* path coordinate */
static int32_t place[HAL_AXES];     /* of contact */

void touch_begin(void) {
    phase = TOUCH_LOOKS;
    start = hal_position();
}

void touch_end(void) { phase = TOUCH_NONE; }
touch_phase touch_now(void) { return phase; }

bool touch_takes(const hal_event *halt) {
    if (phase != TOUCH_LOOKS || halt->detail != EVENT_HALT_CONTACT)
        return false;
    path_note_work(true);
    bool gone = (uint32_t)halt->path - (uint32_t)start > START_PULSES;
    phase = gone ? TOUCH_FOUND : TOUCH_AT_START;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        place[axis] = halt->encoder[axis];
    return true;
}

void touch_tell(void) {
    bool found = phase == TOUCH_FOUND;
    for (unsigned axis = 0; !found && axis < HAL_AXES; axis++)
        place[axis] = hal_axis_position(axis);
    output_line("[PRB:%p,%p,%p:%u]", place[0], place[1], place[2], (uint32_t)found);
}
