// SPDX-License-Identifier: Apache-2.0
/* Carries programs out: reads ahead, appends motion to the path without waiting, and lets everything
   that acts wait until the machine is at the front. Blocks come from the tape or from a line entered
   by hand. An alarm stops at the block that is damaged: it is judged as a whole before any of it is
   done. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "interp/block.h"

#define PROGRAM_TAPE 512 /* bytes of tape waiting to be read; a power of two */

void program_init(void);
bool program_step(void);            /* true if there was something to do */
void program_abort(void);           /* forget the program; motion is the caller's business */
void program_resynchronise(void);   /* take the position from the machine */
void program_resume(void);          /* go on after M00 */

bool program_running(void);         /* a tape or a line is being carried out */
bool program_paused(void);
bool program_on_tape(void);

/* Tape. The bytes of an aborted tape are taken and dropped. */
bool program_tape_begin(void);      /* false while another tape runs */
uint32_t program_tape_room(void);
void program_tape_bytes(const uint8_t *bytes, uint32_t count);  /* no more than there is room for */
void program_tape_end(void);        /* there are no more bytes */
bool program_tape_due(void);        /* there will be more: for a while after the program's end, too */

/* A line entered by hand; false if one is still being carried out. The answer comes by link_answer. */
bool program_line(const char *text, uint32_t length);

/* Offset of the program frame: machine = program + offset. */
const int32_t *program_offset(void);

/* Time spent on reading and judging blocks: blocks, clocks in all, clocks of the worst. */
typedef struct {
    uint32_t blocks, total, worst;
} program_cost;
program_cost program_profile(void);
