// SPDX-License-Identifier: Apache-2.0
/* Going on with a tape where it was interrupted, also after power-off (`$FROM=last`). What the
   bookmark of `store/bookmark.h` needs is taken from the tape here, and compared when the same tape
   is read again. A dry run neither moves the bookmark nor ends it. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "interp/plan.h"

void resume_open(void (*between)(void));    /* at power-on, when the journal is open */
void resume_tell(void);         /* tell the block in which a tape was interrupted, if one was */

/* `$FROM=last`: the block at which the next tape is to begin; 0 with a fault if it cannot. */
uint32_t resume_ask(const modal *state, fault *f);
bool resume_asked(void);
void resume_drop(void);         /* the tape begins as it is written */
void resume_forget(void);       /* no tape is interrupted any more */

/* A tape starts in this state, and goes on in it. If it is to go on where it was interrupted, its axes
   are reckoned from where they stood at its first start. */
void resume_begin(modal *state, bool dry);
void resume_text(const char *text, uint32_t length);    /* of its next block */

/* Digest of the tape up to its present block, whose number is `line`, and of the state before it. */
uint32_t resume_digest(uint32_t line);
void resume_end(void);          /* the tape has ended */

/* The machine has come to block `line`, whose first motion has this number on the path. */
void resume_at(uint32_t line, uint32_t digest, uint32_t number);

/* The path ends after an alarm. Note where in its block the machine was left; call it again if it was
   still coming to rest. */
void resume_leave(void);

/* Is this the block, and the state before it, in which the tape was interrupted? False with a fault
   if not. */
bool resume_matches(uint32_t line, fault *f);

/* The motion that is left of the block, which begins at `from`, and where it begins, `at`. False if the
   block is to begin anew: the machine has lost its position since, was left outside of the block's
   main motion, or at its beginning. */
bool resume_rest(const plan *p, const int32_t from[HAL_AXES], int32_t at[HAL_AXES], path_move *rest);

bool resume_step(void);         /* as bookmark_step; tells it when the memory fails */
