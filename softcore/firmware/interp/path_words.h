// SPDX-License-Identifier: Apache-2.0
/* Words about the path of a block: lines, arcs, their frame, and the side of the wire. */
#pragma once
#include "interp/words.h"

bool path_words_set_position(context *c);       /* G92 */
bool path_words_enter_wire(context *c);         /* G10 D R: a wire offset */
bool path_words_enter_system(context *c);       /* G10 L2 or L20, P X Y Z: a work offset */
bool path_words_plane(context *c);              /* G17, G18, G19 */
bool path_words_wire(context *c, bool mdi);     /* G40, G41, G42 */

void path_words_forget_position(context *c);    /* G92.1: cancel G92 */

/* The end point of an axis by its word; without a word the axis stays. `frame` is the zero of the
   coordinates in the machine frame. False with a fault. */
bool path_words_target(context *c, const travel_range *t, unsigned axis, int32_t frame,
                       int32_t *target);

/* The motion of the block. For an arc this only takes the words: see arc_words_step. */
bool path_words_move(context *c, uint32_t highest_speed, const travel_range *t);
