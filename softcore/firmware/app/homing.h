// SPDX-License-Identifier: Apache-2.0
/* The homing cycle (`$H`): finds the reference switches of the axes, one axis after the other.

   The limit switch at one end of an axis is its reference. The axis goes onto it fast, leaves it,
   and goes onto it again slowly. The guard of the limit switches stays in force: a pressed switch
   makes the outputs safe by itself, as at any other time. The event of this trip has the place of
   the axis in its clock. In a homing cycle it is no alarm. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"
#include "hal/hal.h"

void homing_init(void);

/* Begin the cycle, also on a locked machine, which this unlocks. False with a fault if it cannot. */
bool homing_begin(fault *f);
bool homing_active(void);
void homing_step(void);         /* call all the time */

/* End it: an alarm or a reset has come. */
void homing_stop(void);

/* The interlock has tripped. True if this was the switch that is looked for. */
bool homing_takes(unsigned cause, unsigned axes, const int32_t *place);

/* Has the cycle ended, and has its answer to `$H` not been taken? It is 0 or a fault. */
bool homing_answers(void);
const fault *homing_answer(void);
