// SPDX-License-Identifier: Apache-2.0
/* Checks in the background that the firmware in memory is still what was loaded. Each step reads a
   few words; a whole round is compared with the digest. The check takes at most 1/100 of the
   clocks. Damaged firmware cannot be trusted, so the machine is not unlocked any more. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

/* Call the step in every round of the main loop. It raises an alarm and trips the interlock if the
   firmware is damaged. */
void image_watch_init(void);
void image_watch_step(void);

bool image_watch_sound(fault *f);       /* false with a fault if the firmware is damaged */
uint32_t image_watch_clocks(void);      /* clocks spent on the check since boot */
