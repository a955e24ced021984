// SPDX-License-Identifier: Apache-2.0
/* One pass of the main loop, watched: the watchdog is called from its start and from its end, so that
   neither a loop that hangs nor one that skips its work looks alive. */
#pragma once

void main_loop_boot(void);          /* bring everything up; calls the watchdog in between */
void main_loop_pass(void);          /* one pass of the main loop */
void main_loop_interrupt(void);     /* answer the watchdog, if it asks: that interrupts are taken */
