// SPDX-License-Identifier: Apache-2.0
/* Lines that check the board and its wires, with the discharge off:

     $INPUTS             tell gateware, clock, and what the inputs and the converter say
     $MEMORY             read every word of the memory, which checks their parities
     $LEVELS=open,arc    try these levels of the comparators, in 1/1024 of full scale; the
                         converter runs meanwhile
     $LEVELS             end that

   `$INPUTS` is answered by `[BUILD:gateware,clock,cycle]`: the digest of the gateware's sources
   (0 in a simulation), Hz, and the lower 32 bits of the clock count. Then
   `[INPUTS:levels,voltage,cell,fluid]`: the register `safety.inputs`; the converter's last code of
   the gap voltage, and the last average of the fluid's cell; and hal_fluid_state. `$MEMORY` is
   answered by `[MEMORY:bytes]`. After a wrong parity there is no answer: the gateware holds the
   processor, and tells it.

   Levels that are tried end with `$LEVELS`, with a new condition, at a reset, and before the
   discharge comes on. The short level stays as it is, so that contact is seen. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

bool wiring_allowed(fault *f);  /* false with the reason while the discharge is on */
void wiring_tell_inputs(void);

/* Read the next words of the memory after `done` of them; returns how many are done. Sends the line
   after the last. */
uint32_t wiring_read_memory(uint32_t done);

/* Carry out a line that begins with `$LEVELS`. False if it is refused, with the reason in `f`. */
bool wiring_levels(const char *line, uint32_t length, fault *f);
