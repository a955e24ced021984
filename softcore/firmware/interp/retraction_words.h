// SPDX-License-Identifier: Apache-2.0
/* Retraction data and the periodic jump. */
#pragma once
#include "interp/words.h"

bool retraction_words_enter(context *c, bool mdi, uint32_t highest_speed, unsigned jump_axis); /* G36 */
bool retraction_words_defaults(context *c, uint32_t highest_speed);                            /* G37 */
bool retraction_words_jump(context *c, uint32_t highest_speed);                                /* G38 */
