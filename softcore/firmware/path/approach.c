// SPDX-License-Identifier: Apache-2.0
#include "path/approach.h"

#define LEAST 8     /* at least 1/8 of a line's length must lead away */

static bool known;
static int8_t into[HAL_AXES];

void approach_init(void) { known = false; }

void approach_note(const int8_t way[HAL_AXES]) {
    known = true;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        into[axis] = way[axis];
}

bool approach_leads_away(const path_move *line) {
    int64_t back = 0, length = 0; /* length: sum over the axes, not less than the true one */
    unsigned jump = hal_jump_axis();
    bool straight = jump < HAL_AXES && line->delta[jump] > 0;
    for (unsigned axis = 0; axis < HAL_AXES; axis++) {
        int32_t travel = line->delta[axis];
        back -= (int64_t)travel * into[axis];
        length += travel < 0 ? -(int64_t)travel : travel;
        straight = straight && (axis == jump || !travel);
    }
    return straight || (known && back * LEAST >= length * APPROACH_ONE);
}
