// SPDX-License-Identifier: Apache-2.0
/* The words of a jog: the text of a line after `$J=`.

   A jog is one line in X, Y and Z at a constant feed. It needs F and at least one axis. G20, G21,
   G90 and G91 hold for this line alone; without them those in force hold. With G53 the coordinates
   are those of the machine. No modal state changes but the position.

   Ref: grbl 1.1, jogging (`doc/markdown/jogging.md`). */
#pragma once
#include "interp/block.h"
#include "interp/plan.h"

/* Judge a jog. `highest_speed` is in um/min. False with a fault: FAULT_JOG for a word that no jog
   has, FAULT_JOG_TRAVEL for a target beyond the travel. */
bool jog_words_judge(const block *b, const modal *state, uint32_t highest_speed,
                     const travel_range *t, plan *p, fault *f);
