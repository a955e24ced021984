// SPDX-License-Identifier: Apache-2.0
/* The homing cycle (`$H`): finds the reference switches of the axes, one axis after the other.

   The axis goes onto its switch fast, leaves it, and goes onto it again slowly. */
#pragma once
#include <stdbool.h>

#include "base/fault.h"

/* Begin the cycle, also on a locked machine, which this unlocks. False with a fault if it cannot. */
bool homing_cycle_begin(fault *f);
void homing_cycle_step(void);   /* call all the time */
