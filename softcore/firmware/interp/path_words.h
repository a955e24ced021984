// SPDX-License-Identifier: Apache-2.0
/* Where a block leads: lines, arcs, the frame that they are in, and the side of the wire. */
#pragma once
#include "interp/words.h"

bool path_words_set_position(context *c);       /* G92 */
bool path_words_enter_wire(context *c);         /* G10 D R: a wire offset */
bool path_words_enter_system(context *c);       /* G10 L2 or L20, P X Y Z: a work offset */
bool path_words_plane(context *c);              /* G17, G18, G19 */
bool path_words_wire(context *c, bool mdi);     /* G40, G41, G42 */

void path_words_forget_position(context *c);    /* G92.1: as if there had been no G92 */

/* Where an axis is led to by its word, or stays without one; `frame` is the place of the zero that the
   coordinates count from. False with a fault. */
bool path_words_target(context *c, const travel_range *t, unsigned axis, int32_t frame,
                       int32_t *target);

/* The motion of the block. Of an arc only the words are taken: see arc_words_step. */
bool path_words_move(context *c, uint32_t highest_speed, const travel_range *t);
