// SPDX-License-Identifier: Apache-2.0
/* Words of the gap: the law of the feed, conditions and classes of the fluid that are entered. */
#pragma once
#include "interp/words.h"

/* The law of the word P, if it is there, of a G95 that stands at a column. */
bool gap_words_feed_mode(const word *w, uint32_t column, uint8_t *mode, fault *f);

/* G10 C: a condition. What is left out stays as the row of that number has it. */
bool gap_words_condition(context *c, bool mdi);

/* G10 W: a class of the fluid. */
bool gap_words_class(context *c);
