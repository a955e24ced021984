// SPDX-License-Identifier: Apache-2.0
#include "app/auxiliary.h"

#include "app/events.h"

static uint32_t last[2];    /* codes of S and T */
static bool fluid;

void auxiliary_init(void) {
    last[0] = last[1] = 0;
    fluid = false;
}

uint32_t auxiliary_last(hal_letter letter) { return last[letter == AUXILIARY_T]; }
bool auxiliary_fluid(void) { return fluid; }

void auxiliary_send(hal_letter letter, uint32_t code) {
    if (letter != AUXILIARY_M)
        last[letter == AUXILIARY_T] = code;
    else if (code == 8 || code == 9)
        fluid = code == 8;
    (void)hal_auxiliary_timed_out(); /* clears the time-out of an earlier function */
    hal_auxiliary_send(letter, code);
    events_now(EVENT_WORD_AUX, EVENT_FORMAT_AUX, "MST"[letter], code);
}

auxiliary_result auxiliary_poll(void) {
    if (hal_auxiliary_busy())
        return AUXILIARY_WAIT;
    return hal_auxiliary_timed_out() ? AUXILIARY_LATE : AUXILIARY_DONE;
}
