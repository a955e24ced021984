// SPDX-License-Identifier: Apache-2.0
/* Compensation of the error of the screws' pitch, from the table of each axis in the settings.

   The error is how far the screw takes the axis too far up at a place: linear between the points,
   beyond the ends that of the end, rounded to pulses. It depends on the place alone. What is made
   up for is the error less that of the place where the position became known: there it is 0, so
   that no axis moves when its position becomes known. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "base/fault.h"

/* False with a fault if a table is too steep, or its errors are too far apart. */
bool pitch_sound(fault *f);

void pitch_refer(void);     /* the position has become known: what is made up for stays */

/* Make up for the error at the place of each axis. It walks there by a pulse every 32 us. */
void pitch_follow(void);
