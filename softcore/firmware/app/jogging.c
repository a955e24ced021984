// SPDX-License-Identifier: Apache-2.0
#include "app/jogging.h"

#include "app/control.h"
#include "app/events.h"
#include "app/jog.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/override.h"
#include "app/program.h"
#include "app/status.h"
#include "hal/hal.h"
#include "link/lines.h"
#include "path/path.h"

static bool flushes;        /* since the last cancellation lines have always waited */

void jogging_init(void) {
    flushes = false;
    jog_stop();
}

bool jogging_allowed(fault *f) {
    if (machine_locked())
        return fault_at(f, FAULT_BUSY, 0, "the machine is locked; unlock it with $X first");
    if (flushes || jog_now() == JOG_ENDING) {
        *f = (fault){.code = FAULT_JOG_ENDED, .text = FAULT_TEXT_JOG_ENDED};
        return false;
    }
    return jog_active() || status_idle() ||
           fault_at(f, FAULT_BUSY, 0,
                    "a jog needs the state Idle or Jog; with the discharge on (M03) there is none");
}

static bool lines_are_due(void) { return hal_waiting() || lines_wait(); }

void jogging_cancel(void) {
    flushes = flushes || lines_are_due();
    if (!jog_active() && !program_jogs())
        return;
    program_cancel_jog();
    (void)machine_hold(true, 0);
    jog_end();
}

void jogging_step(void) {
    flushes = flushes && lines_are_due();
    if (!jog_active())
        return;
    if (jog_now() == JOG_UNDER_WAY && jog_silent())
        jogging_cancel();
    bool done = jog_now() == JOG_ENDING || (!program_running() && path_at_front());
    if (!done || !meter_rests() || !events_idle())
        return;
    if (jog_now() == JOG_ENDING)
        control_end_jog();
    jog_stop();
    override_step();
}
