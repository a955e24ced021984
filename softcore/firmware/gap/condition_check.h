// SPDX-License-Identifier: Apache-2.0
/* Does a row of a condition that comes from elsewhere than a block keep the rules of G10 C? */
#pragma once
#include <stdbool.h>

#include "gap/conditions.h"

bool condition_check_row(const condition_row *row);
