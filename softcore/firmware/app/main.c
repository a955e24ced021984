// SPDX-License-Identifier: Apache-2.0
/* Entry points of the target: reset and traps. */
#include "app/events.h"
#include "app/watch.h"
#include "hal/hal.h"

#define CAUSE_INTERRUPT 0x80000000u

/* Called by start.S. An exception means that the program cannot go on: the interlock is tripped and
   the watchdog no longer called. */
void trap(uint32_t cause) {
    if (cause & CAUSE_INTERRUPT) {
        watch_interrupt();
        events_interrupt();
        return;
    }
    hal_interlock_trip();
    for (;;) {
    }
}

int main(void) {
    /* Registers of another gateware would mean something else. */
    if (hal_is_gapkeeper()) {
        watch_boot();
        for (;;)
            watch_pass();
    }
    for (;;) {
    }
}
