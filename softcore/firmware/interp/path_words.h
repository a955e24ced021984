// SPDX-License-Identifier: Apache-2.0
/* Where a block leads: lines, arcs, the frame that they are in, and the side of the wire. */
#pragma once
#include "interp/words.h"

bool path_words_set_position(context *c);       /* G92 */
bool path_words_enter_wire(context *c);         /* G10 D R: a wire offset */
bool path_words_enter_system(context *c);       /* G10 P X Y Z: a work offset, in the machine frame */
bool path_words_plane(context *c);              /* G17, G18, G19 */
bool path_words_wire(context *c, bool mdi);     /* G40, G41, G42 */

/* The motion of the block. Of an arc only the words are taken: see arc_words_step. */
bool path_words_move(context *c, uint32_t highest_speed, const travel_range *t);
