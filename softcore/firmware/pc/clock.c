// SPDX-License-Identifier: Apache-2.0
/* The clock of the machine on a computer. */
#include "hal/hal.h"
#include "pc/host.h"

static uint64_t cycle;

void host_clock_boot(void) { cycle = 0; }
uint64_t hal_cycle(void) { return cycle; }
uint32_t hal_cycle_low(void) { return (uint32_t)cycle; }
void host_cost(uint32_t clocks) { cycle += clocks; }
