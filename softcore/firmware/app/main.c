// SPDX-License-Identifier: Apache-2.0
/* Entry points of the target: reset and traps. */
#include "app/events.h"
#include "app/main_loop.h"
#include "hal/hal.h"

#define CAUSE_INTERRUPT 0x80000000u

/* Called by start.S. After an exception the firmware cannot go on: it trips the interlock and stops
   calling the watchdog. */
void trap(uint32_t cause) {
    if (cause & CAUSE_INTERRUPT) {
        main_loop_interrupt();
        events_interrupt();
        return;
    }
    hal_interlock_trip();
    for (;;) {
    }
}

int main(void) {
    /* In another gateware the registers would have other meanings. */
    if (hal_is_gapkeeper()) {
        main_loop_boot();
        for (;;)
            main_loop_pass();
    }
    for (;;) {
    }
}
