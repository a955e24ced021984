// SPDX-License-Identifier: Apache-2.0
/* Hardware access of the target: what a check of board and wires looks at, and the coders' index. */
#include "hal/hal.h"
#include "hal/regs.h"

extern const uint32_t _start[]; /* of link.ld: the memory's first word */
#define SIZE_WORD 3         /* the memory's size in bytes; see start.S */

uint32_t hal_build(void) { return SYSTEM->build; }

hal_inputs hal_inputs_read(void) {
    return (hal_inputs){.levels = SAFETY->inputs, .voltage = FLUID->voltage, .cell = FLUID->level};
}

void hal_index_arm(uint32_t axes) { EVENT->index = axes; }

uint32_t hal_memory_words(void) { return _start[SIZE_WORD] / sizeof *_start; }

/* Without the flush a word that the data cache holds would come from there. */
void hal_memory_read(uint32_t first, uint32_t end) {
    const volatile uint32_t *word = _start;
    __asm__ volatile(".word 0x0000500f" ::: "memory"); /* VexRiscv: forget the data cache */
    for (uint32_t at = first; at < end; at++)
        (void)word[at];
}
