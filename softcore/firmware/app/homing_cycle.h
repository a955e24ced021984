// SPDX-License-Identifier: Apache-2.0
/* The homing cycle (`$H`): finds the reference switches of the axes, one axis after the other.

   An axis goes onto its switch fast, leaves it, goes onto it again slowly, and leaves it. If its
   coder's index is its reference, it goes on until that comes, and back onto it. */
#pragma once
#include <stdbool.h>

#include "base/fault.h"

/* Begin the cycle. A locked machine is unlocked. False with a fault if it cannot begin. */
bool homing_cycle_begin(fault *f);
void homing_cycle_step(void);   /* call in every pass of the main loop */
