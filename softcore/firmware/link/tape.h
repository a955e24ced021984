// SPDX-License-Identifier: Apache-2.0
/* The bytes of a tape on their way from the frames of the link to the program. The bytes of an aborted
   tape are taken and dropped. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

void tape_init(void);

/* For the frames. */
bool tape_begin(void);              /* false while another tape runs */
uint32_t tape_room(void);           /* bytes that there is room for */
void tape_put(const uint8_t *bytes, uint32_t count);    /* no more than that */
void tape_end(void);                /* there are no more bytes */
bool tape_due(void);                /* there will be more: for a while after the program's end, too */

/* For the program. */
bool tape_waits(void);              /* a tape was begun, and has a byte or its end */
void tape_run(void);                /* it runs from now on */
bool tape_runs(void);
int tape_byte(void);                /* the next byte, -1 if there is none */
bool tape_is_over(void);            /* no byte is left, and none will come */
void tape_finish(void);             /* the program's end: what still comes is dropped */
void tape_drop(void);               /* forget it */
void tape_step(void);               /* what follows the program's end does not come for ever */
