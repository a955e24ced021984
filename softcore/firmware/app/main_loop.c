// SPDX-License-Identifier: Apache-2.0
#include "app/main_loop.h"

#include "app/commands.h"
#include "app/control.h"
#include "app/events.h"
#include "app/image_watch.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/motion_watch.h"
#include "app/profile.h"
#include "app/program.h"
#include "base/alarm.h"
#include "base/settings.h"
#include "base/units.h"
#include "gap/gap.h"
#include "hal/hal.h"
#include "link/link.h"
#include "link/output.h"
#include "path/path.h"
#include "roughing/commands.h"

#define PET_START 0xa5
#define PET_END 0x5a
#define PET_INTERRUPT 0xc3

/* After a round of passes in which there was nothing to do the processor sleeps: an event or a byte
   wakes it, and what is only looked at (the end of a block, a time that is over) can wait so long. */
#define SLEEP_CLOCKS 3000

/* While the machine goes on by itself, and nothing waits to be told, it sleeps on: so many times so
   long. In between it looks at what comes without an event: an override, the next segment, the end of
   the path. After some of the sleeps it looks at what it watches over. The watchdog's interrupt waits
   for the end of a sleep: two sleeps must be shorter than its period. */
#define LONG_SLEEP_CLOCKS 4500
#define LONG_SLEEPS 16
#define SLEEPS_A_LOOK 4

/* A task with more to do goes on for so long and so many steps: a short block or a piece of an arc
   takes several, and the three other tasks must not come in between each time. It is little enough
   for the bytes that come meanwhile to fit the gateware's queue. */
#define STRETCH_CLOCKS 12000
#define STRETCH_STEPS 8

static unsigned turn;
static bool busy;               /* something was done in this round */
static bool calm;               /* no event and no byte has ended the last sleep */

/* The second key, unless the last call was just before: the next one is in time as well. */
static void end(void) {
    if (hal_watch_open())
        hal_pet(PET_END);
}

static void pet(void) {
    hal_pet(PET_START);
    end();
}

void main_loop_interrupt(void) {
    if (hal_watch_asked())
        hal_pet(PET_INTERRUPT);
}

void main_loop_boot(void) {
    turn = 0;
    busy = true;
    calm = false;
    profile_init();
    alarm_init();
    pet();
    units_init(hal_clock_hz(), hal_pulses_per_mm());
    output_init();
    pet();
    settings_init(pet);
    pet();
    gap_init();
    pet();
    events_init();
    path_init();
    machine_init();
    motion_watch_init();
    meter_init();
    image_watch_init();
    program_init();
    roughing_init();
    output_frame(program_offset());
    pet();
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

/* The same between two calls of the watchdog: its period bounds the longest step, not their sum. It
   begins in clock `now`, which becomes that of its end. */
static bool watched(unsigned task, bool (*work)(unsigned), uint32_t *now) {
    uint32_t began = *now;
    hal_pet(PET_START);
    bool more = work(task);
    if (alarm_raised())
        control_take_alarm();
    if (program_answers())
        commands_answer_program();
    end();
    *now = hal_cycle_low();
    profile_note(task, *now - began);
    busy = busy || more;
    return more;
}

static bool serve_link(unsigned task) {
    (void)task;
    return commands_step();
}

/* Is all as it should be? True if it took its time. */
static bool watch_over(unsigned task) {
    (void)task;
    motion_watch_step();
    meter_step();
    image_watch_step();
    gap_view view = {.machining = machine_burns(), .held = machine_held(),
                     .at_front = gap_serves() && path_at_front()};
    return gap_watch(&view);
}

static bool look(unsigned task) { return watch_over(task) || step(task); }

/* The machine goes on by itself, and nothing waits to be told. */
static bool goes_by_itself(void) {
    return path_goes_on() && events_idle() && !alarm_untold() && gap_settled() && link_rests();
}

/* True if nothing has ended it before its time. */
static bool sleep_for(uint32_t clocks) {
    uint32_t began = hal_cycle_low();
    hal_sleep(clocks);
    bool whole = hal_cycle_low() - began >= clocks;
    pet(); /* or its time would be missing from the next pass */
    return whole;
}

/* Between two long sleeps, after so many: may there be another? */
static bool sleeps_on(unsigned count) {
    uint32_t now = hal_cycle_low();
    bool brought = count % SLEEPS_A_LOOK == 0 && watched(0, watch_over, &now);
    return !brought && path_goes_on() && events_idle() && !alarm_untold() && !commands_wait();
}

/* Ends with an event or a byte, or when it is time for a round. Apart from the pass, which has to be
   quick. */
__attribute__((noinline)) static void sleep_when_idle(void) {
    bool on = goes_by_itself();
    unsigned count = 0;
    do
        calm = sleep_for(on ? LONG_SLEEP_CLOCKS : SLEEP_CLOCKS);
    while (on && calm && ++count < LONG_SLEEPS && sleeps_on(count));
}

/* A pass serves the link and one other task; the link once in a round if nothing comes. */
void main_loop_pass(void) {
    uint32_t now = hal_cycle_low();
    unsigned task = turn++ % PROFILE_TASKS;
    if (!calm || busy || task == PROFILE_TASKS - 1)
        (void)watched(PROFILE_TASKS - 1, serve_link, &now);
    uint32_t began = now;
    bool more = watched(task, task ? step : look, &now);
    for (unsigned count = 1; more && task != PROFILE_TASKS - 1 && count < STRETCH_STEPS &&
                             now - began < STRETCH_CLOCKS; count++)
        more = watched(task, step, &now);
    if (task == PROFILE_TASKS - 1) {
        if (!busy)
            sleep_when_idle();
        busy = false;
    }
}
