// SPDX-License-Identifier: Apache-2.0
#include "app/machine.h"

#include "app/image_watch.h"
#include "base/alarm.h"
#include "base/cause.h"
#include "base/pitch.h"
#include "base/settings.h"
#include "base/watch.h"
#include "hal/hal.h"
#include "hal/regs.h"
#include "link/output.h"
#include "path/path.h"

/* Reads of the interlock after an order to clear it. It takes a few clocks; if it is still safe
   after these reads, it has refused. */
#define CLEAR_TRIES 16

/* A pattern of many bits: one flipped bit must not make a lost position a known one. */
#define KNOWN 0x706f7331u
#define HOMED 0x686f6d65u   /* known by homing all axes */

static bool locked, held, waits, running, machining;
static bool quenched;           /* the discharge is off for the rest of a hold */
static bool walks;              /* a walk has lifted the hold */
static uint32_t place;          /* KNOWN or HOMED; any other value, as after reset: position lost */
static uint32_t frame;          /* number of the machine frame, from 1: a loss of the position ends it */

void machine_init(void) {
    locked = true;
    held = waits = running = machining = quenched = walks = false;
    machine_lose_position();
    hal_control(false, false);
    hal_discharge(false);
}

bool machine_locked(void) { return locked; }
bool machine_held(void) { return held; }
bool machine_machining(void) { return machining; }
bool machine_dry(void) { return settings_get(SET_DRY_RUN_MM_MIN); }
bool machine_burns(void) { return machining && !quenched; }
bool machine_goes(void) { return running && !held && !waits; }

bool machine_position_lost(void) { return place != KNOWN && place != HOMED; }
bool machine_homed(void) { return place == HOMED; }
uint32_t machine_frame(void) { return frame; }

void machine_know_position(bool homed) {
    if (machine_position_lost())
        pitch_refer();
    place = homed || machine_homed() ? HOMED : KNOWN;
}

void machine_lose_position(void) {
    place = 0;
    frame++;
}


bool machine_allows(bool moves, bool burns, fault *f) {
    burns = burns && !machine_dry();
    if ((moves || burns) && machine_position_lost())
        return fault_at(f, FAULT_POSITION_LOST, 0, FAULT_TEXT_POSITION_LOST);
    if (burns && hal_limits_read().leaving)
        return fault_at(f, FAULT_LOCKED, 0, "M03 has to wait until the limit switch is left");
    if (burns && !hal_armed())
        return fault_at(f, FAULT_NOT_ARMED, 0, FAULT_TEXT_NOT_ARMED);
    return true;
}

static void control(void) { hal_control(running, (held || waits) && !walks); }

void machine_run(bool run) {
    if (running == run)
        return;
    running = run;
    control();
}

bool machine_hold(bool hold, fault *f) {
    if (!hold && quenched) {
        if (machining && !machine_allows(true, true, f))
            return false;
        quenched = false;
        hal_discharge(machining);
    }
    held = hold;
    walks = false;
    control();
    if (!hold)
        hal_release_hold();
    return true;
}

void machine_walk(void) {
    walks = true;
    control();
    hal_release_hold();
}

void machine_quench(void) {
    if (!held || !machining)
        return;
    quenched = true;
    hal_discharge(false);
}

void machine_wait(bool wait) {
    if (waits == wait)
        return;
    waits = wait;
    control();
}

void machine_discharge(bool on) {
    if (machining && !on)
        path_note_work(false);
    machining = on && !machine_dry();
    hal_discharge(machine_burns());
}

void machine_retract(void) {
    if (!locked && running)
        hal_retract();
}

void machine_stop(void) {
    if (machining)
        path_note_work(false);
    held = waits = running = machining = quenched = walks = false;
}

void machine_take_alarm(void) {
    const alarm *raised = alarm_first();
    bool tell = !locked || alarm_untold();
    if (raised->guard)
        machine_lose_position();
    if (!tell)
        output_message(&raised->what);
    locked = true;
    alarm_take(tell);
}

