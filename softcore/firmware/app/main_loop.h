// SPDX-License-Identifier: Apache-2.0
/* The main loop under the watchdog. Each step calls the watchdog with one key at its start and
   another at its end, so neither a loop that hangs nor one that skips its work seems alive. */
#pragma once

void main_loop_boot(void);          /* bring everything up; calls the watchdog in between */
void main_loop_pass(void);          /* one pass of the main loop */
void main_loop_interrupt(void);     /* answer the watchdog's check that interrupts are taken */
