// SPDX-License-Identifier: Apache-2.0
#include "app/machine.h"

#include "app/events.h"
#include "app/program.h"
#include "base/cause.h"
#include "base/settings.h"
#include "hal/hal.h"
#include "hal/regs.h"
#include "link/link.h"
#include "link/output.h"
#include "path/path.h"

/* Reads of the interlock after its clear before it counts as refused; it takes a few clocks. */
#define CLEAR_TRIES 16

/* Not one bit: a flipped one must not find the position. */
#define KNOWN 0x706f7331u

static bool locked, held, waits, running, machining;
static uint32_t place;          /* KNOWN, or else the position is lost: out of reset, too */

/* An alarm that has stopped the machine and is still to be told: saying it at once, on top of what
   raised it, would take too long for one pass of the main loop. */
static struct {
    bool waits;
    fault what;
    uint64_t cycle;
    int32_t position[HAL_AXES];
} alarm;

void machine_init(void) {
    locked = true;
    held = waits = running = machining = alarm.waits = false;
    place = 0;
    hal_control(false, false);
    hal_discharge(false);
}

bool machine_locked(void) { return locked; }
bool machine_held(void) { return held; }
bool machine_machining(void) { return machining; }
bool machine_goes(void) { return running && !held && !waits; }

bool machine_position_lost(void) { return place != KNOWN; }

bool machine_take_position(fault *f) {
    if (locked)
        return fault_at(f, FAULT_LOCKED, 0, "the machine is locked; unlock it with $X first");
    if (program_running() || !path_at_front())
        return fault_at(f, FAULT_BUSY, 0, "the machine moves, or a program runs");
    place = KNOWN;
    return true;
}

bool machine_allows(bool moves, bool burns, fault *f) {
    if ((moves || burns) && machine_position_lost())
        return fault_at(f, FAULT_POSITION_LOST, 0,
                        "the position is lost; $POSITION=HERE takes what is counted for true");
    if (burns && hal_limits_read().leaving)
        return fault_at(f, FAULT_LOCKED, 0, "M03 has to wait until the limit switch is left");
    if (burns && !hal_armed())
        return fault_at(f, FAULT_NOT_ARMED, 0,
                        "the discharge is not armed: press the button ARM at the machine");
    return true;
}

void machine_run(bool run) {
    if (running == run)
        return;
    running = run;
    hal_control(running, held || waits);
}

void machine_hold(bool hold) {
    held = hold;
    hal_control(running, held || waits);
    if (!hold)
        hal_release_hold();
}

void machine_wait(bool wait) {
    if (waits == wait)
        return;
    waits = wait;
    hal_control(running, held || waits);
}

void machine_discharge(bool on) {
    if (machining && !on)
        path_note_work(false);
    machining = on;
    hal_discharge(on);
}

void machine_retract(void) {
    if (!locked && running)
        hal_retract();
}

static void stop(void) {
    held = waits = false;
    running = true; /* so that the register is written whatever it was */
    machine_run(false);
    hal_release_hold();
    machine_discharge(false);
    hal_disarm();
    program_abort();
}

/* `position` is that of the encoders in clock `cycle`, which is past. */
static void alarm_at(const fault *f, uint64_t cycle, const int32_t *position) {
    stop();
    if (f->code == FAULT_GUARD)
        place = 0;
    if (alarm.waits)
        return; /* the first one is what happened */
    if (locked) {
        char sentence[OUTPUT_LINE / 2];
        fault_sentence(f, sentence, sizeof sentence);
        output_line("[MSG:%s]", sentence);
        return;
    }
    locked = alarm.waits = true;
    alarm.what = *f;
    alarm.cycle = cycle;
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        alarm.position[axis] = position[axis];
}

void machine_alarm(const fault *f) {
    int32_t position[HAL_AXES];
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        position[axis] = hal_axis_position(axis);
    alarm_at(f, hal_cycle(), position);
}

bool machine_alarm_waits(void) { return alarm.waits; }

