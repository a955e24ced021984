// SPDX-License-Identifier: Apache-2.0
#include "watch.h"

#include "events.h"
#include "hal.h"
#include "link.h"
#include "machine.h"
#include "output.h"
#include "path.h"
#include "program.h"
#include "settings.h"
#include "units.h"

#define PET_START 0xa5
#define PET_END 0x5a

/* A round of passes none of which took longer only looked around. The processor may then sleep: an
   event or a byte wakes it, and what is only looked at (the end of a block) can wait so long. */
#define IDLE_CLOCKS 600
#define SLEEP_CLOCKS 3000

static unsigned turn;
static uint32_t longest;
static uint32_t worst[WATCH_TASKS];

static void pet(void) {
    hal_pet(PET_START);
    hal_pet(PET_END);
}

void watch_boot(void) {
    turn = 0;
    for (unsigned i = 0; i < WATCH_TASKS; i++)
        worst[i] = 0;
    pet();
    units_init(hal_clock_hz(), hal_pulses_per_mm());
    output_init();
    pet();
    settings_init();
    pet();
    events_init();
    path_init();
    machine_init();
    program_init();
    output_frame(program_offset());
    pet();
    hal_interrupts(true);
    link_restart();
}

/* A pass serves the link and one other task: the watchdog's period bounds the longest task, not
   their sum. */
void watch_pass(void) {
    uint32_t began = hal_cycle_low();
    hal_pet(PET_START);
    link_step();
    unsigned task = turn++ % WATCH_TASKS;
    switch (task) {
    case 0: events_step(); break;
    case 1: path_step(); break;
    case 2: program_step(); break;
    default: link_serve(); break;
    }
    hal_pet(PET_END);
    uint32_t spent = hal_cycle_low() - began;
    worst[task] = spent > worst[task] ? spent : worst[task];
    longest = spent > longest ? spent : longest;
    if (task == WATCH_TASKS - 1) {
        if (longest < IDLE_CLOCKS)
            hal_sleep(SLEEP_CLOCKS);
        longest = 0;
    }
}

uint32_t watch_worst(unsigned task) { return worst[task]; }
