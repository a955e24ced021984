// SPDX-License-Identifier: Apache-2.0
#include "app/watch.h"

#include "app/events.h"
#include "app/machine.h"
#include "app/motion_watch.h"
#include "app/program.h"
#include "base/settings.h"
#include "base/units.h"
#include "gap/gap.h"
#include "hal/hal.h"
#include "link/link.h"
#include "link/output.h"
#include "path/path.h"
#include "roughing/planner.h"

#define PET_START 0xa5
#define PET_END 0x5a
#define PET_INTERRUPT 0xc3

/* After a round of passes in which there was nothing to do the processor sleeps: an event or a byte
   wakes it, and what is only looked at (the end of a block, a time that is over) can wait so long. */
#define SLEEP_CLOCKS 3000

/* A task with more to do goes on for so long and so many steps: a short block or a piece of an arc
   takes several, and the three other tasks must not come in between each time. It is little enough
   for the bytes that come meanwhile to fit the gateware's queue. */
#define STRETCH_CLOCKS 12000
#define STRETCH_STEPS 8

static unsigned turn;
static bool busy;               /* something was done in this round */
static uint32_t worst[WATCH_TASKS];

/* The second key, unless the last call was just before: the next one is in time as well. */
static void end(void) {
    if (hal_watch_open())
        hal_pet(PET_END);
}

static void pet(void) {
    hal_pet(PET_START);
    end();
}

void watch_interrupt(void) {
    if (hal_watch_asked())
        hal_pet(PET_INTERRUPT);
}

void watch_boot(void) {
    turn = 0;
    busy = true;
    for (unsigned i = 0; i < WATCH_TASKS; i++)
        worst[i] = 0;
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
    program_init();
    planner_init();
    output_frame(program_offset());
    pet();
    hal_interrupts(true);
    link_init();
}

/* One step of a task; true if there was something to do. */
static bool step(unsigned task) {
    switch (task) {
    case 0: return events_step();
    case 1: return path_step();
    case 2: return program_step();
    default: return link_serve();
    }
}

/* The same between two calls of the watchdog: its period bounds the longest step, not their sum. It
   begins in clock `now`, which becomes that of its end. */
static bool watched(unsigned task, bool (*work)(unsigned), uint32_t *now) {
    uint32_t began = *now;
    hal_pet(PET_START);
    bool more = work(task);
    end();
    *now = hal_cycle_low();
    uint32_t spent = *now - began;
    worst[task] = spent > worst[task] ? spent : worst[task];
    busy = busy || more;
    return more;
}

static bool serve_link(unsigned task) {
    (void)task;
    return link_step();
}

static bool look(unsigned task) {
    motion_watch();
    return gap_watch() || step(task);
}

/* A pass serves the link and one other task. */
void watch_pass(void) {
    uint32_t now = hal_cycle_low();
    (void)watched(WATCH_TASKS - 1, serve_link, &now);
    unsigned task = turn++ % WATCH_TASKS;
    uint32_t began = now;
    bool more = watched(task, task ? step : look, &now);
    for (unsigned count = 1; more && task != WATCH_TASKS - 1 && count < STRETCH_STEPS &&
                             now - began < STRETCH_CLOCKS; count++)
        more = watched(task, step, &now);
    if (task == WATCH_TASKS - 1) {
        if (!busy) {
            hal_sleep(SLEEP_CLOCKS);
            pet(); /* or its time would be missing from the next pass */
        }
        busy = false;
    }
}

uint32_t watch_worst(unsigned task) { return worst[task]; }
