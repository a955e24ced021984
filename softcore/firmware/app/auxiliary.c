// SPDX-License-Identifier: Apache-2.0
#include "app/auxiliary.h"

#include "app/events.h"

void auxiliary_send(hal_letter letter, uint32_t code) {
    (void)hal_auxiliary_timed_out(); /* an old time-out is not this function's */
    hal_auxiliary_send(letter, code);
    events_now(EVENT_WORD_AUX, EVENT_FORMAT_AUX, "MST"[letter], code);
}

auxiliary_result auxiliary_poll(void) {
    if (hal_auxiliary_busy())
        return AUXILIARY_WAIT;
    return hal_auxiliary_timed_out() ? AUXILIARY_LATE : AUXILIARY_DONE;
}
