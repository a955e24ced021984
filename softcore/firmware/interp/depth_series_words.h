// SPDX-License-Identifier: Apache-2.0
/* G39: a step of the series of conditions by depth, the planned ones, or the end of the series. */
#pragma once
#include "interp/words.h"

bool depth_series_words_take(context *c, unsigned jump_axis);
