// SPDX-License-Identifier: Apache-2.0
#include "app/main_loop.h"

#include "app/commands.h"
#include "app/control.h"
#include "app/events.h"
#include "app/firmware.h"
#include "app/homing.h"
#include "app/homing_cycle.h"
#include "app/image_watch.h"
#include "app/jog.h"
#include "app/jogging.h"
#include "app/keep.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/motion_watch.h"
#include "app/pitch_watch.h"
#include "app/profile.h"
#include "app/program.h"
#include "app/touch.h"
#include "app/walk.h"
#include "base/alarm.h"
#include "base/settings.h"
#include "base/units.h"
#include "base/watch.h"
#include "gap/gap.h"
#include "hal/hal.h"
#include "link/link.h"
#include "link/output.h"
#include "path/path.h"
#include "roughing/commands.h"

#define PET_INTERRUPT 0xc3

/* After a round of passes without work the processor sleeps for this long. An event or a byte wakes
   it. Conditions that are only polled (the end of a block, an elapsed time) can wait this long. */
#define SLEEP_CLOCKS 3000

/* While the machine moves on or rests without help and nothing waits to be told, the processor
   sleeps longer: up to LONG_SLEEPS times LONG_SLEEP_CLOCKS. After each sleep it polls what comes
   without an event: an override, the next segment, the end of the path. After every SLEEPS_A_LOOK
   sleeps it also runs its checks of the machine. The watchdog's interrupt waits for the end of a
   sleep, so two sleeps must be shorter than the watchdog's period. A jog and a touch-off are looked
   at in every round: there is none of these long sleeps then. */
#define LONG_SLEEP_CLOCKS 4500
#define LONG_SLEEPS 64
#define SLEEPS_A_LOOK 6

/* A task with more work may go on for this many clocks and steps. A short block or a piece of an
   arc needs several steps, and the other tasks must not delay each of them. Bytes that come
   meanwhile still fit into the gateware's queue. */
#define STRETCH_CLOCKS 12000
#define STRETCH_STEPS 8

static unsigned turn;
static bool busy;               /* a task had work in this round */
static bool worked;             /* a task had work in the last round */
static bool checks;             /* the checks of the machine are made in this round */
static bool calm;               /* no event and no byte ended the last sleep early */

static void pet(void) {
    watch_begin();
    watch_end();
}

void main_loop_interrupt(void) {
    if (hal_watch_asked())
        hal_pet(PET_INTERRUPT);
}

void main_loop_boot(void) {
    firmware_boot();
    turn = 0;
    busy = true;
    worked = checks = calm = false;
    profile_init();
    alarm_init();
    pet();
    units_init(hal_clock_hz(), hal_pulses_per_mm());
    output_init();
    pet();
    keep_open(pet);
    settings_init(keep_load_settings, pet);
    pet();
    gap_init();
    keep_load_gap();
    pet();
    events_init();
    path_init();
    machine_init();
    motion_watch_init();
    meter_init();
    image_watch_init();
    program_init();
    keep_load_places();
    jogging_init();
    homing_init();
    touch_init();
    walk_drop();
    roughing_init();
    output_frame(program_offset());
    pet();
    keep_begin(pet);
    hal_interrupts(true);
    commands_init();
}

/* One step of a task; true if there was something to do. */
static bool step(unsigned task) {
    switch (task) {
    case 0: return events_step();
    case 1: return path_step();
    case 2: return program_step();
    default: return commands_serve();
    }
}

/* Do a step between two calls of the watchdog, so that its period bounds the longest step and not
   the sum of steps. `now` is the clock at the start, and afterwards the clock at the end. */
static bool watched(unsigned task, bool (*work)(unsigned), uint32_t *now) {
    uint32_t began = *now;
    watch_begin();
    bool more = work(task);
    if (alarm_raised())
        control_take_alarm();
    if (program_answers() || homing_answers() || firmware_answers())
        commands_answer_program();
    watch_end();
    *now = hal_cycle_low();
    profile_note(task, *now - began);
    busy = busy || more;
    return more;
}

