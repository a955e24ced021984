// SPDX-License-Identifier: Apache-2.0
#include "app/wiring.h"

#include "app/machine.h"
#include "base/settings.h"
#include "base/watch.h"
#include "gap/gap.h"
#include "hal/hal.h"
#include "link/output.h"

#define NAME 7u         /* characters of `$LEVELS` */
#define LEVELS 1024u
#define SLICE 128u      /* words in a step: some 3500 clocks */

bool wiring_allowed(fault *f) {
    return !machine_machining() ||
           fault_at(f, FAULT_BUSY, 0, "only with the discharge off: M05 comes first");
}

void wiring_tell_inputs(void) {
    hal_inputs now = hal_inputs_read();
    output_line("[BUILD:%u,%u,%u]", hal_build(), hal_clock_hz(), hal_cycle_low());
    output_line("[INPUTS:%u,%u,%u,%u]", now.levels, now.voltage, now.cell, hal_fluid_state());
}

uint32_t wiring_read_memory(uint32_t done) {
    uint32_t words = hal_memory_words(), end = words - done < SLICE ? words : done + SLICE;
    hal_memory_read(done, end);
    if (end == words)
        output_line("[MEMORY:%u]", words * (uint32_t)sizeof(uint32_t));
    return end;
}

bool wiring_levels(const char *line, uint32_t length, fault *f) {
    uint32_t at = NAME, open = 0, arc = 0;
    bool begins = length > NAME;
    if (begins &&
        (line[at++] != '=' || !settings_read_number(line, length, &at, &open) || at == length ||
         line[at++] != ',' || !settings_read_number(line, length, &at, &arc) || at < length ||
         open >= LEVELS || arc >= LEVELS))
        return fault_at(f, FAULT_COMMAND, 0, "levels of the comparators are tried by $LEVELS=open,arc, "
                                             "each 0 to %u", LEVELS - 1);
    if (!wiring_allowed(f))
        return false;
    watch_between();
    gap_try(begins, open, arc);
    return true;
}
