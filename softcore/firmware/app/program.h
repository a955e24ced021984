// SPDX-License-Identifier: Apache-2.0
/* Carries out programs. It reads ahead and appends motion to the path without waiting; functions
   wait until the machine is at the front. Blocks come from the tape or from a line entered by hand.
   Each block is judged as a whole before any part of it is carried out, so an alarm stops the
   program at the faulty block. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "interp/block.h"

void program_init(void);
bool program_step(void);            /* true if there was something to do */
void program_abort(void);           /* forget the program; the caller stops the motion */
void program_resynchronise(void);   /* take the position from the machine */
void program_resume(void);          /* go on after M00 */

bool program_running(void);         /* a tape or a line is being carried out */
bool program_paused(void);

/* A line entered by hand; false if one is still being carried out. */
bool program_line(const char *text, uint32_t length);

/* The same for a jog, `$J=` and its words; see interp/jog_words.h. */
bool program_jog(const char *text, uint32_t length);
bool program_jogs(void);            /* such a line is judged, or waits for room on the path */
void program_cancel_jog(void);      /* refuse a jog that has not been appended to the path */

/* The answer to such a line, after it was carried out or refused. Each answer can be taken once. */
bool program_answers(void);
const fault *program_answer(void);

/* Offset of the program frame: machine = program + offset. */
const int32_t *program_offset(void);

/* Time spent on reading and judging blocks. */
typedef struct {
    uint32_t blocks;        /* number of blocks */
    uint32_t total, worst;  /* clocks of all blocks, and of the slowest */
} program_cost;
program_cost program_profile(void);
