// SPDX-License-Identifier: Apache-2.0
/* Compensation of the error of the screws' pitch, from the table of each axis in the settings.

   The error is how far the screw takes the axis too far up at a place: linear between the points,
   beyond the ends that of the end, rounded to pulses. It depends on the place alone. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

bool pitch_sound(fault *f);     /* false with a fault if a table is too steep */

/* Make up for the error at the place of each axis; for none. Each axis walks there by a pulse every
   32 us. */
void pitch_follow(void);
void pitch_none(void);