__attribute__((noinline)) void machine_tell_alarm(void) {
    char sentence[OUTPUT_LINE / 2];
    const alarm *last = alarm_first();
    fault_sentence(&last->what, sentence, sizeof sentence);
    watch_between(); /* sentence and event are long texts */
    if (last->what.line)
        alarm_set_line(last->what.line);
    output_event(EVENT_WORD_ALARM, last->cycle, alarm_line(), last->position, EVENT_FORMAT_ALARM,
                 fault_alarm(last->what.code), sentence);
    output_line("ALARM:%u", fault_alarm(last->what.code));
    alarm_told();
}

/* An axis on its limit switch may move slowly, and only away from it. */
static void tell_leaving(hal_limits limits) {
    char axes[OUTPUT_LINE / 2];
    cause_axes(axes, sizeof axes, limits.low | limits.high);
    output_line("[MSG:On the %slimit switch of %s: only away from it, slowly, without discharge.]",
                !limits.low ? "upper " : !limits.high ? "lower " : "", axes);
}

bool machine_clear(fault *f) {
    if (!image_watch_sound(f))
        return false;
    if (hal_motion_read().moving && !hal_safe())
        return fault_at(f, FAULT_LOCKED, 0, "the machine is still coming to rest");
    if (!hal_safe())
        return true;
    /* Set the command to the position while the outputs are still safe. The drives would otherwise
       be enabled with the old following error. */
    if (cause_miscounts(hal_causes())) {
        machine_lose_position();
        settings_renew_drives();
    }
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        hal_axis_adopt(axis);
    path_forget(); /* removes a cause that lies in the path */
    settings_renew(); /* with these, damage of a guarded register is gone */
    hal_limits limits = hal_limits_read();
    if (limits.low | limits.high)
        hal_leave();
    hal_interlock_clear();
    for (unsigned i = 0; i < CLEAR_TRIES && hal_safe(); i++) {
    }
    if (hal_safe())
        return cause_fault(f, "the interlock stays open: ", hal_first_cause(), hal_blamed());
    return true;
}

void machine_free(void) { locked = false; }

void machine_tell_unlocked(unsigned row) {
    hal_limits limits = hal_limits_read();
    if (row == 0 && limits.leaving)
        tell_leaving(limits);
    else if (row == 1 && machine_position_lost())
        output_line("[MSG:the position is lost: $H finds it, or $POSITION=HERE accepts the counted one.]");
}

__attribute__((noinline)) void machine_halted(unsigned detail, uint64_t cycle, const int32_t *position) {
    static const fault_code codes[] = {FAULT_HALT_LIMIT, FAULT_HALT_LIMIT, FAULT_HALT_BACK_LIMIT,
                                       FAULT_HALT_BURST, FAULT_HALT_NO_DATA,
                                       FAULT_HALT_SERVO, FAULT_CONTACT};
    static const char *const texts[] = {
        "retraction stopped",
        FAULT_TEXT_HALT_LIMIT,
        FAULT_TEXT_HALT_BACK_LIMIT,
        FAULT_TEXT_HALT_BURST,
        FAULT_TEXT_HALT_NO_DATA,
        FAULT_TEXT_HALT_SERVO,
        FAULT_TEXT_CONTACT,
    };
    unsigned row = detail < sizeof codes / sizeof *codes ? detail : 0;
    if (codes[row] == FAULT_CONTACT)
        path_note_work(true);
    fault f = {.line = alarm_line()};
    fault_at(&f, codes[row], 0, "%s", texts[row]);
    alarm_raise_at(&f, cycle, position);
}

__attribute__((noinline)) void machine_tripped(unsigned cause, unsigned axes, uint64_t cycle, const int32_t *position) {
    if (locked && cause == CAUSE_POWER_ON)
        return;
    if (cause == CAUSE_CONTACT)
        path_note_work(true);
    fault f = {.line = alarm_line()};
    if (cause_loses_position(cause) || settings_get(SET_STEP_AXES))
        machine_lose_position();
    cause_fault(&f, "interlock: ", cause, axes);
    cause_position(&f, machine_position_lost());
    alarm_raise_at(&f, cycle, position);
}

__attribute__((noinline)) void machine_events_lost(void) {
    fault f = {0};
    fault_at(&f, FAULT_EVENTS, 0, FAULT_TEXT_EVENTS);
    alarm_raise(&f);
}
