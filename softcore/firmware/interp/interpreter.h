// SPDX-License-Identifier: Apache-2.0
/* Judges blocks: checks one completely and says what is to be done, without doing anything. So a block
   with an error moves nothing, and `tape check` uses the very same judgement. */
#pragma once
#include "interp/plan.h"

/* Judge a block. `mdi`: G36 fills the MDI layer. */
bool interpreter_block(const block *b, const modal *state, bool mdi, uint32_t highest_speed,
                       const travel_range *t, unsigned jump_axis, plan *p, fault *f);

/* A word of the block could not be read, which `f` tells. If a code before it is none of this control's,
   the word may well be right where that code is: the code is told instead. */
void interpreter_unread(const block *b, fault *f);

/* Judge the arc of a block that interpreter_block has passed, in a few calls as each takes its time:
   PLAN_DONE when there is nothing left to judge. */
plan_result interpreter_arc_step(plan *p, const travel_range *t, fault *f);
