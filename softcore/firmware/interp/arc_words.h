// SPDX-License-Identifier: Apache-2.0
/* Arcs: their words, and whether there is such an arc. */
#pragma once
#include "interp/words.h"

/* Words of an arc: what they say is judged by arc_words_step. */
bool arc_words_take(context *c);

/* Judge an arc, a part in each call: see interpreter_arc_step. */
plan_result arc_words_step(plan *p, const travel_range *t, fault *f);