void machine_tell_alarm(void) {
    char sentence[OUTPUT_LINE / 2];
    fault_sentence(&alarm.what, sentence, sizeof sentence);
    if (alarm.what.line)
        events_set_line(alarm.what.line);
    output_event("alarm", alarm.cycle, events_line(), alarm.position, ",%u,%s",
                 (uint32_t)alarm.what.code, sentence);
    output_line("ALARM:%u", (uint32_t)alarm.what.code);
    alarm.waits = false;
}

/* The limit switches that are pressed can be left: slowly, and only away from them. */
static void tell_leaving(hal_limits limits) {
    char axes[OUTPUT_LINE / 2];
    cause_axes(axes, sizeof axes, limits.low | limits.high);
    output_line("[MSG:On the %slimit switch of %s: only away from it, slowly, without discharge.]",
                !limits.low ? "upper " : !limits.high ? "lower " : "", axes);
}

bool machine_unlock(fault *f) {
    if (!locked)
        return true;
    if (hal_motion_read().moving && !hal_safe())
        return fault_at(f, FAULT_LOCKED, 0, "the machine is still coming to rest");
    /* The command is set to the position while the outputs are still safe: cleared first, the drives
       would be enabled with the old error. */
    if (hal_safe()) {
        if (cause_miscounts(hal_causes()))
            place = 0;
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            hal_axis_adopt(axis);
        path_forget(); /* or a cause that lies in it would stay */
        hal_limits limits = hal_limits_read();
        if (limits.low | limits.high)
            hal_leave();
        hal_interlock_clear();
        for (unsigned i = 0; i < CLEAR_TRIES && hal_safe(); i++) {
        }
        if (hal_safe())
            return cause_fault(f, "the interlock stays open: ", hal_first_cause(), hal_blamed());
    }
    /* A path that begins here also ends the halted state. */
    events_drop();
    path_begin();
    program_resynchronise();
    locked = false;
    return true;
}

void machine_tell_unlocked(unsigned row) {
    hal_limits limits = hal_limits_read();
    if (row == 0 && limits.leaving)
        tell_leaving(limits);
    else if (row == 1 && machine_position_lost())
        output_line("[MSG:the position is lost: $POSITION=HERE takes what is counted for true.]");
}

void machine_reset(void) {
    bool moving = !path_at_front() || program_running();
    if (moving && !locked) {
        fault f = {.code = FAULT_RESET, .text = "reset by the operator during motion"};
        machine_alarm(&f);
    }
    stop();
    link_restart();
    hal_release_reset();
}

void machine_halted(unsigned detail, uint64_t cycle, const int32_t *position) {
    static const fault_code codes[] = {FAULT_HALT_LIMIT, FAULT_HALT_LIMIT, FAULT_HALT_FLOOR,
                                       FAULT_HALT_SERIES, FAULT_HALT_NO_DATA,
                                       FAULT_HALT_SERVO, FAULT_CONTACT};
    static const char *const texts[] = {
        "retraction stopped",
        "still short at the retractable limit",
        "still short where the way back ends (ceiling, soft limit or start of the path)",
        "too many shorts in series without new depth",
        "short without retraction data (G36)",
        "the servo would go back beyond the retractable limit or the ceiling or the soft limit",
        "contact with the discharge off; only a move away from the work goes on from here",
    };
    unsigned row = detail < sizeof codes / sizeof *codes ? detail : 0;
    if (codes[row] == FAULT_CONTACT)
        path_note_work(true);
    fault f = {.line = events_line()};
    fault_at(&f, codes[row], 0, "%s", texts[row]);
    alarm_at(&f, cycle, position);
}

void machine_tripped(unsigned cause, unsigned axes, uint64_t cycle, const int32_t *position) {
    if (locked && cause == CAUSE_POWER_ON)
        return;
    if (cause == CAUSE_CONTACT)
        path_note_work(true);
    fault f = {.line = events_line()};
    if (cause_loses_position(cause) || settings_get(SET_STEP_AXES))
        place = 0;
    cause_fault(&f, "interlock: ", cause, axes);
    cause_position(&f, machine_position_lost());
    alarm_at(&f, cycle, position);
}

void machine_events_lost(void) {
    fault f = {0};
    fault_at(&f, FAULT_EVENTS, 0, "events of the gateware were lost");
    machine_alarm(&f);
}
