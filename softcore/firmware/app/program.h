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

void program_init(void);
bool program_step(void);            /* true if there was something to do */
void program_abort(void);           /* forget the program; motion is the caller's business */
void program_resynchronise(void);   /* take the position from the machine */
void program_resume(void);          /* go on after M00 */

bool program_running(void);         /* a tape or a line is being carried out */
bool program_paused(void);

/* A line entered by hand; false if one is still being carried out. */
bool program_line(const char *text, uint32_t length);

/* The answer to such a line, when it has been carried out or refused: given once. */
bool program_answers(void);
const fault *program_answer(void);

/* Offset of the program frame: machine = program + offset. */
const int32_t *program_offset(void);

/* Time spent on reading and judging blocks: blocks, clocks in all, clocks of the worst. */
typedef struct {
    uint32_t blocks, total, worst;
} program_cost;
program_cost program_profile(void);
