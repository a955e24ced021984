// SPDX-License-Identifier: Apache-2.0
/* Arcs: takes their words, and checks that the arc exists. */
#pragma once
#include "interp/words.h"

/* Take the words of an arc; arc_words_step checks them. */
bool arc_words_take(context *c);

/* Judge an arc, one part in each call: see interpreter_arc_step. */
plan_result arc_words_step(plan *p, const travel_range *t, fault *f);