static bool serve_link(unsigned task) {
    (void)task;
    return commands_step();
}

/* Run the checks of the machine; true if gap_watch had work. */
static bool watch_over(unsigned task) {
    (void)task;
    motion_watch_step();
    meter_step();
    jogging_step();
    walk_step();
    homing_cycle_step();
    if (settings_screws())
        pitch_watch_step();
    image_watch_step();
    gap_view view = {.machining = machine_burns(), .held = machine_held(),
                     .at_front = gap_serves() && path_at_front()};
    bool keeps = keep_step();
    return gap_watch(&view) || keeps;
}

/* The checks and a step may each take long. After a round with work, whose blocks may be short, the
   checks wait for the next round, unless a change of the condition waits for them. */
static bool look(unsigned task) {
    checks = !worked || !checks || !gap_settled();
    if (checks) {
        if (watch_over(task))
            return true;
        watch_between();
    }
    return step(task);
}

/* Is nothing under way? The steps of a homing cycle are among the checks of the machine. */
static bool rests(void) {
    return !program_running() && path_at_front() && meter_rests() && !keep_waits();
}

/* Does the machine move on, or rest, without help? `moves` says which. */
static bool goes_by_itself(bool *moves) {
    *moves = path_goes_on();
    return *moves || rests();
}

/* Does nothing wait to be told or looked at? This changes only with an event, a byte or work. A
   byte ends a sleep. An event need not: the interrupt may take it before one, or as one ends. */
static bool nothing_waits(void) {
    return events_idle() && !alarm_untold() && gap_settled() && link_rests() && !jog_active() &&
           touch_now() == TOUCH_NONE;
}

/* True if the sleep lasted its whole time. */
static bool sleep_for(uint32_t clocks) {
    uint32_t began = hal_cycle_low();
    hal_sleep(clocks);
    bool whole = hal_cycle_low() - began >= clocks;
    pet(); /* the sleep must not shorten the time that the next pass has */
    return whole;
}

/* The checks between two sleeps; false if they end the sleep. */
static bool sleeps_through_checks(void) {
    uint32_t now = hal_cycle_low();
    return !watched(0, watch_over, &now) && nothing_waits();
}

/* Sleep until an event or a byte comes, or until it is time for a round. Not inlined into the pass,
   which must stay quick. */
__attribute__((noinline)) static void sleep_when_idle(void) {
    bool moves;
    if (!goes_by_itself(&moves) || !nothing_waits()) {
        calm = sleep_for(SLEEP_CLOCKS);
        return;
    }
    unsigned left = LONG_SLEEPS, unseen = 0; /* sleeps to come, and those since the last checks */
    while ((calm = sleep_for(LONG_SLEEP_CLOCKS)) && --left) {
        bool goes_on = false;
        if (++unseen < SLEEPS_A_LOOK) {
            goes_on = events_idle() && (moves ? path_goes_further() : rests());
        } else if (sleeps_through_checks()) {
            unseen = 0;
            goes_on = goes_by_itself(&moves);
        }
        if (!goes_on || commands_wait())
            return;
    }
}

/* A pass serves the link and one other task. While nothing happens it serves the link once in a
   round. The next step of a depth series is staged before the next event is told. */
void main_loop_pass(void) {
    uint32_t now = hal_cycle_low();
    unsigned task = turn++ % PROFILE_TASKS;
    if (!calm || busy || task == PROFILE_TASKS - 1)
        (void)watched(PROFILE_TASKS - 1, serve_link, &now);
    uint32_t began = now;
    bool more = watched(task, task ? step : look, &now);
    for (unsigned count = 1; more && task != PROFILE_TASKS - 1 && count < STRETCH_STEPS &&
                             now - began < STRETCH_CLOCKS; count++)
        more = watched(task, task || gap_settled() ? step : look, &now);
    if (task == PROFILE_TASKS - 1) {
        if (!busy)
            sleep_when_idle();
        worked = busy;
        busy = false;
    }
}
