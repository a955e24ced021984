// SPDX-License-Identifier: Apache-2.0
/* The clock of the model machine. */
#include "hal/hal.h"
#include "pc/host.h"

static uint64_t cycle;
static uint32_t sleeps;
static uint32_t whole;         /* number of further sleeps that last their whole time */
static int32_t goes;           /* pulses that the machine moves in each of them */

void host_clock_boot(void) {
    cycle = 0;
    sleeps = 0;
    whole = 0;
    goes = 0;
}

uint64_t hal_cycle(void) { return cycle; }
uint32_t hal_cycle_low(void) { return (uint32_t)cycle; }
void host_cost(uint32_t clocks) { cycle += clocks; }

int32_t host_sleep(uint32_t clocks) {
    sleeps++;
    if (!whole)
        return 0;
    whole--;
    host_cost(clocks);
    return goes;
}

uint32_t gk_sleeps(void) { return sleeps; }
void gk_sleep_lasts(uint32_t times, int32_t pulses) {
    whole = times;
    goes = pulses;
}
