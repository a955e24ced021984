// SPDX-License-Identifier: Apache-2.0
/* Why the interlock has tripped, in words. */
#pragma once
#include <stdbool.h>
#include <stddef.h>

/* "axis Z", "axes X and Z"; of a mask, bit 0 X. Returns the length. */
size_t cause_axes(char *buffer, size_t size, unsigned axes);

/* A cause of `CAUSE_...`, with the axes that raised it and what the gateware knows beside; the details
   are those of now. */
size_t cause_text(char *buffer, size_t size, unsigned cause, unsigned axes);

/* May the counted position differ from the true one after it? */
bool cause_loses_position(unsigned cause);
