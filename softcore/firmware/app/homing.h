// SPDX-License-Identifier: Apache-2.0
/* What is known of a homing cycle (`$H`) under way, for the rooms below it; `homing_cycle` goes
   through the cycle.

   The limit switch at one end of an axis is its reference. The guard of the limit switches stays in
   force: a pressed switch makes the outputs safe by itself, as at any other time. The event of this
   trip has the place of the axis in its clock. In a homing cycle it is no alarm. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

typedef enum { HOMING_NONE, HOMING_SEEK, HOMING_STOP, HOMING_LEAVE } homing_phase;

typedef struct {
    homing_phase phase;
    unsigned axis;      /* the one that is homed; HAL_AXES before the first */
    bool down;          /* its switch is at its lower end */
    int32_t switched;   /* where the switch was pressed */
    uint32_t since;     /* clock from which on the axes have stood */
} homing_state;

extern homing_state homing_now;

void homing_init(void);
bool homing_active(void);

/* End the cycle with its answer: 0, or a fault. */
void homing_end(const fault *why);

/* End it: an alarm or a reset has come. Does nothing without one. */
void homing_stop(void);

/* The interlock has tripped. True if this was the switch that is looked for. */
bool homing_takes(unsigned cause, unsigned axes, const int32_t *place);

/* Has the cycle ended, and has its answer to `$H` not been taken? It is 0 or a fault. */
bool homing_answers(void);
const fault *homing_answer(void);
