// SPDX-License-Identifier: Apache-2.0
/* G39: a step of the depth series, the planned depth series (P1), or the end of the series. */
#pragma once
#include "interp/words.h"

bool depth_series_words_take(context *c, unsigned jump_axis);
