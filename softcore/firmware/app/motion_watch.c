// SPDX-License-Identifier: Apache-2.0
#include "app/motion_watch.h"

#include "app/machine.h"
#include "base/alarm.h"
#include "base/fault.h"
#include "base/units.h"
#include "gap/gap.h"
#include "hal/hal.h"
#include "path/history.h"
#include "path/path.h"

#define PASSES 4            /* rounds of the main loop from one look to the next */
/* Motion is stuck if no pulse comes in STUCK_US plus the time of STUCK_PULSES. STUCK_US is longer
   than any legal delay of the front. */
#define STUCK_US 200000
#define STUCK_PULSES 4

static unsigned passes;
static bool doubted;        /* at the last look an axis was not at the end of the path */
static bool waits;          /* motion is wanted, but none has come since clock `since` */
static uint32_t since;
static int32_t position;

void motion_watch_init(void) {
    passes = 0;
    doubted = waits = false;
}

/* The last pulses reach the axes a few clocks late, so only a deviation at two looks is an
   error. */
__attribute__((noinline)) static void look_at_axes(void) {
    unsigned axis = 0;
    while (axis < HAL_AXES && hal_axis_command(axis) == history_end(axis))
        axis++;
    if (axis == HAL_AXES || !doubted) {
        doubted = axis < HAL_AXES;
        return;
    }
    doubted = false;
    fault f = {.line = alarm_line()};
    fault_at(&f, FAULT_GUARD, 0, "the command of axis %c is %p mm from where the path ends",
             "XYZ"[axis], hal_axis_command(axis) - history_end(axis));
    alarm_raise(&f);
}

/* Clocks within which a pulse must come at this rate. */
static uint32_t patience(uint32_t rate) {
    uint64_t clocks = (uint64_t)STUCK_PULSES * (UINT32_MAX / rate) + units_clocks_of_us(STUCK_US);
    return clocks > INT32_MAX ? INT32_MAX : (uint32_t)clocks;
}

/* Should the machine move forward now? */
static bool wants(void) {
    hal_motion motion = hal_motion_read();
    return motion.state == MOTION_FRONT && !motion.backpressure && machine_goes() && !gap_serves();
}

static void look_at_pace(void) {
    uint32_t rate = wants() ? path_pace() : 0, now = hal_cycle_low();
    int32_t place = hal_position();
    if (!rate || !waits || place != position) {
        waits = rate;
        since = now;
        position = place;
        return;
    }
    if (now - since <= patience(rate))
        return;
    waits = false;
    fault f = {.line = alarm_line()};
    fault_at(&f, FAULT_STUCK, 0, FAULT_TEXT_STUCK);
    alarm_raise(&f);
}

void motion_watch_step(void) {
    if (++passes % PASSES)
        return;
    if (machine_locked()) {
        doubted = waits = false;
        return;
    }
    if (path_at_front())
        look_at_axes();
    else
        doubted = false;
    look_at_pace();
}
