// SPDX-License-Identifier: Apache-2.0
/* Is the firmware in memory still what was loaded? Its words are held against their digest in the
   background, a few in a step, in at most 1/64 of the clocks. A word that is damaged stays so: what
   else the firmware does can no longer be trusted, and the machine is not unlocked. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

/* In every round of the main loop. If not, an alarm is raised and the interlock tripped. */
void image_watch_init(void);
void image_watch_step(void);

bool image_watch_sound(fault *f);       /* false, with the fault, if it was found damaged */
uint32_t image_watch_clocks(void);      /* that this has taken since boot */
