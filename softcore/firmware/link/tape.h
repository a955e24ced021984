// SPDX-License-Identifier: Apache-2.0
/* Queue for the bytes of a tape, from the frames of the link to the program. The bytes of an
   aborted tape are taken and dropped. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

void tape_init(void);

/* For the frames. */
bool tape_begin(void);              /* false while another tape runs */
uint32_t tape_room(void);           /* room in bytes */
void tape_put(const uint8_t *bytes, uint32_t count);    /* no more than tape_room */
void tape_end(void);                /* there are no more bytes */
bool tape_due(void);                /* more is expected; also for a while after the program's end */

/* For the program. */
bool tape_waits(void);              /* a tape was begun, and a byte or its end has come */
void tape_run(void);                /* the tape runs from now on */
bool tape_runs(void);
int tape_byte(void);                /* the next byte, -1 if there is none */
bool tape_is_over(void);            /* no byte is left, and none will come */
void tape_finish(void);             /* the program has ended: further bytes are dropped */
void tape_drop(void);               /* forget the tape */
void tape_step(void);               /* end the wait for the trailer when its time is over */
