// SPDX-License-Identifier: Apache-2.0
/* One pass of the main loop, watched: the watchdog is called from its start and from its end, so that
   neither a loop that hangs nor one that skips its work looks alive. */
#pragma once
#include <stdint.h>

void watch_boot(void);          /* bring everything up; calls the watchdog in between */
void watch_pass(void);          /* one pass of the main loop */
void watch_interrupt(void);     /* answer the watchdog, if it asks: that interrupts are taken */

/* Clocks of the longest step since boot of a task: events, path, program, link. */
#define WATCH_TASKS 4
uint32_t watch_worst(unsigned task);
