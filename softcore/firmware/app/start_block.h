// SPDX-License-Identifier: Apache-2.0
/* Running a tape from one of its blocks. The blocks before it are judged, and bring their modes,
   conditions, retraction data and places into force, but nothing moves, and no function goes to the
   machine side. The machine then waits for the operator, goes to where the block begins with the
   discharge off, and brings fluid and discharge into force as the blocks left out would have. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "interp/plan.h"

/* `$FROM=n`: the next tape begins at its block n, counted from 1; with 0 or 1 it is carried out
   whole. `$FROM=last`: at the block in which it was interrupted; `$FROM=0` also forgets this block.
   In force for one tape, and until an alarm or a reset. */
void start_block_line(const char *line, uint32_t length, fault *f);
void start_block_last(const modal *state, fault *f);
void start_block_drop(void);
void start_block_done(void);            /* the machine is there, and the block begins */

/* A tape starts: what follows is reckoned from where the machine stands, or stood when it started
   first. */
void start_block_begin(modal *state);

/* Take the next block of the tape: is it left out? */
bool start_block_skips(uint32_t line, const char *text, uint32_t length);
bool start_block_due(void);             /* blocks were left out, and the machine is not yet there */

/* Take what a block left out would have done. */
void start_block_move(const plan *p);
void start_block_function(int32_t m);   /* an M code for the machine side */

bool start_block_fluid(void);           /* M08 is in force */

/* Append the next move to where the block begins, or was left, at the start/stop speed: first up and
   then across, or first across and then down. Only at the front; false if the machine is there. */
bool start_block_goes(void);

/* Tell the place of block `line`, or where it was left, and what the operator is asked to do. False
   with a fault if the tape is to go on, and is not the one that was interrupted. */
bool start_block_tell(uint32_t line, const plan *p, fault *f);

/* Was the block left within its motion? Then only its rest is carried out, without a corner before
   it. start_block_rest: what comes in place of this motion, once; 0 if nothing is left. */
bool start_block_rests(void);
const path_move *start_block_rest(const path_move *move);
