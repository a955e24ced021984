// SPDX-License-Identifier: Apache-2.0
#include "app/override.h"

#include "app/homing.h"
#include "app/jog.h"
#include "app/touch.h"
#include "gap/gap.h"
#include "hal/hal.h"
#include "path/path.h"

void override_step(void) {
    hal_overrides wanted = hal_overrides_read();
    if (gap_serves() || jog_active() || homing_active() || touch_now() != TOUCH_NONE)
        path_override(100, 100);
    else
        path_override(wanted.feed, wanted.rapid);
}

void override_end(void) {
    hal_release_override();
    override_step();
}
