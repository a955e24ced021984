// SPDX-License-Identifier: Apache-2.0
#include "machine.h"

#include "events.h"
#include "hal.h"
#include "link.h"
#include "output.h"
#include "path.h"
#include "program.h"
#include "regs.h"
#include "settings.h"

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

static const char *const CAUSE_TEXT[CAUSES] = {
    [CAUSE_POWER_ON] = "nobody has cleared the interlock since power-on",
    [CAUSE_ESTOP] = "emergency stop",
    [CAUSE_DRIVE_FAULT] = "a drive reports a fault",
    [CAUSE_LIMIT_LOW] = "an axis is on its lower limit switch",
    [CAUSE_LIMIT_HIGH] = "an axis is on its upper limit switch",
    [CAUSE_FLUID_LOW] = "the fluid is below its level",
    [CAUSE_WATCHDOG] = "the firmware stopped calling the watchdog",
    [CAUSE_ERROR_SATURATED] = "an error counter reached its limit",
    [CAUSE_ENCODER] = "an encoder made an illegal transition",
    [CAUSE_FOLLOWING_STOPPED] = "following error at rest above its limit",
    [CAUSE_FOLLOWING_MOVING] = "following error in motion above its limit",
    [CAUSE_FIRMWARE] = "the firmware asked for it",
    [CAUSE_CODER] = "a coder does not tell what its axis does",
    [CAUSE_TRAVEL] = "a command would have left the soft limits",
    [CAUSE_CONTACT] = "the electrode touched the work with the discharge off",
    [CAUSE_GATE] = "the gap had current or voltage with both sources off",
    [CAUSE_MEMORY] = "the processor's memory read wrong",
    [CAUSE_GUARD] = "a guarded register of the gateware is damaged",
};

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

/* Causes after which the counted position may differ from the true one; with those below also where
   they come later than another cause. While the axes coast a following error is none. */
#define MISCOUNTS                                                                                  \
    (1u << CAUSE_ERROR_SATURATED | 1u << CAUSE_ENCODER | 1u << CAUSE_CODER | 1u << CAUSE_GUARD)
#define LOSES_POSITION                                                                             \
    (MISCOUNTS | 1u << CAUSE_FOLLOWING_STOPPED | 1u << CAUSE_FOLLOWING_MOVING)

static const char *cause_text(unsigned cause) {
    /* A wire machine's third drive is that of the wire. */
    if (cause == CAUSE_DRIVE_FAULT && hal_jump_axis() >= HAL_AXES)
        return "the wire is broken or a drive reports a fault";
    return cause < CAUSES ? CAUSE_TEXT[cause] : "unknown cause";
}

bool machine_unlock(fault *f) {
    if (!locked)
        return true;
    if (hal_motion_read().moving && !hal_safe())
        return fault_at(f, FAULT_LOCKED, 0, "the machine is still coming to rest");
    /* The command is set to the position while the outputs are still safe: cleared first, the drives
       would be enabled with the old error. */
    if (hal_safe()) {
        if (hal_causes() & MISCOUNTS)
            place = 0;
        for (unsigned axis = 0; axis < HAL_AXES; axis++)
            hal_axis_adopt(axis);
        hal_interlock_clear();
        for (unsigned i = 0; i < CLEAR_TRIES && hal_safe(); i++) {
        }
        if (hal_safe())
            return fault_at(f, FAULT_TRIP, 0, "the interlock stays open: %s",
                            cause_text(hal_first_cause()));
    }
    /* A path that begins here also ends the halted state. */
    events_drop();
    path_begin();
    program_resynchronise();
    locked = false;
    if (machine_position_lost())
        output_line("[MSG:the position is lost: $POSITION=HERE takes what is counted for true.]");
    return true;
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

void machine_tripped(unsigned cause, uint64_t cycle, const int32_t *position) {
    if (locked && cause == CAUSE_POWER_ON)
        return;
    if (cause == CAUSE_CONTACT)
        path_note_work(true);
    fault f = {.line = events_line()};
    if (LOSES_POSITION >> cause & 1 || settings_get(SET_STEP_AXES))
        place = 0;
    fault_at(&f, FAULT_TRIP, 0, "interlock: %s; the position is %s", cause_text(cause),
             machine_position_lost() ? "lost" : "kept");
    alarm_at(&f, cycle, position);
}

void machine_events_lost(void) {
    fault f = {0};
    fault_at(&f, FAULT_EVENTS, 0, "events of the gateware were lost");
    machine_alarm(&f);
}
