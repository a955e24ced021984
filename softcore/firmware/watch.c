// SPDX-License-Identifier: Apache-2.0
#include "watch.h"

#include "events.h"
#include "gap.h"
#include "hal.h"
#include "link.h"
#include "machine.h"
#include "output.h"
#include "path.h"
#include "planner.h"
#include "program.h"
#include "settings.h"
#include "units.h"

#define PET_START 0xa5
#define PET_END 0x5a

/* After a round of passes in which there was nothing to do the processor sleeps: an event or a byte
   wakes it, and what is only looked at (the end of a block, a time that is over) can wait so long. */
#define SLEEP_CLOCKS 3000

static unsigned turn;
static bool busy;               /* something was done in this round */
static uint32_t worst[WATCH_TASKS];

static void pet(void) {
    hal_pet(PET_START);
    hal_pet(PET_END);
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
    program_init();
    planner_init();
    output_frame(program_offset());
    pet();
    hal_interrupts(true);
    link_restart();
}

/* A pass serves the link and one other task: the watchdog's period bounds the longest of them, not
   their sum. */
void watch_pass(void) {
    uint32_t began = hal_cycle_low();
    hal_pet(PET_START);
    busy = link_step() || busy;
    hal_pet(PET_END);
    hal_pet(PET_START);
    unsigned task = turn++ % WATCH_TASKS;
    switch (task) {
    case 0:
        busy = gap_watch() || events_step() || busy;
        break;
    case 1: busy = path_step() || busy; break;
    case 2: busy = program_step() || busy; break;
    default: busy = link_serve() || busy; break;
    }
    hal_pet(PET_END);
    uint32_t spent = hal_cycle_low() - began;
    worst[task] = spent > worst[task] ? spent : worst[task];
    if (task == WATCH_TASKS - 1) {
        if (!busy) {
            hal_sleep(SLEEP_CLOCKS);
            pet(); /* or its time would be missing from the next pass */
        }
        busy = false;
    }
}

uint32_t watch_worst(unsigned task) { return worst[task]; }
