// SPDX-License-Identifier: Apache-2.0
#include "app/control.h"

#include "app/events.h"
#include "app/homing.h"
#include "app/jog.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/override.h"
#include "app/program.h"
#include "app/resume.h"
#include "app/walk.h"
#include "base/alarm.h"
#include "base/pitch.h"
#include "base/settings.h"
#include "base/watch.h"
#include "gap/gap.h"
#include "link/lines.h"
#include "link/tape.h"
#include "path/path.h"

__attribute__((noinline)) void control_take_alarm(void) {
    watch_between();
    machine_stop();
    jog_stop();
    homing_stop();
    walk_drop();
    override_step();
    program_abort();
    lines_alarm();
    machine_take_alarm();
}

void control_begin_path(void) {
    walk_drop();
    events_drop();
    path_begin();
    meter_path_begins();
    program_resynchronise();
}

void control_reset(void) {
    bool homes = homing_active();
    bool open = (!path_at_front() || program_running() || homes) && !machine_locked();
    /* As in grbl, Hold:0 is rest: what was entered by hand may be dropped there without an alarm.
       Breaking off a tape always raises one. */
    bool rests = (machine_held() || program_paused()) && meter_rests() && !tape_runs() && !homes;
    if (open && !rests) {
        fault f = {.code = FAULT_RESET, .text = FAULT_TEXT_RESET};
        if (homes)
            f = (fault){.code = FAULT_HOME_RESET, .text = FAULT_TEXT_HOME_RESET};
        alarm_raise(&f);
        control_take_alarm();
    }
    alarm_outputs_off();
    machine_stop();
    jog_stop();
    program_abort();
    override_end();
    gap_end_trial();
    if (open && rests)
        control_begin_path();
}

void control_end_jog(void) {
    machine_run(false);
    control_begin_path();
    if (!tape_waits())
        (void)machine_hold(false, 0);
}

bool control_unlock(fault *f) {
    if (!machine_locked())
        return true;
    resume_leave(); /* before the axes take over where they stand */
    if (!machine_clear(f))
        return false;
    /* A path that begins here also ends the halted state. */
    control_begin_path();
    machine_free();
    return true;
}

bool control_take_position(fault *f) {
    if (machine_locked())
        return fault_at(f, FAULT_LOCKED, 0, "the machine is locked; unlock it with $X first");
    if (program_running() || !path_at_front() || jog_active())
        return fault_at(f, FAULT_BUSY, 0, "the machine moves, or a program runs");
    if (!settings_gears(f) || !pitch_sound(f))
        return false;
    machine_know_position(false);
    return true;
}
