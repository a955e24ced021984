// SPDX-License-Identifier: Apache-2.0
/* The stored places of G28 (number 0) and G30 (number 1). */
#pragma once
#include "interp/words.h"

/* G28.1, G30.1: store the present place. */
void place_words_store(context *c, unsigned number);

/* G28, G30: go to that place in rapid motion. With axis words: go to the point that they name
   first, and from there to the place, but only in those axes. False with a fault. */
bool place_words_go(context *c, unsigned number, uint32_t highest_speed, const travel_range *t);
