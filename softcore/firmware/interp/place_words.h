// SPDX-License-Identifier: Apache-2.0
/* Places of the machine that a program goes to by name: G28 and G30, number 0 and 1. */
#pragma once
#include "interp/words.h"

/* G28.1, G30.1: the present place becomes the one to go to. */
void place_words_store(context *c, unsigned number);

/* G28, G30: rapidly to that place. With axis words first to the point that they name, and from there
   to the place in those axes alone. False with a fault. */
bool place_words_go(context *c, unsigned number, uint32_t highest_speed, const travel_range *t);
