// SPDX-License-Identifier: Apache-2.0
/* Tells the host in order what the gateware did.

   The interrupt handler moves events from the gateware's short queue into a ring. The main loop
   turns the ring into lines. The line of a retraction's end has to wait for the motor's overshoot;
   all later lines wait for it. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "hal/hal.h"

void events_init(void);
void events_interrupt(void);    /* the interrupt handler */
bool events_step(void);         /* at most one line; true if there was something to do */
uint32_t events_worst(void);    /* most clocks so far from an event until the handler took it */
bool events_idle(void);         /* no event waits to be told */
void events_drop(void);         /* forget the events that wait, and the notices */

/* Leave a notice for the time when the machine enters block `number` of the path: the block's line
   is in force from then on, and a block from a tape is told and bookmarked. The caller first
   asks whether there is room, and does not change the state before. */
bool events_notice_room(void);
void events_notice(uint32_t number, uint32_t line, const char *text, uint32_t length);

/* Tell the next block that has a notice; false if there is none. For a machine at the front. Call
   once in a pass of the main loop: many blocks without motion may wait. */
bool events_tell_notice(void);

/* Tell an event of the main program, with the present time and position. */
void events_now(const char *name, const char *format, ...);

/* Speeds of the re-advance, for its events: um/min. */
void events_speeds(uint32_t high, uint32_t low, uint32_t jump_high);
