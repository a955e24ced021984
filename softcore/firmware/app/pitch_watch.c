// SPDX-License-Identifier: Apache-2.0
#include "app/pitch_watch.h"

#include "app/machine.h"
#include "base/pitch.h"
#include "base/watch.h"
#include "hal/hal.h"

#include "base/rare.h"

__attribute__((noinline)) void pitch_watch_step(void) {
    watch_between(); /* a pass of the three axes takes some 1000 clocks */
    if (!machine_locked() && !machine_position_lost() && !hal_limits_read().leaving)
        pitch_follow();
}
