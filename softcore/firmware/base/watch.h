// SPDX-License-Identifier: Apache-2.0
/* Calls of the watchdog. A step of the main loop stands between its two keys. A long step is cut into
   parts, and each part then has the watchdog's period to itself. */
#pragma once
#include "hal/hal.h"

#define WATCH_BEGIN 0xa5
#define WATCH_END 0x5a

static inline void watch_begin(void) { hal_pet(WATCH_BEGIN); }

/* Write the second key. Too soon after the last call this does nothing; the next call still comes
   in time. */
static inline void watch_end(void) {
    if (hal_watch_open())
        hal_pet(WATCH_END);
}

/* Cut a long step: what was done is one part of it, and what follows is another. */
void watch_between(void);
