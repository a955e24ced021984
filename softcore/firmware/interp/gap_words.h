// SPDX-License-Identifier: Apache-2.0
/* Words about the gap: the feed mode, and entering conditions and classes of the fluid. */
#pragma once
#include "interp/words.h"

/* The feed mode that the word P of a G95 selects. `w` is 0 if P is missing; `column` is that of
   G95. */
bool gap_words_feed_mode(const word *w, uint32_t column, uint8_t *mode, fault *f);

/* G10 C: enter a condition. Words that are missing keep the value of the row with that number. */
bool gap_words_condition(context *c, bool mdi);

/* G10 W: enter a class of the fluid. */
bool gap_words_class(context *c);
