// SPDX-License-Identifier: Apache-2.0
/* The operator's walk on the model machine, which keeps the order and does not walk. */
#include "hal/hal.h"
#include "pc/host.h"

static uint32_t distance;
static int32_t drawn;       /* the servo has drawn back from the front by so much */

void host_walk_boot(void) {
    distance = UINT32_MAX;  /* not written yet */
    drawn = 0;
}

void hal_walk(uint32_t pulses) { distance = pulses; }
int32_t hal_start(void) { return hal_front() - drawn; }
uint32_t gk_walk(void) { return distance; }
void gk_drawn(int32_t pulses) { drawn = pulses; }
