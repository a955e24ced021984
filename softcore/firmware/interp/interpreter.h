// SPDX-License-Identifier: Apache-2.0
/* Judges blocks: checks a block completely and says what is to be done, without doing it. A block
   with an error therefore moves nothing, and `tape check` makes the same checks. */
#pragma once
#include "interp/plan.h"

/* Judge a block. `mdi`: it was entered by hand, so G36 fills the MDI layer. False with a fault. */
bool interpreter_block(const block *b, const modal *state, bool mdi, uint32_t highest_speed,
                       const travel_range *t, unsigned jump_axis, plan *p, fault *f);

/* Call when a word of the block could not be read, with its fault in `f`. If the block has an
   unknown or refused code before the word, that code replaces the fault: the word may be right with
   that code in another dialect. */
void interpreter_unread(const block *b, fault *f);

/* Judge the arc of a block that interpreter_block has accepted. This takes several calls, as each
   is slow: PLAN_DONE when nothing is left to judge. */
plan_result interpreter_arc_step(plan *p, const travel_range *t, fault *f);
