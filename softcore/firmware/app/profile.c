// SPDX-License-Identifier: Apache-2.0
#include "app/profile.h"

static uint32_t worst[PROFILE_TASKS];

void profile_init(void) {
    for (unsigned i = 0; i < PROFILE_TASKS; i++)
        worst[i] = 0;
}

void profile_note(unsigned task, uint32_t clocks) {
    worst[task] = clocks > worst[task] ? clocks : worst[task];
}

uint32_t profile_worst(unsigned task) { return worst[task]; }
