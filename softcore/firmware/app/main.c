// SPDX-License-Identifier: Apache-2.0
/* Entry points of the target: reset and traps. */
#include "app/events.h"
#include "app/main_loop.h"
#include "hal/hal.h"

#define CAUSE_INTERRUPT 0x80000000u

/* Called by start.S. An exception means that the program cannot go on: the interlock is tripped and
   the watchdog no longer called. */
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
    /* Registers of another gateware would mean something else. */
    if (hal_is_gapkeeper()) {
        main_loop_boot();
        for (;;)
            main_loop_pass();
    }
    for (;;) {
    }
}
