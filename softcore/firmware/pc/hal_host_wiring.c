// SPDX-License-Identifier: Apache-2.0
/* Board and wires of the model machine, as a test sets them. */
#include "hal/hal.h"
#include "pc/host.h"

#define BUILD 0x12345678u
#define WORDS 1000u     /* of the memory */

static hal_inputs inputs;
static uint32_t words_read;     /* of the memory, so far in order */

void host_wiring_boot(void) {
    inputs = (hal_inputs){0};
    words_read = 0;
}

void gk_inputs(uint32_t levels, uint32_t voltage, uint32_t cell) {
    inputs = (hal_inputs){levels, voltage, cell};
}

uint32_t gk_words_read(void) { return words_read; }

uint32_t hal_build(void) { return BUILD; }
hal_inputs hal_inputs_read(void) { return inputs; }

uint32_t hal_memory_words(void) { return WORDS; }

void hal_memory_read(uint32_t first, uint32_t end) {
    if (first == words_read)
        words_read = end;
}
