// SPDX-License-Identifier: Apache-2.0
/* Touch-off: G38.2 and G38.3 go along a line until the electrode touches the work, G38.4 and
   G38.5 until it no longer does. */
#pragma once
#include "interp/words.h"

/* Take the end point of the line. False with a fault. */
bool touch_words_take(context *c, const travel_range *t);

/* Check feed and discharge, when all words of the block are known. False with a fault. */
bool touch_words_check(context *c);
