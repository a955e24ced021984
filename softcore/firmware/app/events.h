// SPDX-License-Identifier: Apache-2.0
/* What the gateware did, told to the host in order.

   The interrupt handler moves the gateware's short queue into a ring; the main loop turns the ring
   into lines. The line of a retraction's end waits for the motor's overshoot, and everything behind
   it waits too. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

void events_init(void);
void events_interrupt(void);    /* the interrupt handler */
bool events_step(void);         /* at most one line; true if there was something to do */
uint32_t events_worst(void);    /* clocks from an event until the handler had it, at most so far */
bool events_idle(void);         /* nothing is waiting to be told */
void events_drop(void);         /* forget what waits, and the notices */

/* Announce a block when the machine enters segment `number`: its line is in force from then on, and it
   is told if it comes from a tape. */
bool events_notice_room(void);
void events_notice(uint32_t number, uint32_t line, const char *text, uint32_t length);

/* Announce the next block that still waits, for when the machine is at the front; false if there was
   none. One a pass of the main loop: many blocks without motion may wait. */
bool events_tell_notice(void);

/* An event of the main program, now. */
void events_now(const char *name, const char *format, ...);

/* Speeds of the re-advance, for its events: um/min. */
void events_speeds(uint32_t high, uint32_t low, uint32_t jump_high);
