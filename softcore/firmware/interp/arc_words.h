// SPDX-License-Identifier: Apache-2.0
/* Arcs: takes their words, and checks that the arc exists. */
#pragma once
#include "interp/words.h"

/* Take the words of an arc; arc_words_step checks them. */
bool arc_words_take(context *c);

/* Is an arc round enough for the path: do its radii at start and end differ by no more than a sixteenth
   of its chord, or of its diameter? */
bool arc_words_round(const path_move *move);

/* Judge an arc, one part in each call: see interpreter_arc_step. */
plan_result arc_words_step(plan *p, const travel_range *t, fault *f);
